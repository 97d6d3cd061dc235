"""Coming up to a table among children, by a base that follows its references exactly."""

import math

import pytest
from robot_plans import centre
from views import ROBOT, TIMESTEP, at_rest, child, follow, view

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import geometry, governor
from caregiver_mj.robot.kinematics import arm_of, hand_position
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills import Pick, Place
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import CHILD_RADIUS

WALKING_SPEED = 0.44  # m/s
TOUCHING = ROBOT.footprint + CHILD_RADIUS  # metres between the middles of base and child
#: The candle's table stands in the western one of two rooms; between them is a long corridor as wide as one cell.
CORRIDOR = FloorPlan.parse(
    "#################\n#C.###########..#\n#..............B#\n#B.###########.T#\n#################", "corridor"
)

#: Tables stand at its walls.
ROOM = FloorPlan.parse("##########\n#B.C.....#\n#........#\n#.......T#\n##########", "room")


def test_a_base_goes_no_farther_out_of_a_childs_way_than_that_comes_after_it():
    """It would be too far off when the child turns back, as toddlers do after a step."""
    pick, robot = Pick(Navigator(CORRIDOR, ROBOT), 0, 0), at_rest((*centre(CORRIDOR, (2, 6)), 0.0))
    x, y = centre(CORRIDOR, (2, 5))
    candle = (*centre(CORRIDOR, (1, 1)), 0.6, 1.0, 0.0, 0.0, 0.0)
    gaps = []
    for speed in [WALKING_SPEED] * 84 + [0.0] * 65:  # one move, and a pause shorter than it stays aside
        base = (*robot.base_reference()[0], robot.yaw)
        seen = view(child(x, y, speed), base=base, now=robot.now, candles=[candle])
        pick.step(seen, robot)
        follow(seen, robot)
        x += speed * TIMESTEP
        gaps.append(math.dist((x, y), base[:2]) - TOUCHING)
        assert pick.driver.stands_aside(robot.now) or robot.now < 0.7
    assert min(gaps) > 0.0
    assert 0.6 < gaps[-1] < 1.0


def hand_out_at_most(see, seconds):
    """How far out the hand comes, or will, at a table to which a base drives; `see` makes of the robot what it sees."""
    pick, robot = Pick(Navigator(CORRIDOR, ROBOT), 0, 0), at_rest((*centre(CORRIDOR, (2, 3)), math.pi))
    candle = (*centre(CORRIDOR, (1, 1)), 0.6, 1.0, 0.0, 0.0, 0.0)
    out = []
    while robot.now < seconds:
        base, *who = see(robot)
        seen = view(*who, base=base, now=robot.now, candles=[candle])
        pick.step(seen, robot)
        follow(seen, robot)
        out.append(robot.hand_out)
    return max(out)


@pytest.mark.parametrize(("aside", "comes_down"), [(0.0, True), (0.007, True), (0.009, False)])
def test_the_hand_comes_down_only_where_the_base_is_as_planned(aside, comes_down):
    """The fingers would meet the candle that they are to go round."""

    def see(robot):
        (x, y), yaw = robot.base_reference()[0], robot.yaw
        off = aside if robot.time_left < 1.0 else 0.0
        return ((x - off * math.sin(yaw), y + off * math.cos(yaw), yaw),)

    assert hand_out_at_most(see, 6.0) == pytest.approx(1.0 if comes_down else ROBOT.approach.hover)


@pytest.mark.parametrize(("away", "comes_down"), [(None, True), (1.2, True), (0.8, False)])
def test_the_hand_comes_down_before_the_turn_is_done_only_where_no_child_may_stop_it(away, comes_down):
    """It once came down 3 cm beside a candle, and knocked it over."""

    def see(robot):
        x, y = robot.base_reference()[0]
        who = () if away is None else (child(x, y - away),)
        return (x, y, robot.yaw + 0.05), *who  # radians to go

    assert (hand_out_at_most(see, 8.0) == pytest.approx(1.0)) == comes_down


@pytest.mark.parametrize("begins", [1.2, 1.8, 2.4])
def test_the_hand_does_not_come_over_a_child_that_walks_up_to_the_side_of_the_table(begins):
    """A base that drove past one to its table once let a candle down on the child's head."""
    pick, robot, arm = Pick(Navigator(ROOM, ROBOT), 0, 0), at_rest((*centre(ROOM, (2, 6)), math.pi / 2)), arm_of(ROBOT)
    x, y = centre(ROOM, (1, 3))
    low, away = [], []  # heights of the hand, and how far off the child's middle a low one is, metres
    while robot.now < 8.0:
        there = max(x + layout.TABLE_HALF_SIZE + CHILD_RADIUS, x + begins - WALKING_SPEED * robot.now)
        base = (*robot.base_reference()[0], robot.yaw)
        seen = view(child(there, y), base=base, now=robot.now, candles=[(x, y, 0.6, 1.0, 0.0, 0.0, 0.0)])
        pick.step(seen, robot)
        follow(seen, robot)
        ahead, _, height = arm.pinch(robot.reach_path.joints(robot.reached)).tolist()
        low.append(height)
        if height < 0.9:
            away.append(math.dist(geometry.to_world(base, (ahead, 0.0)), (there, y)))
    assert min(low) < 0.75  # it has come to the candle
    assert min(away) > ROBOT.clearances.hand + CHILD_RADIUS


