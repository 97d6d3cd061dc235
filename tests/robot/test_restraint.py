"""What a base beside a child is told instead of what it would be."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from views import child, view

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import geometry, separation
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.feedback import FollowedVelocity
from caregiver_mj.robot.separation import restrain
from caregiver_mj.robot.view import CHILD_RADIUS

ROBOT = find_embodiment()
TOUCHING = 0.27 + 0.12  # metres between the middles of base and child
TIMESTEP = 0.02  # seconds
#: The origin is the middle of the house.
OPEN = FloorPlan.parse("#######\n#S....#\n#.....#\n#.....#\n#....B#\n#######", "open")
CLEARANCE = Clearance(OPEN, ROBOT)
TOUCHED = view(child(TOUCHING, 0.0))


def left(seen, velocity, before=(0.0, 0.0), is_loaded=False):
    return restrain(seen, ROBOT, CLEARANCE, TIMESTEP, is_loaded, velocity, before)[0]


def test_nothing_is_left_that_leads_towards_a_child_that_touches_and_little_along_it():
    assert (left(TOUCHED, (0.03, 0.0)), left(TOUCHED, (0.03, -0.2))) == ((0.0, 0.0), (0.0, -0.025))
    assert left(TOUCHED, (-0.3, 0.1)) == pytest.approx((-0.3, 0.025 - 0.08 * 0.3))  # it may leave
    for gap, towards in ((0.02, 0.0), (0.049, 0.0), (0.051, 0.03)):
        assert left(view(child(TOUCHING + gap, 0.0)), (0.03, 0.0)) == (towards, 0.0)
    between = view(child(TOUCHING, 0.0), child(-TOUCHING, 0.0))
    assert left(between, (0.03, 0.01)) == (0.0, 0.01)


def test_it_brakes_from_what_it_was_told_before():
    # By 0.03 m/s a control timestep, 1.5 m/s^2; as hard as it can before it is touched, for what is told keeps limits.
    assert left(TOUCHED, (0.1, 0.25), before=(0.1, 0.25)) == pytest.approx((0.07, 0.22))
    near, aside = view(child(TOUCHING + 0.05, 0.0)), view(child(TOUCHING + 0.12, 0.0))
    assert left(near, (-0.1, 0.4), before=(-0.1, 0.4)) == pytest.approx((-0.1, 0.02 - 0.08 * 0.1))
    assert left(aside, (-0.1, 0.4), before=(-0.1, 0.4)) == (-0.1, 0.4)


def moving_at(velocity):
    followed = FollowedVelocity(ROBOT.limits.as_told, TIMESTEP)
    for _ in range(60):
        followed.follow(velocity)
    assert followed.told == velocity
    assert followed.acceleration == (0.0, 0.0)
    return followed


SPEED = st.floats(-0.4, 0.4)


@settings(max_examples=200, deadline=None)
@given(st.floats(-0.4, 0.0), SPEED, st.lists(st.tuples(SPEED, SPEED), min_size=4, max_size=4))
def test_what_is_told_does_not_overshoot_beside_a_child(leaves, across, wanted):
    """What it may not lead beyond it comes to gently: it cannot cease to brake, or to speed up, from one moment on."""
    near, followed = view(child(TOUCHING + 0.03, 0.0)), moving_at((leaves, across))
    slow = False
    for i in range(60):
        less = left(near, wanted[i // 15], before=followed.told)
        vx, vy = followed.follow(less, goes_on=less == wanted[i // 15])
        assert vx < 0.01
        assert abs(vy) < 0.035 or not slow
        slow = slow or abs(vy) < 0.02


@pytest.mark.parametrize("axis", [0, 1])
def test_before_it_is_touched_it_brakes_as_hard_as_it_may(axis):
    """Towards a child and along it, whether or not its way brakes by itself, and more gently."""
    near = view(child(TOUCHING + 0.03, 0.0))
    for slower in (0.0, 0.02, 0.034):
        wanted = 0.3
        followed = moving_at((wanted, 0.0) if axis == 0 else (0.0, wanted))
        for _ in range(10):  # 0.15 s at 2 m/s^2, and what its jerk takes
            wanted = max(0.0, wanted - slower)
            asked = (wanted, 0.0) if axis == 0 else (0.0, wanted)
            less = left(near, asked, before=followed.told)
            followed.follow(less, goes_on=less == asked)
        assert abs(followed.told[axis]) < 0.03


def test_a_base_at_whose_heels_a_child_walks_leaves_straight_as_it_will_be_when_it_does_what_it_is_told():
    beside = view(child(TOUCHING, 0.0, 0.6, 1.0))
    assert left(beside, (-0.6, 0.0), before=(-0.6, 0.0))[1] < 0.0  # the child will be farther on by then
    x, y = TOUCHING + 0.035 * (0.6 + 0.6), 0.035 * 1.0
    straight = np.array([x, y]) / math.hypot(x, y)
    told = np.array(left(beside, tuple(-0.6 * straight), before=(-0.6, 0.0)))
    assert told == pytest.approx(-0.6 * straight)
    slow = view(child(TOUCHING, 0.0, 0.2, 1.0))
    assert left(slow, (-0.2, 0.0), before=(-0.2, 0.0)) == (-0.2, 0.0)


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


def test_a_base_that_has_little_room_follows_a_child_that_turns_round_its_heels():
    """Were it asked to brake all at once, it would do nothing else, and then slide along the child."""
    x, y = OPEN.position((1, 5)).tolist()
    base, followed, sideways = (x + 0.3, y, 0.0), moving_at((0.6, 0.0)), []
    for i in range(10):
        turned = 0.012 * i
        behind = child(base[0] - 0.4 * math.cos(turned), y - 0.4 * math.sin(turned), 0.6, 0.25)
        less = left(view(behind, base=base), (0.6, -0.1), before=followed.told)
        told = np.array(followed.follow(less, goes_on=False))
        sideways.append(told @ (-math.sin(turned), math.cos(turned)))
    assert told[0] < 0.45  # it does brake
    assert np.abs(sideways).max() < 0.02


def test_nor_than_there_is_room_for_the_candle_in_its_hand():
    x, y = OPEN.position((1, 5)).tolist()
    base = (x, y, 0.0)  # the hand, ahead of it, is nearer to the wall in the east
    beside = view(child(base[0] - TOUCHING, y), base=base)
    fast, slow = (left(beside, (0.6, -0.4), is_loaded=is_loaded)[0] for is_loaded in (False, True))
    assert fast == pytest.approx(0.6)
    assert 0.2 < slow < 0.5


def towards(told, who):
    dx, dy = who.position
    return (told[0] * dx + told[1] * dy) / math.hypot(dx, dy)


@settings(max_examples=200, deadline=None)
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


def test_between_children_for_whom_no_velocity_does_the_base_brakes_and_does_not_swing_back():
    """One touches it and is left; for the sake of the other one it shall not. No jump, and nothing towards either."""
    wanted = (0.36, -0.08)
    followed = moving_at(wanted)
    aside = child((TOUCHING + 0.027) * math.cos(math.radians(-93)), (TOUCHING + 0.027) * math.sin(math.radians(-93)))
    for step in range(20):
        behind = child(-TOUCHING - (0.001 if step == 0 else 0.004), 0.0, 0.3)
        before = followed.told
        less, at_once = restrain(view(behind, aside), ROBOT, CLEARANCE, TIMESTEP, False, wanted, before)
        followed.follow(less, at_once, goes_on=False)
        assert at_once == (step == 0)
        assert math.dist(followed.told, before) < 0.06  # 3 m/s^2
        assert towards(followed.told, behind) < 0.01
    assert towards(followed.told, aside) < 0.01


SQUARE = find_embodiment("mobile_ur5e")
STRIKE_SPEED = 0.05  # m/s


@settings(max_examples=200, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.floats(0.0, 0.6), st.floats(-0.03, 0.03))
@example(math.pi / 4, -3 * math.pi / 4, 0.6, 0.03)  # off a corner
def test_a_base_with_corners_never_slides_fast_along_a_child_that_touches_it(angle, heading, speed, moves):
    """Not even if the child has moved on a little along it: round a corner its surface then leads elsewhere."""
    x, y = math.cos(angle), math.sin(angle)
    far, near = 0.5, 0.3
    for _ in range(50):  # where the base is touched in this direction, by bisection
        middle = (far + near) / 2
        far, near = (middle, near) if separation.gap_to((0, 0, 0), SQUARE, child(middle * x, middle * y)) > 0 else (
            far, middle
        )  # fmt: skip
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


def place_beside(on):
    """Where a child touches the base with corners that has gone so many metres round it from the middle of a side."""
    side, far = SQUARE.sides[0], SQUARE.rounding + CHILD_RADIUS
    quarters, on = divmod(on + side, 2 * side + far * math.pi / 2)
    turned = max(0.0, on - 2 * side) / far
    x, y = side - min(on, 2 * side), side
    return geometry.rotate(quarters * math.pi / 2, (x - far * math.sin(turned), y + far * math.cos(turned)))


@settings(max_examples=100, deadline=None)
@given(st.floats(0.0, 0.5), st.floats(0.1, 0.6), st.floats(-0.5, 0.5), st.floats(0.4, 1.0))
def test_a_base_with_corners_has_slowed_down_when_a_child_runs_round_one(start, speed, astray, runs):
    """It leaves a child at its side, faster than it may one at a corner, and the child bumps into it time and again."""
    wanted = geometry.rotate(-math.pi / 2 + astray, (speed, 0.0))  # away from the side on which the child begins
    followed = FollowedVelocity(SQUARE.limits.as_told, TIMESTEP)
    stands = view(child(*place_beside(start)))
    for _ in range(100):
        less, at_once = restrain(stands, SQUARE, CLEARANCE, TIMESTEP, False, wanted, followed.told)
        followed.follow(less, at_once, goes_on=False)
    for i in range(30):
        before, on = followed.told, start + runs * TIMESTEP * i
        x, y = place_beside(on)
        out = np.array(separation.outwards(SQUARE, 0.0, (x, y))) / (SQUARE.rounding + CHILD_RADIUS)
        assert abs(before[0] * out[1] - before[1] * out[0]) < STRIKE_SPEED
        apart = 0.015 * (i % 2)
        seen = view(child(x + apart * out[0], y + apart * out[1], -runs * out[1], runs * out[0]))
        less, at_once = restrain(seen, SQUARE, CLEARANCE, TIMESTEP, False, wanted, before)
        followed.follow(less, at_once, goes_on=False)


def test_a_child_that_may_be_nearer_counts_as_near_as_that_and_the_base_keeps_its_limits():
    seen = dataclasses.replace(view(child(TOUCHING + 0.08, 0.0)), unsure=0.04)
    assert left(seen, (0.03, 0.0)) == (0.0, 0.0)
    assert left(seen, (0.0, 0.3)) == left(view(child(TOUCHING + 0.04, 0.0)), (0.0, 0.3))
    for unsure, at_once in ((0.0, True), (0.04, False)):
        touched = dataclasses.replace(TOUCHED, unsure=unsure)
        assert restrain(touched, ROBOT, CLEARANCE, TIMESTEP, False, (0.0, 0.0), (0.0, 0.0))[1] == at_once
