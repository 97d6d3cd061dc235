"""How fast the base may drive near children: against a base that brakes, and for several children at once."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from views import ROBOT, TIMESTEP, at_rest, child, view

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import governor, separation
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.scalar_motion import ScalarMotion
from caregiver_mj.robot.separation import allowed_rate

WIDE = FloorPlan.parse("\n".join(["#" * 30, "#S{0}#", *["#.{0}#"] * 24, "#B{0}#", "#" * 30]).format("." * 27), "wide")

STRIKE_SPEED = 0.05  # m/s
TOUCHING = 0.27 + 0.12  # metres between the middles of base and child
CHILD_SPEED = 0.62  # m/s, at which it may come
REACTION = 0.04  # seconds
REMAINS = 0.08  # metres
OPEN = FloorPlan.parse("########\n#......#\n#S.....#\n#......#\n#B.....#\n########", "open")
speeds = st.floats(-0.7, 0.7)
children = st.builds(
    lambda distance, angle, *velocity: child(distance * math.cos(angle), distance * math.sin(angle), *velocity),
    st.floats(0.3, 3.0), st.floats(-math.pi, math.pi), speeds, speeds,
)  # fmt: skip
families = st.lists(children, min_size=1, max_size=4)
velocities = st.builds(
    lambda speed, angle: (speed * math.cos(angle), speed * math.sin(angle)), st.floats(0.01, 1.4), st.floats(-4.0, 4.0)
)


@pytest.mark.parametrize("speed", [0.02, 0.2, 1.3])
def test_a_base_that_is_touched_leaves_freely_slides_slowly_and_never_comes_closer(speed):
    touched = view(child(TOUCHING, 0.0))
    assert allowed_rate(touched, ROBOT, (-speed, 0.0)) == 1.0
    assert 0.0 < speed * allowed_rate(touched, ROBOT, (0.0, speed)) < STRIKE_SPEED
    for towards in (1.0, 0.5):
        assert allowed_rate(touched, ROBOT, (towards * speed, math.sqrt(1 - towards**2) * speed)) == 0.0


@pytest.mark.parametrize(("gap", "speed"), [(0.55, 0.5), (0.9, 1.3), (1.6, 0.9)])
def test_a_base_that_brakes_leaves_what_shall_remain_to_a_child_that_comes(gap, speed):
    rate = allowed_rate(view(child(TOUCHING + gap, 0.0)), ROBOT, (speed, 0.0))
    braking = ScalarMotion(ROBOT.limits.together, 0.0)
    braking.run_at(rate * speed, 0.0, at_once=True)
    braking.run_at(0.0, REACTION)
    end = braking.arrival
    left = gap - braking.at(end)[0] - CHILD_SPEED * end
    assert left >= REMAINS
    # More only by half of the way in which the deceleration builds up, and by what a corner might cost.
    assert rate == 1.0 or left < REMAINS + 0.12 + 0.04 * (rate * speed + CHILD_SPEED)


@pytest.mark.parametrize(("gap", "speed"), [(0.0, 0.1), (0.12, 1.3), (0.4, 0.4)])
@pytest.mark.parametrize("leaves", [0.0, 0.5])
def test_a_base_that_slides_past_is_at_a_creep_before_a_child_is_at_it(gap, speed, leaves):
    # The child stands, and may set off at any moment; a base that has not left it yet is not to count on leaving it.
    rate = allowed_rate(view(child(TOUCHING + gap, 0.0)), ROBOT, (-leaves * speed, speed))
    assert rate * speed >= 0.02 - 1e-9 or rate == 1.0  # it does not wait
    braking = ScalarMotion(ROBOT.limits.together, 0.0)
    braking.run_at(rate * speed, 0.0, at_once=True)
    braking.run_at(0.0, REACTION)
    assert rate == 1.0 or braking.at(gap / CHILD_SPEED)[1] < STRIKE_SPEED


@pytest.mark.parametrize(
    ("heading", "speeds_up", "runs_at", "needs"),
    [
        # 3.809 m/s^2 at 55.44 m/s^3: 0.074 s until it brakes fully, 0.311 s until it stands, at 0.9 m/s.
        (0.0, 0.0, 0.0, 0.9 * (0.0744 + 0.1181) + 0.62 * 0.3107),
        (0.0, 0.0, 0.8, 0.9 * (0.0744 + 0.1181) + 0.8 * 0.3107),
        (0.0, 3.809, 0.0, 0.9 * (0.1774 + 0.1181) + 0.62 * 0.4137),  # first it must cease to speed up
        (0.0, -3.809, 0.0, 0.9 * (0.04 + 0.1181) + 0.62 * 0.2763),  # it brakes already
        (1.0, 0.0, 0.0, 0.9 * math.cos(1.0) * (0.0744 + 0.1181) + 0.62 * 0.3107),
    ],
)
def test_a_base_must_stop_where_it_has_no_more_way_left_than_that(heading, speeds_up, runs_at, needs):
    unit = math.cos(heading), math.sin(heading)
    motion = tuple(0.9 * x for x in unit), tuple(speeds_up * x for x in unit)
    for room, must in ((needs - 0.002, True), (needs + 0.002, False)):
        assert separation.must_stop(view(child(TOUCHING + room, 0.0, -runs_at)), ROBOT, *motion) == must


def test_a_base_stops_sooner_for_a_child_that_is_seen_late_and_for_any_of_several():
    needs = 0.9 * (0.0744 + 0.1181) + 0.62 * 0.3107  # as above
    for late, room, must in ((0.0, 0.05, False), (0.06, 0.05, True), (0.06, 0.1, False)):  # 0.091 m by then
        seen = view(child(-2.0, 0.0), child(TOUCHING + needs + room, 0.0))
        assert separation.must_stop(dataclasses.replace(seen, age=late), ROBOT, (0.9, 0.0), (0.0, 0.0)) == must


def test_a_base_that_passes_or_leaves_or_hardly_moves_need_not_stop():
    for velocity in ((0.3, 0.85), (-0.9, 0.0), (0.01, 0.0), (0.0, 0.0)):
        assert not separation.must_stop(view(child(TOUCHING + 0.02, 0.0)), ROBOT, velocity, (0.0, 0.0))


def test_a_base_that_leaves_a_child_straight_is_not_slowed_down():
    beside = view(child(TOUCHING + 0.02, 0.0))
    assert allowed_rate(beside, ROBOT, (-0.85, 0.53)) == 1.0  # 32 degrees off
    assert allowed_rate(beside, ROBOT, (-0.71, 0.71)) < 0.1


def test_a_child_comes_if_it_walks_towards_the_robot_or_has_run_into_it():
    near, far = TOUCHING + 0.5, TOUCHING + 1.0
    assert separation.comes(view(child(near, 0.0, -0.4, 0.0)), ROBOT)
    assert not separation.comes(view(child(near, 0.0, 0.4, 0.0)), ROBOT)
    assert not separation.comes(view(child(near, 0.0, 0.0, 0.4)), ROBOT)
    assert not separation.comes(view(child(far, 0.0, -0.4, 0.0)), ROBOT)
    assert separation.comes(view(child(TOUCHING + 0.005, 0.0)), ROBOT)


def test_a_child_is_in_the_way_where_it_is_and_where_it_will_be():
    seen = view(child(2.0, 1.0, 0.0, -1.0))  # at (2, 0.2) in 0.8 s
    assert separation.is_in_the_way(seen, ROBOT, [(2.0, 0.7)])
    assert separation.is_in_the_way(seen, ROBOT, [(0.0, 0.0), (2.0, -0.2)])
    assert not separation.is_in_the_way(seen, ROBOT, [(2.0, -0.5)])
    assert not separation.is_in_the_way(seen, ROBOT, [])


@settings(max_examples=50, deadline=None)
@given(family=families, velocity=velocities)
def test_the_strictest_child_sets_the_rate(family, velocity):
    alone = [allowed_rate(view(one), ROBOT, velocity) for one in family]
    assert allowed_rate(view(*family), ROBOT, velocity) == min(alone)


@pytest.mark.parametrize(
    ("one", "within", "is_near"),
    [
        (child(0.5, 0.29), 0.0, True),
        (child(0.5, 0.31), 0.0, False),
        (child(1.6, 0.0, -0.6, 0.0), 0.6, True),  # it comes to 0.24 m
        (child(1.6, 0.0, 0.6, 0.0), 0.6, False),  # it goes away
        (child(-1.0, 0.0, 2.0, 0.0), 0.5, True),  # it comes to where the line begins
        (child(0.5, 1.0, 0.0, -4.0), 0.5, True),  # it has passed by then
    ],
)
def test_a_child_is_at_a_line_that_it_is_near_or_comes_near_in_time(one, within, is_near):
    assert separation.is_child_at_line(view(one), (0.0, 0.0), (1.0, 0.0), 0.3, within) == is_near
    assert separation.is_child_at_line(view(child(9.0, 9.0), one), (0.0, 0.0), (1.0, 0.0), 0.3, within) == is_near


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
@given(places=st.lists(st.tuples(st.floats(1.5, 4.0), st.floats(-4.0, 4.0)), min_size=1, max_size=3), way=velocities)
@example(places=[(3.0, 0.0)], way=(1.4, 0.0))
def test_where_nobody_is_near_nothing_is_bounded(name, places, way):
    robot = find_embodiment(name)
    family = [child(d * math.cos(a), d * math.sin(a), -math.cos(a), -math.sin(a)) for d, a in places]  # they run to it
    seen = view(*family)
    seen.arm = arm_of(robot).tucked
    assume(separation.is_alone(seen, robot))
    assert allowed_rate(seen, robot, way, present=way) == 1.0
    assert separation.allowed_turning(seen, robot, way, (robot.limits.yaw.velocity, 0.0)) == math.inf
    assert not separation.is_child_at_hand(seen, robot, 1.0)
    # The clearance is not even asked.
    assert separation.restrain(seen, robot, None, TIMESTEP, False, way, way) == (way, False)


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
@settings(max_examples=200, deadline=None)
@given(family=families, velocity=velocities)
def test_a_base_that_does_not_turn_may_begin_to_as_fast_as_one_that_hardly_turns(name, family, velocity):
    robot, seen = find_embodiment(name), view(*family)
    rests, hardly = (separation.allowed_turning(seen, robot, velocity, (rate, 0.0)) for rate in (0.0, 1e-12))
    most = robot.limits.yaw.velocity
    assert min(most, rests) == pytest.approx(min(most, hardly))


def test_whoever_may_be_near_unseen_counts():
    near, far = child(1.0, 0.0), child(4.0, 0.0)
    assert separation.is_alone(view(far), ROBOT)
    assert not separation.is_alone(view(near, far), ROBOT)
    for unseen in ({"hidden": (near,)}, {"lurking": (near,)}):
        assert not separation.is_alone(dataclasses.replace(view(far), **unseen), ROBOT)


def test_the_cells_of_a_child_are_those_in_which_it_is_and_will_be():
    x, y = OPEN.position((2, 4)).tolist()
    walks, stands = child(x, y, 0.5, 0.0), child(x, y - 0.75)
    assert separation.child_cells([walks], OPEN) == {(2, 4), (2, 5)}
    assert separation.child_cells([walks, stands], OPEN) == {(2, 4), (2, 5), (3, 4)}
    np.testing.assert_allclose(separation.child_places([walks]), [(x, y), (x + 0.4, y)])


CORNER = 0.03  # metres by which the way to stop may be longer: a corner that comes meanwhile is not seen yet
ways = st.lists(st.tuples(st.floats(0.4, 3.0), st.floats(-2.0, 2.0)), min_size=1, max_size=4)


@settings(max_examples=60, deadline=None)
@given(way=ways, when=st.floats(0.0, 0.9))
@example(way=[(2.6473, 0.2132), (0.5495, -0.0056), (1.1411, 0.8797)], when=0.4386)  # the worst of 1,200 near a corner
def test_a_base_brakes_on_any_path_as_its_limits_say(way, when):
    """From any motion on a path with corners: within what `RobotLimits.braking` says, and the base's acceleration."""
    points, robot = polyline(way), at_rest()
    robot.drive_along(points, lambda _: True)
    brakes_at = when * robot.time_left
    while robot.now < brakes_at:
        robot.set_rate(1.0)
        robot.now += TIMESTEP
    speed = math.hypot(*robot.base_reference()[1])
    velocity, acceleration = robot.planned()
    assume(math.hypot(*velocity) > 0.05)
    deceleration, build_up = ROBOT.limits.braking(velocity, acceleration)
    before, gone = robot.base_reference()[0], 0.0
    while robot.moving:
        robot.set_rate(0.0)
        robot.now += TIMESTEP
        here, _, sped_up = robot.base_reference()
        gone, before = gone + math.dist(here, before), here
        assert math.hypot(*sped_up) <= ROBOT.limits.base_acceleration
    # The fastest that it gets until the acceleration under way has turned into braking counts.
    fastest = max(speed, math.hypot(*velocity))
    assert gone <= fastest**2 / (2 * deceleration) + fastest * (build_up + 2 * TIMESTEP) + CORNER


