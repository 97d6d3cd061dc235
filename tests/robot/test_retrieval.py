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
from caregiver_mj.robot.planning_scene import PlanningScene
from caregiver_mj.robot.retrieval import RetrievalPlanner

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
MIDDLE = (*ROOM.position((4, 4)).tolist(), 0.0)


def planner(robot):
    made = []

    def make_scene(heights):
        made.append(PlanningScene(build_house(ROOM, robot, visuals=False), ROOM, robot))
        return made[-1]

    return RetrievalPlanner(Navigator(ROOM, robot), make_scene), made


def found(search):
    while True:
        try:
            next(search)
        except StopIteration as end:
            return end.value


def seen(robot, *children):
    x, y = ROOM.position(ROOM.tables[0]).tolist()
    shown = view(*children, base=MIDDLE, candles=[(x, y, 0.83, 1.0, 0.0, 0.0, 0.0)])
    return dataclasses.replace(shown, arm=arm_of(robot).tucked)


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
def test_whatever_can_be_taken_along_can_be_laid_down(name):
    """One gripped at 50 degrees could not, and the robot stood with it for the rest of the episode."""
    robot = find_embodiment(name)
    postures, (search, _) = robot.postures, planner(robot)
    for pitch in (*postures.lying_pitches, postures.hand_pitch + np.pi / 2):
        stance = found(search.to_lay_down(seen(robot), 0, pitch))
        assert stance is not None, np.degrees(pitch)


def test_the_arm_reaches_last_where_a_child_is():
    robot = find_embodiment()
    search, _ = planner(robot)
    x, y = ROOM.position((4, 5)).tolist()
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
