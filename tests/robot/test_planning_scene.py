"""What the robot would touch in a pose, in a house of which every distance is known."""

import numpy as np
import pytest
from robot_plans import first_way

from caregiver_mj.house.scene import build_house
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.geometry import upright_grip
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.retrieval import PlanningScene

CANDLE_RADIUS = 0.022  # metres


@pytest.mark.parametrize(
    ("gap", "lift", "free", "free_with_candle"),
    [(0.30, 0.0, True, True), (0.19, 0.0, True, False), (0.19, 0.25, True, True), (0.09, 0.0, False, False)],
)
def test_planning_scene_knows_what_the_robot_and_the_candle_in_its_hand_would_touch(gap, lift, free, free_with_candle):
    """The robot looks east, at a candle before a wall, its foot towards that. In turning it up the foot swings out."""
    plan = FloorPlan.parse("########\n#B.....#\n#......#\n#......#\n#......#\n#C....T#\n########", "hall")
    x, y = plan.position((3, 7))[0] - 0.125 - gap, plan.position((3, 4))[1]
    arm = arm_of(find_embodiment())
    grip = upright_grip(np.array([-1.0, 0.0, 0.0]), arm.embodiment.postures.hand_pitch)
    path = first_way(arm, np.array([0.6, 0.0, 0.028]), grip, lift)
    way = [path.joints(s) for s in np.linspace(path.goal, 0.0, 49)]
    quarter = np.sqrt(0.5)
    candle = np.array([[x + 0.1, y, CANDLE_RADIUS, quarter, 0.0, -quarter, 0.0]])  # its top 0.16 m to the west
    scene = PlanningScene(build_house(plan), plan, find_embodiment())
    assert scene.is_free((x - 0.6, y, 0.0), way, candle, 0) == free
    assert scene.is_free((x - 0.6, y, 0.0), way, candle, 0, held=True) == free_with_candle


@pytest.mark.parametrize(("gap", "free"), [(0.033, False), (0.037, True)])
def test_tables_may_be_off_their_places_and_the_robot_keeps_a_margin(gap, free):
    plan = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
    robot = find_embodiment()
    scene = PlanningScene(build_house(plan), plan, robot)
    x, y = plan.position(plan.tables[1])
    base = (x - layout.TABLE_HALF_SIZE - gap - robot.footprint, y, 0.0)
    elsewhere = np.array([[50.0, 50.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    assert scene.is_free(base, [arm_of(robot).tucked], elsewhere, 0) == free
