"""Audits of logs made by hand, whose ratios are known, of a robot in the simulation, and of episodes."""

import dataclasses

import mujoco
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from studies.audit import (
    Audit,
    Check,
    Dynamics,
    EpisodeLog,
    NearChild,
    Recorder,
    check_limits,
    check_motion,
    near_child,
)
from study import main

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


def test_arm_velocity_against_the_joints_own_limit():
    # Joint 5 (5.26 rad/s) and joint 2 (2.62 rad/s) run at 1.31 rad/s: half of joint 2's limit.
    ramp = 1.31 * CONTROL * np.arange(STEPS)
    log = still(commands=commands([4, 7], ramp[:, None]))
    check = check_limits(log, ROBOT)[0]
    assert (check.name, check.where, check.unit) == ("arm velocity, commanded", "joint2", "rad/s")
    assert (check.ratio, check.worst) == (pytest.approx(0.5), pytest.approx(1.31))


def test_arm_acceleration_and_its_moment():
    # From rest after 60 timesteps, with 12 rad/s^2 for one timestep: 0.0048 rad a timestep from then on.
    n = np.arange(STEPS)
    log = still(commands=commands(3, 0.0048 * np.maximum(n - 59, 0)))
    velocity, acceleration, jerk = check_limits(log, ROBOT)[:3]
    assert (velocity.worst, acceleration.ratio) == (pytest.approx(0.24), pytest.approx(1.2))
    assert (acceleration.where, acceleration.time) == ("joint1", pytest.approx(1.2))
    assert jerk.worst == pytest.approx(600.0)  # 12 rad/s^2 within 0.02 s
    assert jerk.ratio == pytest.approx(0.12)


def test_base_speed_is_that_of_the_vector_at_every_physics_step():
    # 3 km/h and 4 km/h at right angles are 5 km/h, and neither alone exceeds anything.
    velocity = np.zeros((STEPS * 4, 3))
    velocity[:, 2] = 2.0
    velocity[123] = 3 / 3.6, -4 / 3.6, 0.0
    check = check_limits(still(base_velocity=velocity), ROBOT)[3]
    assert (check.ratio, check.time) == (pytest.approx(1.0), pytest.approx(123 * PHYSICS))


def test_finger_speed_and_the_first_commands_which_count_from_rest():
    check = check_limits(still(commands=commands(11, -0.1 * CONTROL * np.arange(STEPS))), ROBOT)[4]
    assert (check.where, check.ratio) == ("right", pytest.approx(0.8))
    sudden = still(commands=commands(3, 0.1 * (np.arange(STEPS) > 0)))
    assert ratios(sudden)["arm velocity, commanded"] == pytest.approx(5.0 / 2.62)


# -- Limits of what is measured ----------------------------------------------------------------------


def checks(**columns):
    """Of what is measured, by name, with given ((step, column), value) of an array."""
    log = still()
    arrays = {name: getattr(log, name).copy() for name in columns}
    for name, changes in columns.items():
        for place, value in changes:
            arrays[name][place] = value
    return {check.name: check for check in check_motion(dataclasses.replace(log, **arrays), ROBOT)}


def test_a_jolt_of_the_arm_is_seen_at_5_ms_and_spread_over_20():
    # Joint 2 at 0.2 rad/s from one step to the next: 40 rad/s^2 over a step, 10 over four, and 8000 rad/s^3.
    found = checks(arm_velocity=[((slice(100, None), 1), 0.2)])
    assert found["arm acceleration, 5 ms"].ratio == pytest.approx(4.0)
    assert found["arm acceleration, 20 ms"].ratio == pytest.approx(1.0)
    assert found["arm jerk, 5 ms"].ratio == pytest.approx(1.6)
    assert found["arm jerk, 20 ms"].ratio == pytest.approx(0.1)
    assert (found["arm acceleration, 5 ms"].where, found["arm acceleration, 5 ms"].time) == ("joint2", 0.5)


