"""What a base is told keeps the bounds of its acceleration and jerk, and gets to what is wanted."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj.robot.feedback import FollowedVelocity
from caregiver_mj.robot.limits import Limits

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
