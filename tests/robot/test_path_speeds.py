"""How fast the base may be: by hand, and as fast as can be but no faster."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj.robot.base_path import PathSpeeds
from caregiver_mj.robot.limits import Limits

LIMITS = Limits(velocity=1.5, acceleration=3.0, jerk=30.0)
A_LITTLE = 1e-8  # m/s
speeds, lengths, turns = st.floats(0.0, 1.5), st.floats(1e-4, 4.0), st.floats(1e-3, math.pi)


def test_the_speed_that_is_reached_by_hand():
    # Acceleration builds up in 3 / 30 = 0.1 s: from rest 1.5 m/s take 1.5 / 3 + 0.1 = 0.6 s, and 0.45 m.
    path = PathSpeeds(LIMITS, deviation=0.1)
    assert (path.distance_to_change(0.0, 1.5), path.reachable(0.0, 0.5)) == (pytest.approx(0.45), 1.5)
    assert path.reachable(0.0, 0.45 - 1e-6) == pytest.approx(1.5, abs=1e-5)
    # With 0.3 m/s the deceleration is never all there: 2 * sqrt(0.3 / 30) = 0.2 s, and 0.03 m.
    assert (path.reachable(0.0, 0.03), path.reachable(0.4, 0.0)) == (pytest.approx(0.3), 0.4)
    assert path.reachable(2.0, 1.0) == 1.5


def test_the_speed_in_a_corner_by_hand():
    # At 0.5 m/s a right angle changes the velocity by 0.71 m/s in 0.71 / 3 + 0.1 s, half of which is before the corner.
    path = PathSpeeds(LIMITS, deviation=1.0)
    size = 0.5 * (math.sqrt(0.5) / 3.0 + 0.1) / 2
    assert path.corner_size(0.5, math.pi / 2) == pytest.approx(size)
    assert path.corner_speed(math.pi / 2, size / 0.95) == pytest.approx(0.5)
    assert (path.corner_speed(math.pi, 10.0), path.corner_speed(1e-3, 10.0)) == (0.0, 1.5)


@settings(deadline=None)
@given(speed=speeds, distance=lengths)
def test_what_can_be_reached_is_as_fast_as_can_be_and_no_faster(speed, distance):
    path = PathSpeeds(LIMITS, deviation=0.1)
    found = path.reachable(speed, distance)
    assert speed <= found <= LIMITS.velocity
    assert path.distance_to_change(speed, found) <= distance
    assert found == LIMITS.velocity or path.distance_to_change(speed, found + A_LITTLE) > distance


@settings(deadline=None)
@given(turn=turns, room=lengths, deviation=st.sampled_from([0.02, 0.06, 0.2]))
def test_a_corner_is_as_fast_as_can_be_and_no_faster(turn, room, deviation):
    path = PathSpeeds(LIMITS, deviation)
    found = path.corner_speed(turn, room)
    assert 0.0 <= found <= LIMITS.velocity
    size = path.corner_size(found, turn)
    assert size <= 0.95 * room
    assert size * math.sin(turn / 2) / 2 <= deviation + 1e-12
    if 0.0 < found < LIMITS.velocity:
        bigger = path.corner_size(found + A_LITTLE, turn)
        assert bigger > 0.95 * room or bigger * math.sin(turn / 2) / 2 > deviation