@pytest.mark.parametrize(
    ("off", "held", "counts"), [(1, 90, False), (2, 90, False), (3, 90, True), (1, 98, True), (0, 90, True)]
)
def test_a_knock_from_a_candle_that_is_off_a_pad_for_a_moment_counts_over_20_ms_alone(off, held, counts):
    # 0.02 rad/s more from one step to the next are 4 rad/s^2 and 800 rad/s^3; over four, 1 and 50.
    pads = [(slice(held, None), 2), (slice(100, 100 + off), 1)]
    found = checks(pads=pads, base_velocity=[((slice(101, None), 2), 0.02)], arm_velocity=[((101, 3), 0.1)])
    turn = ROBOT.limits.turn
    assert found["turn jerk, 5 ms"].ratio == pytest.approx(800.0 / turn.jerk if counts else 0.0)
    assert found["arm acceleration, 5 ms"].ratio == pytest.approx(2.0 if counts else 0.0)
    assert found["turn jerk, 20 ms"].ratio == pytest.approx(50.0 / turn.jerk)
    assert found["arm acceleration, 20 ms"].ratio == pytest.approx(0.5)


def test_a_joint_must_be_slower_near_the_end_of_its_range():
    # 0.1 rad before the end of joint 2's range there are sqrt(5.17 * 0.1) - 0.2 = 0.519 rad/s left towards it.
    near = {"arm_position": [((50, 1), 1.6918)]}
    there = checks(**near, arm_velocity=[((50, 1), 0.5)])["arm velocity"]
    assert (there.limit, there.ratio) == (pytest.approx(0.519, abs=1e-3), pytest.approx(0.963, abs=1e-3))
    assert checks(**near, arm_velocity=[((50, 1), -0.5)])["arm velocity"].limit == 2.62


def test_base_is_judged_by_the_length_of_its_vectors():
    found = checks(base_velocity=[((slice(100, None), 0), 0.03), ((slice(100, None), 1), -0.04)])
    limits = ROBOT.limits
    assert found["base acceleration, 20 ms"].ratio == pytest.approx(2.5 / limits.base_acceleration)
    assert found["base jerk, 20 ms"].ratio == pytest.approx(125.0 / limits.base_jerk)
    assert found["base speed"].ratio == pytest.approx(0.05 / ROBOT.limits.base_speed)


def test_torque_and_fingers():
    found = checks(arm_torque=[((7, 5), -6.0), ((8, 0), 29.0)], finger_velocity=[((9, 1), -0.1)])
    assert (found["arm torque"].ratio, found["arm torque"].where) == (0.5, "joint6")
    assert found["finger speed"].ratio == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("place", "where", "ratio"), [((-0.0775, 0.0), "backwards", 0.5), ((0.0, 0.175), "to the left", 1.0)]
)
def test_balance_by_the_side_it_would_tip_over(place, where, ratio):
    found = checks(pressure_centre=[(20, place)])
    assert found["centre of pressure, 5 ms"].ratio == pytest.approx(ratio)
    assert found["centre of pressure, 5 ms"].where == where
    assert found["centre of pressure, 20 ms"].ratio == pytest.approx(ratio / 4)


# -- In the simulation -------------------------------------------------------------------------------


@pytest.fixture
def house():
    env = caregiver_mj.load("supervise", "paper", epsilon=0.5, random=0)
    env.reset()
    physics = env.physics
    physics.set_robot(np.array([*physics.base_position()[:2], 0.6]))
    physics.forward()
    return physics, Dynamics(physics.model.ptr, physics.data.ptr, ROBOT.names)


def settle(physics, base=(0.0, 0.0, 0.0), steps=400):
    physics.set_action(np.array([*base, *physics.arm_position(), 0.036]))
    physics.step(steps)


def test_at_rest_motors_hold_the_weight_and_the_centre_is_that_of_mass(house):
    physics, dynamics = house
    settle(physics)
    found, data = dynamics.measure(), physics.data.ptr
    dofs = [physics.model.ptr.joint(f"robot/{name}").dofadr[0] for name in ROBOT.names.arm]
    assert found["arm_torque"] == pytest.approx(data.qfrc_bias[dofs], abs=0.02)
    assert np.abs(found["arm_torque"]).max() > 10.0
    base = physics.model.ptr.body("robot/base").id
    off = data.subtree_com[base, :2] - data.xpos[base, :2]
    turn = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
    assert found["pressure_centre"] == pytest.approx(turn @ off, abs=1e-4)


def momentum(physics, body):
    """Of all of the robot, and that about its centre of mass, and where that is."""
    model, data = physics.model.ptr, physics.data.ptr
    physics.forward()
    mujoco.mj_subtreeVel(model, data)
    linear = model.body_subtreemass[body] * data.subtree_linvel[body]
    return linear, data.subtree_angmom[body].copy(), data.subtree_com[body].copy()


