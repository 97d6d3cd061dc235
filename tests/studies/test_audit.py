"""Audits of logs made by hand, whose ratios are known, and of episodes."""

import dataclasses

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from studies.audit import EpisodeLog, Recorder, check_limits, near_child, strike_times

ROBOT = find_embodiment()
CONTROL, PHYSICS = 0.02, 0.005  # seconds
STEPS = 100
TUCKED = [0.0, -0.66, 0.0, -2.25, 0.0, 2.55, 0.785]
LIMITS_NAMED = (
    "arm velocity, commanded",
    "arm acceleration, commanded",
    "arm jerk, commanded",
    "base speed, measured",
    "finger speed, commanded",
)


def still(**changes):
    """The log of a robot that does not move, a metre and more from the child."""
    m = STEPS * 4
    log = EpisodeLog(
        control_timestep=CONTROL,
        physics_timestep=PHYSICS,
        commands=np.tile(np.linspace(-1.0, 1.0, 12), (STEPS, 1)),
        base_velocity=np.zeros((m, 3)),
        arm_position=np.tile(TUCKED, (m, 1)),
        arm_velocity=np.zeros((m, 7)),
        arm_torque=np.zeros((m, 7)),
        finger_velocity=np.zeros((m, 2)),
        pads=np.zeros(m, int),
        pressure_centre=np.zeros((m, 2)),
        distance=np.full((m, 2), np.inf),
        speed=np.zeros((m, 2)),
        approach=np.zeros((m, 2)),
        contact_speed=np.full(m, -np.inf),
    )
    return dataclasses.replace(log, **changes)


def commands(column, values):
    changed = still().commands
    changed[:, column] += values
    return changed


def ratios(log):
    return {check.name: check.ratio for check in check_limits(log, ROBOT)}


def near(m=STEPS * 4, **cells):
    """Arrays (m, 2) that are as in `still` but for given {(step, part): value}."""
    arrays = {"distance": np.full((m, 2), np.inf), "speed": np.zeros((m, 2)), "approach": np.zeros((m, 2))}
    for name, changes in cells.items():
        for place, value in changes.items():
            arrays[name][place] = value
    return arrays


# -- Limits ------------------------------------------------------------------------------------------


def test_nothing_moves():
    assert ratios(still()) == dict.fromkeys(LIMITS_NAMED, 0.0)


def test_arm_velocity_against_the_joints_own_limit():
    # Joint 5 (5.26 rad/s) and joint 2 (2.62 rad/s) run at 1.31 rad/s: half of joint 2's limit.
    ramp = 1.31 * CONTROL * np.arange(STEPS)
    log = still(commands=commands([4, 7], ramp[:, None]))
    check = check_limits(log, ROBOT)[0]
    assert (check.name, check.where, check.unit) == ("arm velocity, commanded", "joint2", "rad/s")
    assert check.ratio == pytest.approx(0.5)
    assert check.worst == pytest.approx(1.31)


def test_arm_acceleration_and_its_moment():
    # From rest after 60 timesteps, with 12 rad/s^2 for one timestep: 0.0048 rad a timestep from then on.
    n = np.arange(STEPS)
    log = still(commands=commands(3, 0.0048 * np.maximum(n - 59, 0)))
    velocity, acceleration, jerk = check_limits(log, ROBOT)[:3]
    assert velocity.worst == pytest.approx(0.24)
    assert acceleration.ratio == pytest.approx(1.2)
    assert acceleration.where == "joint1"
    assert acceleration.time == pytest.approx(1.2)
    assert jerk.worst == pytest.approx(600.0)  # 12 rad/s^2 within 0.02 s
    assert jerk.ratio == pytest.approx(0.12)


def test_arm_jerk():
    # Acceleration up by 110 rad/s^2 within a timestep: 5500 rad/s^3.
    step = np.where(np.arange(STEPS) < 50, 0.0, 1.0)
    values = np.cumsum(np.cumsum(step)) * 110.0 * CONTROL**2
    assert ratios(still(commands=commands(9, values)))["arm jerk, commanded"] == pytest.approx(1.1)


def test_the_first_commands_count_from_rest():
    # A sudden start in the very first timesteps is no exception.
    values = 0.1 * (np.arange(STEPS) > 0)
    assert ratios(still(commands=commands(3, values)))["arm velocity, commanded"] == pytest.approx(5.0 / 2.62)


def test_base_speed_is_that_of_the_vector_at_every_physics_step():
    # 3 km/h and 4 km/h at right angles are 5 km/h, and neither alone exceeds anything.
    velocity = np.zeros((STEPS * 4, 3))
    velocity[:, 2] = 2.0
    velocity[123] = 3 / 3.6, -4 / 3.6, 0.0
    check = check_limits(still(base_velocity=velocity), ROBOT)[3]
    assert check.ratio == pytest.approx(1.0)
    assert check.time == pytest.approx(123 * PHYSICS)


def test_finger_speed():
    values = 0.1 * CONTROL * np.arange(STEPS)
    check = check_limits(still(commands=commands(11, -values)), ROBOT)[4]
    assert check.ratio == pytest.approx(0.8)
    assert check.where == "right"


def test_base_commands_are_not_taken_for_joints():
    log = still(commands=commands([0, 1, 2], np.random.default_rng(0).normal(size=(STEPS, 3))))
    assert ratios(log) == dict.fromkeys(LIMITS_NAMED, 0.0)


# -- Near the child ----------------------------------------------------------------------------------


