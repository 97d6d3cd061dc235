"""Audits of logs made by hand, whose ratios are known, of a robot in the simulation, and of episodes."""

import dataclasses

import mujoco
import numpy as np
import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.robot.embodiments import find_embodiment
from studies.audit import Dynamics, EpisodeLog, Recorder, check_limits, check_motion, near_child

ROBOT = find_embodiment()
CONTROL, PHYSICS = 0.02, 0.005  # seconds
STEPS = 100
TUCKED = [0.0, -0.66, 0.0, -2.25, 0.0, 2.55, 0.785]


def still(**changes):
    """The log of a robot that does not move, a metre and more from the child."""
    m = STEPS * 4
    sizes = {"base_velocity": 3, "arm_velocity": 7, "arm_torque": 7, "finger_velocity": 2, "pressure_centre": 2}
    fields = {name: np.zeros((m, size)) for name, size in sizes.items()} | near()
    fields |= {"commands": np.tile(np.linspace(-1.0, 1.0, 12), (STEPS, 1)), "arm_position": np.tile(TUCKED, (m, 1))}
    fields |= {"pads": np.zeros(m, int), "shut": np.zeros((m, 1), bool), "friction": np.zeros(m)}
    return EpisodeLog(CONTROL, PHYSICS, **fields | {"contact_speed": np.full(m, -np.inf)} | changes)


def commands(column, values):
    changed = still().commands
    changed[:, column] += values
    return changed


def near(m=STEPS * 4, **cells):
    """Arrays (m, 2) of a robot that rests and is far away, but for given {(step, part): value}."""
    arrays = {"distance": np.full((m, 2), np.inf), "speed": np.zeros((m, 2)), "approach": np.zeros((m, 2))}
    for name, changes in cells.items():
        for place, value in changes.items():
            arrays[name][place] = value
    return arrays


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


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
def test_a_rigid_robot_needs_the_friction_and_stance_worked_out_by_hand(name):
    """Pushed as a whole at 3 m/s^2 it needs 3 / 9.81, and presses on the floor behind its centre of mass."""
    robot = find_embodiment(name)
    env = load("supervise", "paper", 0.5, random=0, task_kwargs={"embodiment": robot}, visuals=False)
    env.reset()
    model, data = env.physics.model.ptr, env.physics.data.ptr
    dynamics = Dynamics(model, data, robot.names)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    data.qacc[:], data.qfrc_constraint[:] = 0.0, 0.0
    data.qacc[model.joint("robot/base_x").dofadr[0]] = 3.0
    found = dynamics.measure()
    base, yaw = data.xpos[dynamics._body], float(data.qpos[model.joint("robot/base_yaw").qposadr[0]])
    x, y, height = data.subtree_com[dynamics._body] - base
    back = np.array([x - 3.0 / 9.81 * height, y])
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    np.testing.assert_allclose(found["pressure_centre"], turn @ back, atol=1e-6)
    assert found["friction"] == pytest.approx(3.0 / 9.81, abs=1e-6)


def test_a_joint_must_be_slower_near_the_end_of_its_range():
    # 0.1 rad before the end of joint 2's range there are sqrt(5.17 * 0.1) - 0.2 = 0.519 rad/s left towards it.
    near = {"arm_position": [((50, 1), 1.6918)]}
    there = checks(**near, arm_velocity=[((50, 1), 0.5)])["arm velocity"]
    assert (there.limit, there.ratio) == (pytest.approx(0.519, abs=1e-3), pytest.approx(0.963, abs=1e-3))
    assert checks(**near, arm_velocity=[((50, 1), -0.5)])["arm velocity"].limit == 2.62


def test_separation_speed_and_contact_of_the_part_that_moves():
    # Part 0 rests at 0.1 m; part 1 moves at 0.3 m, and towards the child at 0.6 m.
    moves = {"speed": {(3, 1): 0.2, (9, 1): 0.2}, "approach": {(9, 1): 0.2}}
    contact = np.full(STEPS * 4, -np.inf)
    contact[10:13] = -0.2, 0.04, 0.07
    result = near_child(still(**near(distance={(3, 0): 0.1, (3, 1): 0.3, (9, 1): 0.6}, **moves), contact_speed=contact))
    assert (result.separation, result.approach_separation, result.contact_speed) == (0.3, 0.6, 0.07)
    assert (result.fast_seconds, near_child(still()).separation) == (0.0, np.inf)


def test_the_robot_keeps_every_limit_in_eighty_seconds_of_picking_and_placing_beside_a_child():
    env = load("supervise", "paper", epsilon=0.5, random=1)
    policy = CaregiverPolicy(env)
    worked = {check.name: check.ratio for check in check_limits(EpisodeLog.record(env, policy, 4000), ROBOT)}
    assert policy.executive.done > 0
    assert max(worked.values()) <= 1.0
    assert worked["arm velocity, commanded"] > 0.5
    assert worked["base speed, measured"] > 0.8
    assert worked["finger speed, commanded"] > 0.5


def test_recorder_measures_distance_and_approach():
    hall = FloorPlan.parse("############\n#B.........#\n############", "hall")
    env = load("supervise", hall, epsilon=0.5, random=0)
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
