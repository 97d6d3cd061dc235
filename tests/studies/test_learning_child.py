"""The study of a child that learns: what it is taught, by hand."""

import numpy as np
import pytest

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from studies.learning_child import Learner

# Two cells in a row: a bin to the east, stairs to the west, another bin south of the first.
PLAN = FloorPlan.parse("######\n#S..B#\n##B###\n######", "row")
NORTH, EAST, SOUTH, WEST = range(4)


def teach(learner, cell, action, damage, next_cell):
    learner.learn(*(np.array([value]) for value in (cell, action, damage, next_cell)))


def test_learning_by_hand():
    learner = Learner(PLAN, 0.0, [False])
    assert PLAN.bins == ((1, 4), (2, 2))
    teach(learner, 1, EAST, 0.0, 1)  # into the first bin: worth 1 to who goes there, half of it learnt
    assert learner.values[0, 1, :, EAST].tolist() == [0.5, 0.0]
    teach(learner, 1, EAST, 0.0, 1)  # for the other bin it has only led back to its cell, which is worth nothing
    assert learner.values[0, 1, :, EAST].tolist() == [0.75, 0.0]
    teach(learner, 0, EAST, 0.0, 1)
    assert learner.values[0, 0, :, EAST] == pytest.approx([0.5 * 0.95 * 0.75, 0.0])
    teach(learner, 0, WEST, 5.0, 0)  # down the stairs hurts whichever bin it goes to
    assert learner.values[0, 0, :, WEST] == pytest.approx([0.5 * (0.95 * 0.35625 - 5), -2.5])
    harmful = learner.believed_harmful()[0]
    assert [ACTIONS[action] for action in np.flatnonzero(harmful[0])] == [(0, -1)]  # west
    assert not harmful[1].any()


def test_only_the_wary_shuns_what_hurts_when_it_moves_at_random():
    learner = Learner(PLAN, 1.0, [False, True])
    learner.values[:, 0, 0] = [0.0, 0.0, 0.0, -5.0]
    chances = (np.arange(1000) + 0.5) / 1000
    sight = ChildPercept(np.zeros(2, int), np.zeros(2, int), np.full(2, NOTHING), np.zeros(2, bool))
    moves = np.array([learner.act(sight, np.array([[0.0, u, 0.0]] * 2)) for u in chances])
    assert (moves[:, 0] == WEST).mean() == pytest.approx(0.25, abs=0.002)
    assert (moves[:, 1] == WEST).mean() == pytest.approx(np.exp(-10) / (3 + np.exp(-10)), abs=0.002)
