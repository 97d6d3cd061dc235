"""The adversary, on a map on which its way is known by hand."""

import numpy as np
import pytest
from scripted_child import EAST, NORTH, SOUTH, WEST

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.robot_related import Adversary
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

#    0123456
WINDING = FloorPlan.parse("#######\n#..#..#\n#.B#.S#\n#.....#\n#######", "winding")


def way(child, caregiver, plan=WINDING):
    """The move of a child towards a caregiver, both given by cell."""
    goal = NOTHING if caregiver is None else plan.cell_index[caregiver]
    cell = np.array([plan.cell_index[child]])
    sight = Sight(cell, np.zeros(1, int), np.array([goal]), np.zeros(1, bool))
    return int(Adversary(plan, 0.5).act(sight, np.zeros((1, 3)))[0])


@pytest.mark.parametrize(
    ("child", "caregiver", "move"),
    [
        ((1, 2), (1, 4), WEST),  # round the wall: west, south, south, ...
        ((1, 1), (1, 4), SOUTH),
        ((3, 1), (1, 4), EAST),
        ((3, 4), (1, 4), NORTH),
        ((1, 5), (1, 4), WEST),
    ],
)
def test_it_takes_a_shortest_way(child, caregiver, move):
    assert way(child, caregiver) == move


def test_it_goes_into_a_landing_only_if_the_caregiver_is_there():
    assert way((1, 5), (2, 5)) == SOUTH
    assert way((3, 5), (2, 5)) == NORTH
    # Through the landing it would be two moves.
    assert way((1, 5), (3, 5)) == WEST


def test_without_a_caregiver_it_goes_north():
    assert way((1, 1), None) == NORTH


def test_children_of_a_batch_decide_alone():
    cells = np.array([WINDING.cell_index[cell] for cell in ((1, 2), (3, 4), (1, 1))])
    goals = np.array([WINDING.cell_index[(1, 4)], WINDING.cell_index[(1, 4)], NOTHING])
    sight = Sight(cells, np.zeros(3, int), goals, np.zeros(3, bool))
    assert Adversary(WINDING, 0.0).act(sight, np.zeros((3, 3))).tolist() == [WEST, NORTH, NORTH]
