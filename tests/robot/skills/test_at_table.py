"""Coming up to a table among children, by a base that follows its references exactly."""

import math

import pytest
from robot_plans import centre
from views import child, view

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills import Pick
from caregiver_mj.robot.view import CHILD_RADIUS

ROBOT = find_embodiment()
TIMESTEP, WALKING_SPEED = 0.02, 0.44  # seconds, m/s
TOUCHING = ROBOT.footprint + CHILD_RADIUS  # metres between the middles of base and child
#: The candle's table stands in the western one of two rooms; between them is a long corridor as wide as one cell.
CORRIDOR = FloorPlan.parse(
    "#################\n#C.###########..#\n#..............B#\n#B.###########.T#\n#################", "corridor"
)


def test_a_base_goes_no_farther_out_of_a_childs_way_than_that_comes_after_it():
    """It would be too far off when the child turns back, as toddlers do after a step."""
    pick, robot = Pick(Navigator(CORRIDOR, ROBOT), 0, 0), RobotMotion(ROBOT, TIMESTEP)
    robot.reset((*centre(CORRIDOR, (2, 7)), 0.0))
    x, y = centre(CORRIDOR, (2, 5))
    candle = (*centre(CORRIDOR, (1, 1)), 0.6, 1.0, 0.0, 0.0, 0.0)
    gaps = []
    for speed in [WALKING_SPEED] * 84 + [0.0] * 65:  # one move, and a pause shorter than it stays aside
        base = (*robot.base_reference()[0], robot.yaw)
        pick.step(view(child(x, y, speed), base=base, now=robot.now, candles=[candle]), robot)
        robot.action(base)
        robot.now += TIMESTEP
        x += speed * TIMESTEP
        gaps.append(math.dist((x, y), base[:2]) - TOUCHING)
        assert pick.driver.stands_aside(robot.now) or robot.now < 0.7
    assert min(gaps) > 0.0
    assert 0.6 < gaps[-1] < 1.0


def hand_out_at_most(see, seconds):
    """How far out the hand comes, or will, at a table to which a base drives; `see` makes of the robot what it sees."""
    pick, robot = Pick(Navigator(CORRIDOR, ROBOT), 0, 0), RobotMotion(ROBOT, TIMESTEP)
    robot.reset((*centre(CORRIDOR, (2, 3)), math.pi))
    candle = (*centre(CORRIDOR, (1, 1)), 0.6, 1.0, 0.0, 0.0, 0.0)
    out = []
    while robot.now < seconds:
        base, *who = see(robot)
        pick.step(view(*who, base=base, now=robot.now, candles=[candle]), robot)
        robot.action(base)
        robot.now += TIMESTEP
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


def test_a_candle_behind_another_one_on_all_sides_is_not_picked_over_it():
    plan = FloorPlan.parse("######\n#C####\n#..BC#\n#....#\n#T..T#\n######", "alcove")
    x, y = centre(plan, (1, 1))
    pick = Pick(Navigator(plan, ROBOT), 0, 0)
    for before, has_way in ((0.05, False), (0.25, False), (0.35, True), (-0.1, True)):
        candles = [(x, y, 0.6, 1.0, 0.0, 0.0, 0.0), (x, y - before, 0.6, 1.0, 0.0, 0.0, 0.0)]
        assert pick.has_way(view(candles=candles)) == has_way
