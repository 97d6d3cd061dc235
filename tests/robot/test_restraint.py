"""What a base beside a child is told instead of what it would be."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from views import ROBOT, TIMESTEP, child, view

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import separation
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.feedback import FollowedVelocity
from caregiver_mj.robot.separation import restrain

TOUCHING = 0.27 + 0.12  # metres between the middles of base and child
#: The origin is the middle of the house.
OPEN = FloorPlan.parse("#######\n#S....#\n#.....#\n#.....#\n#....B#\n#######", "open")
CLEARANCE = Clearance(OPEN, ROBOT)
TOUCHED = view(child(TOUCHING, 0.0))


def left(seen, velocity, before=(0.0, 0.0)):
    return restrain(seen, ROBOT, CLEARANCE, TIMESTEP, False, velocity, before)[0]


def test_nothing_is_left_that_leads_towards_a_child_that_touches_and_little_along_it():
    assert (left(TOUCHED, (0.03, 0.0)), left(TOUCHED, (0.03, -0.2))) == ((0.0, 0.0), (0.0, -0.025))
    assert left(TOUCHED, (-0.3, 0.1)) == pytest.approx((-0.3, 0.025 - 0.08 * 0.3))  # it may leave
    for gap, towards in ((0.02, 0.0), (0.049, 0.0), (0.051, 0.03)):
        assert left(view(child(TOUCHING + gap, 0.0)), (0.03, 0.0)) == (towards, 0.0)
    between = view(child(TOUCHING, 0.0), child(-TOUCHING, 0.0))
    assert left(between, (0.03, 0.01)) == (0.0, 0.01)


def test_it_brakes_from_what_it_was_commanded_before():
    # By 3.386 m/s^2, 0.8 of its limit; as hard as it can before it is touched, for what is told keeps limits.
    slowed = 0.02 * 3.3856  # in a control timestep
    assert left(TOUCHED, (0.1, 0.25), before=(0.1, 0.25)) == pytest.approx((0.1 - slowed, 0.25 - slowed))
    near, aside = view(child(TOUCHING + 0.05, 0.0)), view(child(TOUCHING + 0.12, 0.0))
    assert left(near, (-0.1, 0.4), before=(-0.1, 0.4)) == pytest.approx((-0.1, 0.02 - 0.08 * 0.1))
    assert left(aside, (-0.1, 0.4), before=(-0.1, 0.4)) == (-0.1, 0.4)


def moving_at(velocity):
    followed = FollowedVelocity(ROBOT.limits.as_commanded, TIMESTEP)
    for _ in range(60):
        followed.follow(velocity)
    assert followed.commanded == velocity
    assert followed.acceleration == (0.0, 0.0)
    return followed


SPEED = st.floats(-0.4, 0.4)


@settings(max_examples=80, deadline=None)
@given(st.floats(-0.4, 0.0), SPEED, st.lists(st.tuples(SPEED, SPEED), min_size=4, max_size=4))
def test_what_is_told_does_not_overshoot_beside_a_child(leaves, across, wanted):
    """What it may not lead beyond it comes to gently: it cannot cease to brake, or to speed up, from one moment on."""
    near, followed = view(child(TOUCHING + 0.03, 0.0)), moving_at((leaves, across))
    slow = False
    for i in range(60):
        less = left(near, wanted[i // 15], before=followed.commanded)
        vx, vy = followed.follow(less, goes_on=less == wanted[i // 15])
        assert vx < 0.01
        assert abs(vy) < 0.035 or not slow
        slow = slow or abs(vy) < 0.02


def test_a_base_that_is_touched_does_not_take_its_time():
    for gap, at_once in ((0.0, True), (0.001, True), (0.003, False), (0.2, False)):
        seen = view(child(TOUCHING + gap, 0.0))
        assert restrain(seen, ROBOT, CLEARANCE, TIMESTEP, False, (0.0, 0.0), (0.0, 0.0))[1] == at_once


def test_straight_away_from_a_child_the_base_goes_no_faster_than_there_is_room():
    x, y = OPEN.position((1, 5)).tolist()  # beside the wall in the east, whose face is 0.625 m from the cell's middle
    for aside, least, most in ((-0.5, 0.6, 0.6), (0.2, 0.3, 0.4), (0.37, 0.0, 0.01)):
        base = (x + aside, y, 0.0)
        away, across = left(view(child(base[0] - TOUCHING, y), base=base), (0.6, -0.4))
        assert -0.03 <= across <= 0.0
        assert least - 1e-9 <= away <= most + 1e-9


def towards(told, who):
    dx, dy = who.position
    return (told[0] * dx + told[1] * dy) / math.hypot(dx, dy)


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.0, 0.04), st.floats(-math.pi, math.pi)), min_size=2, max_size=3),
    st.floats(-math.pi, math.pi),
)
def test_nothing_leads_towards_any_of_several_children(places, heading):
    """What one of them leaves of a velocity may lead towards the one that was asked before."""
    family = [child((TOUCHING + gap) * math.cos(angle), (TOUCHING + gap) * math.sin(angle)) for gap, angle in places]
    told = (0.0, 0.0)
    for _ in range(3):
        told = left(view(*family), (0.5 * math.cos(heading), 0.5 * math.sin(heading)), before=told)
    assert max(towards(told, who) for who in family) < 0.01


SQUARE = find_embodiment("mobile_ur5e")
STRIKE_SPEED = 0.05  # m/s


@settings(max_examples=80, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.floats(0.0, 0.6), st.floats(-0.03, 0.03))
@example(math.pi / 4, -3 * math.pi / 4, 0.6, 0.03)  # off a corner
def test_a_base_with_corners_never_slides_fast_along_a_child_that_touches_it(angle, heading, speed, moves):
    """Not even if the child has moved on a little along it: round a corner its surface then leads elsewhere."""
    x, y = math.cos(angle), math.sin(angle)
    far, near = 0.5, 0.3
    for _ in range(50):  # where the base is touched in this direction, by bisection
        middle = (far + near) / 2
        apart = separation.gap_to((0, 0, 0), SQUARE, child(middle * x, middle * y)) > 0
        far, near = (middle, near) if apart else (far, middle)
    told = (0.0, 0.0)
    for _ in range(100):
        wanted = (speed * math.cos(heading), speed * math.sin(heading))
        told = restrain(view(child(far * x, far * y)), SQUARE, CLEARANCE, TIMESTEP, False, wanted, told)[0]
    way_x, way_y = separation.outwards(SQUARE, 0.0, (far * x, far * y))
    length = math.hypot(way_x, way_y)
    after = far * x - moves * way_y / length, far * y + moves * way_x / length
    out = np.array(separation.outwards(SQUARE, 0.0, after))
    along = np.array([-out[1], out[0]]) / np.linalg.norm(out)
    assert abs(told @ along) < STRIKE_SPEED


@pytest.mark.parametrize("robot", [ROBOT, SQUARE])
@pytest.mark.parametrize("wanted", [(0.0, 0.0), (0.5, 0.0), (-0.3, 0.2)])
def test_a_child_seen_at_the_very_middle_of_the_base_stops_nothing_else(robot, wanted):
    seen = view(child(0.0, 0.0))  # where none can be, as of an observation that is wrong
    told, is_touched = restrain(seen, robot, CLEARANCE, TIMESTEP, False, wanted, (0.0, 0.0))
    assert is_touched
    assert math.hypot(*told) <= math.hypot(*wanted) + 0.05
    assert 0.0 <= separation.allowed_rate(seen, robot, (0.3, 0.0)) <= 1.0
    assert separation.must_stop(seen, robot, (0.3, 0.0), (0.0, 0.0)) in (True, False)
    assert separation.allowed_turning(seen, robot, (0.3, 0.0), (0.5, 0.0)) >= 0.0
