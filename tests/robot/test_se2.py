"""Poses on the floor: cases worked by hand, and what turning there and back must leave as it was."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj.robot import geometry

lengths, angles = st.floats(-10.0, 10.0), st.floats(-7.0, 7.0)
points, poses = st.tuples(lengths, lengths), st.tuples(lengths, lengths, angles)
SOUTH_EAST_LOOKING_NORTH = (3.0, -1.0, math.pi / 2)


def test_a_point_ahead_and_to_the_left_of_one_who_looks_north():
    # 2 m ahead is 2 m further north, 0.5 m to the left is 0.5 m further west.
    assert geometry.to_world(SOUTH_EAST_LOOKING_NORTH, (2.0, 0.5)) == pytest.approx((2.5, 1.0))
    assert geometry.to_local(SOUTH_EAST_LOOKING_NORTH, (2.5, 1.0)) == pytest.approx((2.0, 0.5))


@settings(deadline=None)
@given(pose=poses, point=points)
def test_there_and_back_leads_to_the_same_point(pose, point):
    assert geometry.to_local(pose, geometry.to_world(pose, point)) == pytest.approx(point, abs=1e-9)


@settings(deadline=None)
@given(yaw=angles, vector=points)
def test_a_turn_changes_the_direction_only(yaw, vector):
    turned = geometry.rotate(yaw, vector)
    assert math.hypot(*turned) == pytest.approx(math.hypot(*vector), abs=1e-9)
    if math.hypot(*vector) > 1e-3:
        change = math.atan2(turned[1], turned[0]) - math.atan2(vector[1], vector[0])
        assert math.remainder(change - yaw, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_distance_to_a_line_is_that_to_its_nearest_point_or_end():
    line = (1.0, 1.0), (3.0, 1.0)
    assert geometry.distance_to_line((2.5, -1.0), *line) == pytest.approx(2.0)
    assert geometry.distance_to_line((6.0, 5.0), *line) == pytest.approx(5.0)
    assert geometry.distance_to_line((0.0, 1.0), *line) == pytest.approx(1.0)
    assert geometry.distance_to_line((4.0, 5.0), (1.0, 1.0), (1.0, 1.0)) == pytest.approx(5.0)
