import numpy as np
import pytest

from caregiver_mj.children.behaviour import MoveRules, denied
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

PLAN = FloorPlan.parse("#####\n#B..#\n#...#\n#T.S#\n#####")
A, B, C, D, E, F = range(6)  # the free cells, in reading order: A and B above, C, D and E, and F between T and S
NORTH, EAST, SOUTH, WEST = range(4)
LANDING = 6


@pytest.mark.parametrize(
    ("cell", "action", "next_cell", "target", "number", "entered"),
    [
        (A, EAST, B, Target.FREE, NOTHING, B),
        (A, WEST, A, Target.BIN, 0, NOTHING),
        (A, NORTH, A, Target.WALL, NOTHING, NOTHING),
        (C, SOUTH, C, Target.TABLE, 0, NOTHING),
        (E, SOUTH, E, Target.STAIRWELL, 0, LANDING),
        (F, NOTHING, F, NOTHING, NOTHING, NOTHING),
    ],
)
def test_what_a_move_leads_to(cell, action, next_cell, target, number, entered):
    assert MoveRules(PLAN).way(cell, action) == (next_cell, target, number, entered)


def test_of_a_batch_it_is_the_same():
    cells, actions = np.array([A, A, E, F]), np.array([EAST, WEST, SOUTH, NOTHING])
    one_by_one = [MoveRules(PLAN).way(*pair) for pair in zip(cells, actions, strict=True)]
    assert np.array(MoveRules(PLAN).way(cells, actions)).T.tolist() == np.array(one_by_one).tolist()


def test_a_child_waits_for_another_one_in_its_way_and_for_nobody_else():
    ways = MoveRules(PLAN).way(np.array([A, A, A, C]), np.array([EAST, EAST, NOTHING, SOUTH]))
    assert ways.waits(np.array([[D, B], [D, E], [A, B], [C, B]])).tolist() == [True, False, False, False]


def test_the_caregiver_is_in_the_way_in_a_free_cell_and_on_a_landing():
    rules = MoveRules(PLAN)
    assert rules.way(A, EAST).meets(B)
    assert rules.way(E, SOUTH).meets(LANDING)
    assert not rules.way(A, WEST).meets(NOTHING)
    assert not rules.way(A, NOTHING).meets(A)


def test_only_the_bin_that_a_child_wants_is_reached():
    way = MoveRules(PLAN).way(A, WEST)
    assert (bool(way.reaches(0)), bool(way.reaches(1))) == (True, False)


def test_what_is_denied():
    targets = np.array([Target.STAIRWELL, Target.FREE, Target.TABLE, Target.FREE])
    blocked = np.array([True, True, True, False])
    assert denied(targets, blocked).tolist() == [[True, False], [False, True], [False, False], [False, False]]
