"""Where a candle that has fallen is picked up, and laid down again."""

import dataclasses

import numpy as np
import pytest
from views import child, view

from caregiver_mj.house.scene import build_house
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import PlanningScene, RetrievalPlanner, Search

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
MIDDLE = (*ROOM.position((4, 4)).tolist(), 0.0)


def planner(robot):
    scene = PlanningScene(build_house(ROOM, robot, visuals=False), ROOM, robot)
    return RetrievalPlanner(Navigator(ROOM, robot), lambda heights: scene)


def found(search):
    while True:
        try:
            next(search)
        except StopIteration as end:
            return end.value


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
def test_whatever_can_be_taken_along_can_be_laid_down(name):
    """One gripped at 50 degrees could not, and the robot stood with it for the rest of the episode."""
    robot = find_embodiment(name)
    postures, search, (x, y) = robot.postures, planner(robot), ROOM.position(ROOM.tables[0]).tolist()
    shown = view(base=MIDDLE, candles=[(x, y, 0.83, 1.0, 0.0, 0.0, 0.0)])
    shown.arm = arm_of(robot).tucked
    for pitch in (*postures.lying_pitches, postures.hand_pitch + np.pi / 2):
        stance = found(search.to_lay_down(shown, 0, pitch))
        assert stance is not None, np.degrees(pitch)


def test_the_arm_reaches_last_where_a_child_is():
    search, (x, y) = planner(find_embodiment()), ROOM.position((4, 5)).tolist()
    standing = view(base=MIDDLE, candles=[(x, y, 0.0, 1.0, 0.0, 0.0, 0.0)])
    alone = found(search.to_pick_up(standing, 0))
    beside = alone.base[:2]
    past = found(search.to_pick_up(dataclasses.replace(standing, children=(child(*beside),)), 0))
    assert np.dot(np.array(past.base[:2]) - (x, y), np.array(beside) - (x, y)) < 0.0  # from the other side


def test_the_scene_is_made_anew_for_tables_of_other_heights_only():
    robot, asked = find_embodiment(), []
    search = RetrievalPlanner(Navigator(ROOM, robot), asked.append)
    for heights in (None, None, (0.5,), (0.5,), (0.7,), None):
        search.prepare(heights)
    assert asked == [None, (0.5,), (0.7,), None]


def test_a_search_goes_on_where_it_was_and_says_what_it_has_found():
    def count(limit):
        for _ in range(limit):
            yield 1.0  # a millisecond of work
        return limit

    search = Search(count(25))
    assert ([search.go_on(10.0) for _ in range(4)], search.found) == ([False, False, True, True], 25)
