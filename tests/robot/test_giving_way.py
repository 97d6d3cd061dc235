"""An arm that is pushed: it stays where it is pushed to, and comes back slowly when nobody is at it any more."""

import numpy as np
import pytest
from views import ROBOT, at_rest

from caregiver_mj.robot.feedback import GivingWay
from caregiver_mj.robot.motion import RobotMotion

ARM = ROBOT.layout.arm
HERE = (0.0, 0.0, 0.0)
SETTLED = 0.12  # seconds after which it has come to rest


@pytest.fixture
def robot() -> RobotMotion:
    """One whose hand is out, and at rest."""
    motion = at_rest(HERE)
    motion.reach(0.5)
    while motion.reached < 0.5:
        motion.action(HERE)
        motion.now += 0.02
    return motion


def test_a_pushed_arm_is_told_to_stay_where_it_is(robot):
    wanted = robot.action(HERE)[ARM]
    pushed = wanted + np.array([0.05, 0.0, 0.0, -0.03, 0.0, 0.001, 0.0])
    np.testing.assert_array_equal(robot.action(HERE, pushed)[ARM], wanted)  # nobody is near: it is stiff
    robot.giving_way.yields = True
    robot.now = robot.reach_arrival + 0.1  # what it is off its reference until then is its lag
    np.testing.assert_array_equal(robot.action(HERE, pushed)[ARM], wanted)
    robot.now = robot.reach_arrival + SETTLED
    told = robot.action(HERE, pushed)[ARM]
    np.testing.assert_allclose(told[:4], pushed[:4])
    assert told[5] == wanted[5]  # so little is how its servos sag
    assert robot.has_given_way


def test_an_arm_that_creeps_goes_on_from_where_it_is_pushed_to(robot):
    """One that stayed stiff would spring back as soon as whoever pushes it steps off."""
    robot.giving_way.yields = True

    def creep(arm):
        robot.reach(0.0, creeps=True)
        told = robot.action(HERE, arm)[ARM]
        robot.now += 0.02
        return told

    arm = robot.reach_path.joints(robot.reached)
    for _ in range(25):  # nobody touches it: it follows what it is told
        arm = creep(arm)
    pushed = robot.reach_path.joints(robot.reached) + np.array([0.05, 0.0, 0.0, -0.03, 0.0, 0.0, 0.0])
    told = creep(pushed)
    np.testing.assert_allclose(told, pushed, atol=0.005)
    assert np.abs(told - robot.reach_path.joints(robot.reached)).max() > 0.04
    before = robot.reached
    for _ in range(25):  # let go of, it creeps on from there
        told = creep(told)
    assert robot.reached < before
    assert np.abs(told - robot.reach_path.joints(robot.reached)).max() > 0.04


def test_an_arm_at_rest_gives_way_and_has_arrived_though_a_child_comes_and_goes(robot):
    """A skill that stops it each time would else wait for it, from its arrival on, without end."""
    robot.giving_way.yields = True
    arrived, pushed = robot.reach_arrival, robot.action(HERE)[ARM] + 0.05
    for _ in range(20):
        robot.stop_reaching()
        robot.action(HERE, pushed)
        robot.now += 0.02
        robot.reach(0.5)
        told = robot.action(HERE, pushed)[ARM]
        robot.now += 0.02
    assert robot.reach_arrival == arrived
    np.testing.assert_allclose(told, pushed)


def test_it_comes_back_slowly_and_without_a_jolt(robot):
    wanted = robot.action(HERE)[ARM]
    robot.giving_way.yields = True
    robot.now = robot.reach_arrival + SETTLED
    pushed = wanted + 0.1
    told = [robot.action(HERE, pushed)[ARM] for _ in range(2)]
    np.testing.assert_allclose(told, [pushed, pushed])
    robot.giving_way.yields = False
    for _ in range(100):
        told.append(robot.action(HERE, told[-1])[ARM])
    rates = np.diff(told, axis=0) / 0.02
    assert np.abs(rates).max() == pytest.approx(0.15)
    assert np.abs(np.diff(rates, axis=0)).max() / 0.02 < 2.0  # rad/s^2, beside the 7 that its paths take of 10
    np.testing.assert_allclose(told[-1], wanted)
    assert not robot.has_given_way


def test_an_arm_that_moves_goes_on():
    """Its lag behind its reference is no push."""
    way = GivingWay(2)
    way.yields = True
    way.follow(np.array([0.3, 0.0]), np.zeros(2), rested=-0.2, seconds=0.02)
    assert not way.offset.any()
