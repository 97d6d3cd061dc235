"""Where a child may be soon, and bumps into any of several things, against values worked by hand."""

import numpy as np
import pytest

from caregiver_mj.danger.chain import ChildChain, first_passage, presence


@pytest.fixture
def corridor():
    """Three cells between two objects, one goal that nobody reaches; moves west and east, all of them at random."""
    next_cell = np.array([[0, 1], [0, 2], [1, 2]])
    object_at = np.array([[0, -1], [-1, -1], [-1, 1]])
    greedy = np.full((3, 1, 2), 0.5)
    return ChildChain(greedy, np.ones(1), next_cell, np.zeros((3, 2, greedy.shape[1]), bool), object_at, 2)


def test_any_of_several_objects(corridor):
    either = np.array([[True], [True]])
    # In one move from an end; in two also from the middle, and else from an end: stay (1/2), or back and out (0).
    assert first_passage(corridor, 1, either)[:, 0] == pytest.approx([0.5, 0.0, 0.5])
    assert first_passage(corridor, 2, either)[:, 0] == pytest.approx([0.5, 0.5, 0.5])
    # From the west end in three: at once (1/2), or to the middle and (1/2) out of it at either side.
    assert first_passage(corridor, 3, either)[:, 0] == pytest.approx([0.75, 0.5, 0.75])


def test_groups_of_one_are_the_objects(corridor):
    assert first_passage(corridor, 4, np.eye(2, dtype=bool)) == pytest.approx(first_passage(corridor, 4))


def test_presence(corridor):
    west = np.array([1.0, 0.0, 0.0])
    assert presence(corridor, west, 1) == pytest.approx([0.5, 0.5, 0.0])
    # In two moves: back at the west end unless it went east twice; in the middle unless it stayed twice.
    assert presence(corridor, west, 2) == pytest.approx([0.75, 0.75, 0.25])
    # In three: not in the west only after east, east and any; in the middle unless it stayed three times; at the east
    # end after stay, east, east, or east, east and any.
    assert presence(corridor, west, 3) == pytest.approx([0.75, 0.875, 0.375])


def test_presence_of_a_child_that_may_be_in_several_states(corridor):
    now = np.array([0.5, 0.0, 0.5])
    each = [presence(corridor, state, 3) for state in np.eye(3)]
    assert presence(corridor, now, 3) == pytest.approx((each[0] + each[2]) / 2)


def test_nowhere_in_no_moves(corridor):
    assert presence(corridor, np.array([0.0, 1.0, 0.0]), 0) == pytest.approx(0.0)