def test_separation_of_the_part_that_moves():
    # Part 0 rests at 0.1 m; part 1 moves at 0.3 m, and towards the child at 0.6 m.
    log = still(
        **near(
            distance={(3, 0): 0.1, (3, 1): 0.3, (9, 1): 0.6},
            speed={(3, 1): 0.2, (9, 1): 0.2},
            approach={(9, 1): 0.2},
        )
    )
    result = near_child(log)
    assert (result.separation, result.approach_separation) == (0.3, 0.6)
    assert result.fast_seconds == 0.0


def test_time_that_a_part_is_fast_within_half_a_metre():
    fast = {(i, part): 0.3 for i in range(20, 30) for part in (0, 1)}  # ten steps, both parts at once
    close = {(i, part): 0.4 if i < 26 else 0.6 for i in range(20, 30) for part in (0, 1)}  # six of them close
    assert near_child(still(**near(speed=fast, distance=close))).fast_seconds == pytest.approx(6 * PHYSICS)


def test_worst_contact_and_strikes():
    contact = np.full(STEPS * 4, -np.inf)
    contact[10:13] = -0.2, 0.04, 0.07
    log = still(contact_speed=contact)
    assert near_child(log).contact_speed == 0.07
    assert strike_times(log) == pytest.approx([12 * PHYSICS])


def test_no_child_near():
    result = near_child(still())
    assert (result.separation, result.approach_separation) == (np.inf, np.inf)
    assert (result.fast_seconds, result.contact_speed) == (0.0, 0.0)


# -- Logs of episodes --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def episode():
    """Eighty seconds in which the robot picks and places, beside a child."""
    env = caregiver_mj.load("supervise", "paper", epsilon=0.5, random=1)
    policy = caregiver_mj.CaregiverPolicy(env)
    log = EpisodeLog.record(env, policy, 4000)
    assert policy.interventions_done > 0
    return log


def test_every_limit_is_kept(episode):
    for check in check_limits(episode, ROBOT):
        assert check.ratio <= 1.0, check


def test_the_robot_was_at_work(episode):
    worked = ratios(episode)
    assert worked["arm velocity, commanded"] > 0.5
    assert worked["base speed, measured"] > 0.8
    assert worked["finger speed, commanded"] > 0.5


def test_every_physics_step_is_logged(episode):
    assert len(episode.commands) == 4000
    for name in {field.name for field in dataclasses.fields(EpisodeLog) if field.type == "np.ndarray"} - {"commands"}:
        assert len(getattr(episode, name)) == 16000


def test_a_log_survives_its_file(episode, tmp_path):
    episode.save(tmp_path / "log.npz")
    again = EpisodeLog.load(tmp_path / "log.npz")
    for field in dataclasses.fields(EpisodeLog):
        before, after = getattr(episode, field.name), getattr(again, field.name)
        assert type(before) is type(after)
        assert np.array_equal(before, after)


def test_looking_on_changes_nothing():
    def positions(watched):
        env = caregiver_mj.load("supervise", "paper", epsilon=0.5, random=3)
        policy = caregiver_mj.CaregiverPolicy(env)
        if watched:
            EpisodeLog.record(env, policy, 300)
        else:
            timestep = env.reset()
            for _ in range(300):
                timestep = env.step(policy(timestep))
        return env.physics.data.qpos.copy()

    assert np.array_equal(positions(True), positions(False))


def test_recorder_measures_distance_and_approach():
    hall = FloorPlan.parse("############\n#B.........#\n############", "hall")
    env = caregiver_mj.load("supervise", hall, epsilon=0.5, random=0)
    env.reset()
    physics = env.physics
    x, y, _ = physics.toddler_position()
    arm = physics.arm_position()
    ahead = -np.sign(x)  # towards the hall's middle
    physics.set_robot(np.array([x + ahead, y, 0.7]), arm)
    physics.forward()
    command = np.zeros(12)
    command[0], command[3:10] = -0.3 * ahead, arm
    with Recorder(env) as recorder:
        physics.set_control(command)
        physics.step(100)  # without the task, which would move the child
    log = recorder.log()
    hull = 0
    assert log.distance[0, hull] == pytest.approx(1.0 - 0.27 - 0.12, abs=0.005)
    closing = -np.diff(log.distance, axis=0) / PHYSICS
    assert closing[-1, hull] == pytest.approx(0.3, abs=0.02)
    near = np.isfinite(closing)
    assert near.mean() > 0.9
    assert log.approach[1:][near] == pytest.approx(closing[near], abs=0.02)
    assert (np.abs(log.approach) <= log.speed + 1e-9).all()


def test_recorder_measures_contact_with_the_child():
    env = caregiver_mj.load("supervise", "paper", epsilon=0.5, random=0)
    env.reset()
    physics = env.physics
    x, y, _ = physics.toddler_position()
    arm = physics.arm_position()
    physics.set_robot(np.array([x - 0.385, y, 0.0]), arm)  # overlaps by 5 mm: radii are 0.27 and 0.12
    action = np.zeros(env.action_spec().shape)
    action[0], action[3:10] = 0.3, arm
    with Recorder(env) as recorder:
        for _ in range(5):
            env.step(action)
    log = recorder.log()
    result = near_child(log)
    assert -0.03 < result.separation < 0.0
    assert 0.05 < result.contact_speed <= 0.32
    assert len(strike_times(log)) > 0
    # The recorder is gone: nothing is added any more.
    env.step(action)
    assert len(recorder.log().commands) == 5