def polyline(way):
    """The points of a way given by lengths, metres, and turns, radians."""
    points, heading = [(0.0, 0.0)], 0.0
    for length, turn in way:
        heading += turn
        points.append((points[-1][0] + length * math.cos(heading), points[-1][1] + length * math.sin(heading)))
    return points


@pytest.mark.parametrize(
    ("gap", "speed"), [(-0.01, 0.03), (0.0, 0.03), (0.1, 0.03), (0.2, 0.09), (0.6, 0.33), (math.inf, math.inf)]
)
def test_the_nearer_a_child_the_slower_a_base_returns_to_where_it_shall_be(gap, speed):
    assert separation.catch_up_speed(gap) == pytest.approx(speed)


@pytest.mark.parametrize("speed", [0.0, 0.62, 0.8, 1.0, 1.5])
def test_a_child_that_runs_counts_as_fast_as_it_does_and_no_faster_than_any(speed):
    ahead = view(child(1.2, 0.0, -speed, 0.0))
    rate = allowed_rate(ahead, ROBOT, (1.0, 0.0))
    usual, fastest = (allowed_rate(view(child(1.2, 0.0, -v, 0.0)), ROBOT, (1.0, 0.0)) for v in (0.62, 1.0))
    assert fastest < usual
    assert rate == usual if speed <= 0.62 else fastest <= rate < usual
    assert rate == fastest or speed < 1.0


