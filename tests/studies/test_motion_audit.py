"""Audits of what was measured: of logs made by hand, whose ratios are known, and of a robot in the simulation."""

import dataclasses

import mujoco
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.robot.embodiments import find_embodiment
from studies.audit import Dynamics, EpisodeLog, check_motion

ROBOT = find_embodiment()
STEPS, PHYSICS = 400, 0.005
TUCKED = [0.0, -0.66, 0.0, -2.25, 0.0, 2.55, 0.785]


def checks(**columns):
    """By name, of a robot that stands still but for given ((step, column), value) of an array."""
    arrays = {
        "base_velocity": np.zeros((STEPS, 3)),
        "arm_position": np.tile(TUCKED, (STEPS, 1)),
        "arm_velocity": np.zeros((STEPS, 7)),
        "arm_torque": np.zeros((STEPS, 7)),
        "finger_velocity": np.zeros((STEPS, 2)),
        "pads": np.zeros(STEPS, int),
        "pressure_centre": np.zeros((STEPS, 2)),
    }
    for name, changes in columns.items():
        for place, value in changes:
            arrays[name][place] = value
    none = np.zeros((STEPS, 0))
    log = EpisodeLog(0.02, PHYSICS, none, distance=none, speed=none, approach=none, contact_speed=none, **arrays)
    return {check.name: check for check in check_motion(log, ROBOT)}


def test_nothing_moves():
    assert {check.ratio for check in checks().values()} == {0.0}


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


def test_the_first_step_counts_from_rest():
    assert checks(arm_velocity=[((slice(None), 0), 0.05)])["arm acceleration, 5 ms"].worst == pytest.approx(10.0)


def test_a_joint_must_be_slower_near_the_end_of_its_range():
    # 0.1 rad before the end of joint 2's range there are sqrt(5.17 * 0.1) - 0.2 = 0.519 rad/s left towards it.
    near = {"arm_position": [((50, 1), 1.6918)]}
    there = checks(**near, arm_velocity=[((50, 1), 0.5)])["arm velocity"]
    assert there.limit == pytest.approx(0.519, abs=1e-3)
    assert there.ratio == pytest.approx(0.963, abs=1e-3)
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
    ("place", "where", "ratio"),
    [
        ((0.31, 0.0), "ahead", 2.0),
        ((-0.0775, 0.0), "backwards", 0.5),
        ((0.0, 0.175), "to the left", 1.0),
        ((0.0, -0.0875), "to the right", 0.5),
    ],
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


def test_columns_are_those_of_a_log(house):
    names = {field.name for field in dataclasses.fields(EpisodeLog)}
    assert set(house[1].measure()) <= names