@pytest.mark.parametrize("begins", [1.2, 1.6, 1.75, 1.9])
def test_a_base_that_stops_for_a_new_path_beside_a_child_goes_on_to_the_candle(begins):
    """It waited with its hand half out, with which no path is taken, for as long as the child stood there."""
    pick, robot = Pick(Navigator(ROOM, ROBOT), 0, 0), at_rest((*centre(ROOM, (2, 6)), math.pi / 2))
    stand = x, y = centre(ROOM, (2, 3))
    candle = (*centre(ROOM, (1, 3)), 0.6, 1.0, 0.0, 0.0, 0.0)
    robot.drive_along([robot.base_reference()[0], stand], lambda _: True)  # for something else
    reached = []
    while robot.now < begins + 4.0:
        base = (*robot.base_reference()[0], robot.yaw)
        seen = view(child(x - 0.85, y), base=base, now=robot.now, candles=[candle])
        if robot.now < begins:
            robot.set_rate(governor.path_rate(seen, robot))
        else:
            pick.step(seen, robot)
        follow(seen, robot)
        reached.append(robot.reached)
    assert max(reached) == pytest.approx(1.0)


@pytest.mark.parametrize(("aside", "comes_out"), [(0.05, True), (0.17, False)])
def test_the_hand_waits_until_all_of_it_is_before_the_table(aside, comes_out):
    """Beside a child at the side of it."""
    (x, y), (left, below) = centre(ROOM, (1, 3)), centre(ROOM, (2, 3))
    base = left + aside, below, math.pi / 2
    pick, robot = Pick(Navigator(ROOM, ROBOT), 0, 0), at_rest(base)
    who = child(x + layout.TABLE_HALF_SIZE + CHILD_RADIUS, y)
    out = []
    while robot.now < 1.0:
        seen = view(who, base=base, now=robot.now, candles=[(x, y, 0.6, 1.0, 0.0, 0.0, 0.0)])
        pick.step(seen, robot)
        follow(seen, robot)
        out.append(robot.hand_out)
    assert (max(out) > 0.0) == comes_out


@pytest.mark.parametrize(("falls", "status"), [(0.0, Status.RUNNING), (0.9, Status.OVERTAKEN)])
def test_what_has_slipped_to_the_fingertips_is_not_lost_until_it_falls(falls, status):
    """It once was taken for lost, and dropped by a hand that was taken for empty."""
    base = *centre(CORRIDOR, (2, 5)), 0.0
    place, robot = Place(Navigator(CORRIDOR, ROBOT), 0, 1), at_rest(base)
    x, y, z = hand_position(view(base=base), ROBOT).tolist()
    candle = x + 0.02, y, z - 0.1 - falls, 1.0, 0.0, 0.0, 0.0
    # Closer than round a candle of 44 mm.
    seen = view(child(*centre(CORRIDOR, (2, 13))), base=base, fingers=0.03, candles=[candle])
    assert place.step(seen, robot) is status


@pytest.mark.parametrize(("tilt", "slow"), [(0.0, False), (-10.0, True), (10.0, True)])
def test_with_a_tilted_candle_the_base_turns_slowly(tilt, slow):
    """Of one the fingers had only the edge, though its foot had hardly moved: it slipped out of the hand."""
    base = *centre(CORRIDOR, (2, 5)), 0.0
    place, robot = Place(Navigator(CORRIDOR, ROBOT), 0, 1), at_rest(base)
    x, y, z = hand_position(view(base=base), ROBOT).tolist()
    half = math.radians(tilt) / 2
    candle = x + 0.005, y, z - 0.1, math.cos(half), 0.0, math.sin(half), 0.0
    place.step(view(child(*centre(CORRIDOR, (2, 13))), base=base, candles=[candle]), robot)
    robot.turn_to(robot.yaw + 2.0)
    rates = []
    for _ in range(100):
        robot.now += TIMESTEP
        rates.append(abs(robot.turning[0]))
    assert (max(rates) < 0.5) == slow


def test_a_candle_behind_another_one_on_all_sides_is_not_picked_over_it():
    plan = FloorPlan.parse("######\n#C####\n#..BC#\n#....#\n#T..T#\n######", "alcove")
    x, y = centre(plan, (1, 1))
    pick = Pick(Navigator(plan, ROBOT), 0, 0)
    for before, has_way in ((0.05, False), (0.25, False), (0.35, True), (-0.1, True)):
        candles = [(x, y, 0.6, 1.0, 0.0, 0.0, 0.0), (x, y - before, 0.6, 1.0, 0.0, 0.0, 0.0)]
        assert pick.has_way(view(candles=candles)) == has_way