SQUARE = find_embodiment("mobile_ur5e")


@settings(max_examples=50, deadline=None)
@given(st.floats(0.38, 0.8), st.floats(-math.pi, math.pi), st.floats(-4.0, 4.0))
def test_the_gap_is_that_between_the_shapes_and_outwards_is_square_to_the_surface(distance, angle, yaw):
    base, place = (0.3, -0.2, yaw), (distance * math.cos(angle) + 0.3, distance * math.sin(angle) - 0.2)
    spec = mujoco.MjSpec()
    for name, at, kind, size in (
        ("base", (*base[:2], 0.0), mujoco.mjtGeom.mjGEOM_BOX, [0.205, 0.205, 0.1]),
        ("child", (*place, 0.0), mujoco.mjtGeom.mjGEOM_CYLINDER, [0.12, 0.1, 0.0]),
    ):
        turn = [0.0, 0.0, math.degrees(yaw) if name == "base" else 0.0]
        spec.worldbody.add_body(name=name, pos=at, euler=turn).add_geom(name=name, type=kind, size=size)
    model = spec.compile()
    data, ends = mujoco.MjData(model), np.empty(6)
    mujoco.mj_kinematics(model, data)
    gap = mujoco.mj_geomDistance(model, data, 0, 1, 2.0, ends)
    assume(gap > 1e-3)
    assert separation.gap_to(base, SQUARE, child(*place)) == pytest.approx(gap, abs=1e-5)
    out = separation.outwards(SQUARE, yaw, (place[0] - base[0], place[1] - base[1]))
    assert np.array(out) / math.hypot(*out) == pytest.approx((ends[3:5] - ends[:2]) / gap, abs=2e-2)


