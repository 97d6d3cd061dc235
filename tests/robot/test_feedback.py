"""Commands keep within acceleration and jerk and reach the wanted velocity; a pushed arm yields."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from views import ROBOT, at_rest

from caregiver_mj.robot.feedback import FollowedVelocity, GivingWay
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.motion import RobotMotion

LIMITS = Limits(1.4, 2.0, 30.0)
STEP = 0.02  # seconds: at most 0.04 m/s, and 0.6 m/s^2 more or less than before


def moving_at(velocity):
    follower = FollowedVelocity(LIMITS, STEP)
    while follower.follow(velocity) != velocity or follower.acceleration != (0.0, 0.0):
        pass
    return follower


vectors = st.one_of(
    st.tuples(st.floats(-0.95, 0.95), st.floats(-0.95, 0.95)),
    st.floats(-math.pi, math.pi).map(lambda way: (1.4 * math.cos(way), 1.4 * math.sin(way))),
)


def test_what_is_within_the_bounds_is_told_as_it_is():
    follower = FollowedVelocity(LIMITS, STEP)
    for i in range(1, 100):
        wanted = (0.6 - 0.6 * math.cos(0.03 * i), 0.4 - 0.4 * math.cos(0.02 * i))
        assert follower.follow(wanted) == wanted


def test_a_jump_is_caught_up_with_and_not_overshot():
    follower = FollowedVelocity(LIMITS, STEP)
    told = [follower.follow((0.5, 0.0)) for _ in range(40)]
    assert told[0] == pytest.approx((0.6 * STEP, 0.0))
    assert told[1] == pytest.approx((1.8 * STEP, 0.0))
    speeds = [x for x, _ in told]
    assert speeds == sorted(speeds)
    assert told[-1] == (0.5, 0.0)
    assert speeds.index(0.5) <= 25  # 0.5 m/s at 2 m/s^2, and what the jerk takes at both ends


@pytest.mark.parametrize("begins", [0.0, 0.005, 0.01, 0.015])
def test_a_stop_with_the_lag_fed_forward_is_not_overshot(begins):
    """Its slope changes faster than the jerk allows; catching up with that must not lead beyond rest, and back."""
    braking, jerk, lag, follower = 1.8, 27.0, 0.01, moving_at((1.0, 0.0))
    builds_up = braking / jerk
    rests = 1.0 / braking + builds_up  # seconds

    def wanted(time):
        left = rests - time
        if left < builds_up:
            return jerk * max(0.0, left) * (left / 2 - lag)
        if time < builds_up:
            return 1.0 - jerk * time * (time / 2 + lag)
        return braking * (left - builds_up / 2 - lag)

    told = [follower.follow((wanted(begins + STEP * i), 0.0))[0] for i in range(50)]
    assert min(told) > -0.01
    assert told[-1] == pytest.approx(0.0, abs=1e-3)


def test_where_it_must_be_at_once_it_is():
    follower = moving_at((0.5, 0.3))
    assert (follower.follow((0.2, 0.0), at_once=True), follower.acceleration) == ((0.2, 0.0), (0.0, 0.0))


def test_faster_it_becomes_within_the_bounds_even_where_something_is_taken_away_at_once():
    follower = moving_at((-0.2, 0.1))
    changes = [follower.acceleration]
    for i in range(20):
        speed, before = math.hypot(*follower.commanded), follower.commanded
        told = follower.follow((-0.3 - 0.03 * i, 0.0), at_once=i < 10)
        assert told[1] == 0.0
        assert math.hypot(*told) <= speed + 0.04 + 1e-9
        changes.append(((told[0] - before[0]) / STEP, 0.0))
    assert all(math.dist(*pair) <= 0.6 + 1e-9 for pair in itertools.pairwise(changes[2:]))
    assert -0.9 < told[0] < -0.7


@settings(max_examples=50, deadline=None)
@given(wishes=st.lists(st.tuples(vectors, st.integers(1, 30)), min_size=1, max_size=5))
def test_it_keeps_its_bounds_whatever_is_wanted_and_gets_there(wishes):
    follower = FollowedVelocity(LIMITS, STEP)
    accelerations = [(0.0, 0.0)]
    for wanted, times in wishes:
        for _ in range(times):
            follower.follow(wanted)
            accelerations.append(follower.acceleration)
            assert math.hypot(*follower.commanded) <= 1.4 + 1e-9
    for _ in range(200):
        follower.follow(wanted)
    assert follower.commanded == wanted
    assert all(math.hypot(*acceleration) <= 2.0 + 1e-9 for acceleration in accelerations)
    assert all(math.dist(*pair) <= 0.6 + 1e-9 for pair in itertools.pairwise(accelerations))


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
    assert robot.giving_way.is_off


def test_an_arm_that_creeps_goes_on_from_where_it_is_pushed_to(robot):
    """A stiff arm would spring back as soon as the child steps off."""
    robot.giving_way.yields = True

    def creep(arm):
        robot.reach(0.0, creeps=True)
        told = robot.action(HERE, arm)[ARM]
        robot.now += 0.02
        return told

    arm = robot.reach_path.joints(robot.reached)
    for _ in range(25):  # nobody touches it: it follows its reference
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
    assert not robot.giving_way.is_off


def test_an_arm_that_moves_goes_on():
    """Its lag behind its reference is no push."""
    way = GivingWay(2)
    way.yields = True
    way.follow(np.array([0.3, 0.0]), np.zeros(2), rested=-0.2, seconds=0.02)
    assert not way.offset.any()
