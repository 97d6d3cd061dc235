"""The filter over goal and epsilon, against values worked by hand in a corridor."""

import numpy as np
import pytest

from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.chain import ChildChain


@pytest.fixture
def corridor():
    """Three cells in a row, a goal at either end, of moves west and east. East of the middle stands nothing.

    Epsilon is 0 or 1: a child that always heads for its goal, or one that never does.
    """
    greedy = np.zeros((3, 2, 2))
    greedy[:, 0, 0] = greedy[:, 1, 1] = 1.0  # west to goal 0, east to goal 1
    next_cell = np.array([[0, 1], [0, 2], [1, 2]])
    goal_at = np.array([[0, -1], [-1, -1], [-1, 1]])
    return ChildChain(greedy, np.array([0.0, 1.0]), next_cell, goal_at, np.full((3, 2), -1), 0)


def watched(belief, *moves):
    for cell, move in moves:
        belief.watch(np.array([[cell]]), np.array([[move]]))
    return belief.probability[0, 0]


def test_a_move_tells_goal_and_epsilon(corridor):
    # P(east) is 0 and 1/2 for goal 0 (epsilon 0 and 1), 1 and 1/2 for goal 1: over 2 in all.
    assert watched(Belief(corridor), (0, 1)) == pytest.approx(np.array([[0.0, 0.25], [0.5, 0.25]]))
    # Once more: 0, 1/8, 1/2, 1/8.
    assert watched(Belief(corridor), (0, 1), (1, 1)) == pytest.approx(np.array([[0, 1 / 6], [2 / 3, 1 / 6]]))


def test_goals_reached_are_drawn_anew(corridor):
    # East three times makes 0, 1/10, 8/10, 1/10; then whoever had goal 1 may have either.
    found = watched(Belief(corridor), (0, 1), (1, 1), (2, 1))
    assert found == pytest.approx(np.array([[0.4, 0.15], [0.4, 0.05]]))


def test_no_move_tells_nothing(corridor):
    belief = Belief(corridor)
    belief.watch(np.array([[1]]), np.array([[-1]]))
    assert belief.probability == pytest.approx(0.25)


def test_epsilon_may_change(corridor):
    belief = Belief(corridor, change=0.5)
    found = watched(belief, (0, 1))
    # Half of what is known of epsilon is lost, and none of what is known of the goal: 1/4 and 3/4.
    assert found == pytest.approx(np.array([[0.0625, 0.1875], [0.4375, 0.3125]]))
    assert belief.goal[0, 0] == pytest.approx([0.25, 0.75])
    assert belief.epsilon[0, 0] == pytest.approx([0.5, 0.5])


def test_what_nobody_does_tells_nothing(corridor):
    certain = Belief(corridor)
    certain.probability = np.array([[[[1.0, 0.0], [0.0, 0.0]]]])
    assert watched(certain, (0, 1)) == pytest.approx(np.array([[1.0, 0.0], [0.0, 0.0]]))


def test_children_are_independent(corridor):
    belief = Belief(corridor, batch=2, children=2)
    belief.watch(np.array([[0, 1], [2, 1]]), np.array([[1, -1], [0, 0]]))
    east, west = np.array([[0.0, 0.25], [0.5, 0.25]]), np.array([[0.5, 0.25], [0.0, 0.25]])
    assert belief.probability[0, 0] == pytest.approx(east)
    assert belief.probability[0, 1] == pytest.approx(0.25)
    assert belief.probability[1] == pytest.approx(np.stack([west, west]))