@settings(max_examples=60, deadline=None)
@given(way=ways, when=st.floats(0.0, 0.8), aside=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)))
@example(
    way=[(2.628, 0.878), (1.575, 0.675), (0.894, 0.852), (1.637, 0.729)], when=0.4912, aside=(-0.188, -0.032)
)  # on its path alone it still had 0.2 m/s
def test_a_base_is_at_rest_before_a_child_that_comes_whatever_its_path(way, when, aside):
    points, robot, clearance = polyline(way), at_rest(), Clearance(WIDE, ROBOT)
    robot.drive_along(points, lambda _: True)
    sets_off = when * robot.time_left
    base, toddler, walks, told = np.zeros(2), np.add(points[-1], aside), np.zeros(2), np.zeros(2)
    is_far = np.linalg.norm(toddler) > 2.0
    while robot.now < 8.0 and (room := np.linalg.norm(base - toddler)) > TOUCHING:
        if robot.now >= sets_off:
            walks = CHILD_SPEED * (base - toddler) / room
        seen = view(child(*toddler, *walks), base=(*base, 0.0), now=robot.now)
        robot.drives = 1.0
        told = governor.govern(seen, robot, clearance, TIMESTEP)[ROBOT.layout.base][:2]
        base, toddler = base + TIMESTEP * told, toddler + TIMESTEP * walks
        robot.now += TIMESTEP
    assert base.any() or not is_far  # it sets off
    assert robot.now >= 8.0 or told @ (toddler - base) < STRIKE_SPEED * TOUCHING
