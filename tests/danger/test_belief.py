"""The filter over goal and epsilon, against values worked by hand in a corridor."""

import dataclasses

import numpy as np
import pytest

from caregiver_mj.danger.belief import STOP, Belief
from caregiver_mj.danger.chain import ChildChain


@pytest.fixture
def corridor():
    """Three cells in a row, a goal at either end, of moves west and east. East of the middle stands nothing.

    Epsilon is 0 or 1: a child that always heads for its goal, or one that never does.
    """
    greedy = np.zeros((3, 2, 2))
    greedy[:, 0, 0] = greedy[:, 1, 1] = 1.0  # west to goal 0, east to goal 1
    next_cell = np.array([[0, 1], [0, 2], [1, 2]])
    ends = np.array([[0, -1], [-1, -1], [-1, 1]])[..., None] == np.arange(2)
    return ChildChain(greedy, np.array([0.0, 1.0]), next_cell, ends, np.full((3, 2), -1), 0)


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


def test_what_nobody_does_and_no_move_tell_nothing(corridor):
    belief = Belief(corridor)
    belief.watch(np.array([[1]]), np.array([[-1]]))
    assert belief.probability == pytest.approx(0.25)
    certain = Belief(corridor)
    certain.probability = np.array([[[[1.0, 0.0], [0.0, 0.0]]]])
    assert watched(certain, (0, 1)) == pytest.approx(np.array([[1.0, 0.0], [0.0, 0.0]]))


def test_it_may_be_another_child_from_now_on(corridor):
    belief = Belief(corridor, change=0.5)
    # Half of what is known is lost: the mean of the prior, 1/4 each, and of 0, 1/4, 1/2, 1/4.
    assert watched(belief, (0, 1)) == pytest.approx(np.array([[0.125, 0.25], [0.375, 0.25]]))
    assert belief.goal[0, 0] == pytest.approx([0.375, 0.625])


def test_a_stop_ends_what_is_known_of_epsilon(corridor):
    certain = Belief(corridor, change=1e-12)
    certain.probability = np.array([[[[1.0, 0.0], [0.0, 0.0]]]])
    # Its goal it keeps; of its epsilon half of `STOP` goes to the other one.
    assert watched(certain, (0, -1)) == pytest.approx(np.array([[1 - STOP / 2, STOP / 2], [0.0, 0.0]]))


def test_a_goal_may_lead_to_some_goals_only(corridor):
    belief = Belief(dataclasses.replace(corridor, next_goal=np.array([[0.0, 1.0], [0.0, 1.0]])))
    # West from the west end: 1/2, 1/4, 0, 1/4; whoever had goal 0 has goal 1 from then on.
    assert watched(belief, (0, 0)) == pytest.approx(np.array([[0.0, 0.0], [0.5, 0.5]]))


def test_who_goes_where_the_caregiver_is_follows_it(corridor):
    towards = np.eye(2)[np.array([[0, 0, 0], [1, 0, 0], [1, 1, 1]])]  # by the caregiver's cell, and the child's
    belief = Belief(dataclasses.replace(corridor, follows=lambda there, cell: towards[there, cell]))
    belief.watch(np.array([[1]]), np.array([[1]]), np.array([2]))
    # East, where the caregiver is: 0 and 1/2 for goal 0, 1 and 1/2 for following.
    assert belief.probability[0, 0] == pytest.approx(np.array([[0.0, 0.25], [0.5, 0.25]]))
    belief.watch(np.array([[2]]), np.array([[0]]), np.array([2]))
    # West, away from it: 0, 1/8, 0, 1/8.
    assert belief.probability[0, 0] == pytest.approx(np.array([[0.0, 0.5], [0.0, 0.5]]))


def test_who_does_the_same_again_and_again_is_not_understood(corridor):
    """In the middle it goes west and in the west it goes east: nobody's way to a goal, and no chance."""
    belief = Belief(corridor)
    watched(belief, *[(1, 0), (0, 1)] * 3)
    assert belief.understood.all()
    watched(belief, *[(1, 0), (0, 1)] * 20)
    assert not belief.understood.any()


def test_who_moves_at_random_or_to_a_goal_is_understood(corridor):
    moves = np.random.default_rng(0).integers(0, 2, 1000)
    cell, belief = 1, Belief(corridor, change=0.005)
    for move in moves.tolist():
        belief.watch(np.array([[cell]]), np.array([[move]]))
        assert belief.understood.all()
        cell = int(corridor.next_cell[cell, move])


def test_children_are_independent(corridor):
    belief = Belief(corridor, batch=2, children=2)
    belief.watch(np.array([[0, 1], [2, 1]]), np.array([[1, -1], [0, 0]]))
    east, west = np.array([[0.0, 0.25], [0.5, 0.25]]), np.array([[0.5, 0.25], [0.0, 0.25]])
    assert belief.probability[0, 0] == pytest.approx(east)
    assert belief.probability[0, 1] == pytest.approx(0.25)
    assert belief.probability[1] == pytest.approx(np.stack([west, west]))


def test_a_child_that_rests_is_known_the_same_whoever_moves_beside_it():
    """It does what three of four do not, over and over, with rests: what is remembered of it is what surprises."""
    greedy, nowhere = np.array([[[0.0, 1.0]]]), np.zeros((1, 2, 1), bool)
    chain = ChildChain(greedy, np.array([0.5]), np.zeros((1, 2), int), nowhere, np.full((1, 2), -1), 0)
    alone, beside = Belief(chain), Belief(chain, batch=2)
    for move in (0, 0, -1, -1, -1, 0, -1, 0):
        alone.watch(np.array([[0]]), np.array([[move]]))
        beside.watch(np.array([[0], [0]]), np.array([[move], [1]]))
    assert alone._surprise[0, 0] > 1.0
    np.testing.assert_array_equal(beside._surprise[0], alone._surprise[0])
    np.testing.assert_array_equal(beside.probability[0], alone.probability[0])