def test_speeding_up_moves_the_centre_back(house):
    """As the rates of change of momentum and angular momentum say, for an arm that sways on its servos."""
    physics, dynamics = house
    settle(physics)
    body = physics.model.ptr.body("robot/base").id
    linear, angular, (x, y, height) = momentum(physics, body)
    place = physics.base_position()[:2]
    physics.set_action(np.array([0.08 * np.cos(0.6), 0.08 * np.sin(0.6), 0.0, *physics.arm_position(), 0.036]))
    physics.step(1)
    measured = dynamics.measure()["pressure_centre"]
    after, after_angular, _ = momentum(physics, body)
    fx, fy, _ = (after - linear) / PHYSICS
    tx, ty, _ = (after_angular - angular) / PHYSICS
    weight = physics.model.ptr.body_subtreemass[body] * 9.81
    centre = np.array([x - (ty + height * fx) / weight, y + (tx - height * fy) / weight]) - place
    turn = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
    assert measured == pytest.approx(turn @ centre, abs=3e-3)
    assert measured[0] < -0.05


# -- Near the child ----------------------------------------------------------------------------------


def test_separation_speed_and_contact_of_the_part_that_moves():
    # Part 0 rests at 0.1 m; part 1 moves at 0.3 m, and towards the child at 0.6 m.
    moves = {"speed": {(3, 1): 0.2, (9, 1): 0.2}, "approach": {(9, 1): 0.2}}
    contact = np.full(STEPS * 4, -np.inf)
    contact[10:13] = -0.2, 0.04, 0.07
    result = near_child(still(**near(distance={(3, 0): 0.1, (3, 1): 0.3, (9, 1): 0.6}, **moves), contact_speed=contact))
    assert (result.separation, result.approach_separation, result.contact_speed) == (0.3, 0.6, 0.07)
    assert (result.fast_seconds, near_child(still()).separation) == (0.0, np.inf)


def test_time_that_a_part_is_fast_within_half_a_metre():
    fast = {(i, part): 0.3 for i in range(20, 30) for part in (0, 1)}  # ten steps, both parts at once
    close = {(i, part): 0.4 if i < 26 else 0.6 for i in range(20, 30) for part in (0, 1)}  # six of them close
    assert near_child(still(**near(speed=fast, distance=close))).fast_seconds == pytest.approx(6 * PHYSICS)


# -- Logs of episodes --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def episode():
    """Eighty seconds in which the robot picks and places, beside a child."""
    env = caregiver_mj.load("supervise", "paper", epsilon=0.5, random=1)
    policy = caregiver_mj.CaregiverPolicy(env)
    log = EpisodeLog.record(env, policy, 4000)
    assert policy.interventions_done > 0
    return log


def test_the_robot_was_at_work_and_kept_every_limit(episode):
    worked = ratios(episode)
    assert max(worked.values()) <= 1.0
    assert worked["arm velocity, commanded"] > 0.5
    assert worked["base speed, measured"] > 0.8
    assert worked["finger speed, commanded"] > 0.5


def test_every_physics_step_is_logged(episode):
    assert len(episode.commands) == 4000
    for name in {field.name for field in dataclasses.fields(EpisodeLog) if field.type == "np.ndarray"} - {"commands"}:
        assert len(getattr(episode, name)) == 16000


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
    # The recorder is gone: nothing is added any more.
    env.step(action)
    assert len(recorder.log().commands) == 5


# -- The command ------------------------------------------------------------------------------------


def test_an_audit_is_printed(capsys):
    assert main(["audit", "--seconds", "3", "--jobs", "1"]) in (0, 1)
    out = capsys.readouterr().out
    assert "Limits in 3 s: commanded" in out
    assert "arm acceleration, 20 ms" in out
    assert "arm jerk, commanded" in out
    assert "paper 0" in out


def test_of_several_episodes_the_worst_is_told():
    gentle = Audit(10.0, [Check("speed", "m/s", 1.0, 2.0, 3.0)], [], NearChild(0.2, np.inf, 1.5, 0.0), 0.5)
    harsh = Audit(20.0, [Check("speed", "m/s", 3.0, 2.0, 4.0)], [], NearChild(0.4, 0.1, 0.5, 0.02), 0.25)
    both = Audit.worst_of([gentle, harsh])
    assert both == Audit(30.0, harsh.commanded, [], NearChild(0.2, 0.1, 2.0, 0.02), 0.75)
