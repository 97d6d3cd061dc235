"""First passage and expected bumps, against values worked by hand."""

import numpy as np
import pytest

from caregiver_mj.danger.chain import ChildChain, discounted_entry, expected_hits, first_entry, first_passage, presence
from caregiver_mj.danger.child_model import child_chain
from caregiver_mj.plans.floor_plan import FloorPlan


@pytest.fixture
def corridor():
    """Two cells, a goal west of them and an object east of them; epsilon 0 or 1; moves west and east."""
    greedy = np.zeros((2, 1, 2))
    greedy[..., 0] = 1.0
    next_cell = np.array([[0, 1], [0, 1]])
    ends, object_at = np.array([[[True], [False]], [[False], [False]]]), np.array([[-1, -1], [-1, 0]])
    return ChildChain(greedy, np.array([0.0, 1.0]), next_cell, ends, object_at, 1)


def test_first_passage(corridor):
    # At random from the east cell: 1/2 at once; or west (1/2), then east and east; from the west cell east and east.
    assert first_passage(corridor, 1)[:, 0] == pytest.approx([0, 0, 0, 0.5])
    assert first_passage(corridor, 2)[:, 0] == pytest.approx([0, 0.25, 0, 0.5])
    assert first_passage(corridor, 3)[:, 0] == pytest.approx([0, 0.375, 0, 0.5 + 0.5 * 0.25])
    assert first_passage(corridor, 1000)[:, 0] == pytest.approx([0, 1, 0, 1])  # sooner or later


def test_a_bump_that_ends_a_goal_is_followed_by_another_goal():
    # One cell between two objects, each of which is a goal of a child that makes no random move: it bumps into its own
    # every time, and then has each as often. So it is sure to meet its own, and the other by 1 - 1/2 ^ (n - 1).
    greedy, ends = np.eye(2)[None], np.eye(2, dtype=bool)[None]
    chain = ChildChain(greedy, np.zeros(1), np.zeros((1, 2), int), ends, np.array([[0, 1]]), 2)
    for moves, other in ((1, 0.0), (2, 0.5), (3, 0.75), (15, 1 - 2.0**-14)):
        assert first_passage(chain, moves) == pytest.approx(np.array([[1.0, other], [other, 1.0]]))


@pytest.mark.parametrize("house", ["paper", "house-17"])
def test_what_happens_within_a_time_happens_within_a_longer_one(house):
    chain = child_chain(FloorPlan.load(house))
    found = np.stack([first_passage(chain, moves) for moves in range(6)])
    assert (np.diff(found, axis=0) >= -1e-12).all()
    assert found.max() <= 1 + 1e-12


def test_first_entry(corridor):
    # Into the east cell, from the west one: never, or with 1/2; for a child that is there, too
    assert first_entry(corridor, (1,), 1)[:, 0] == pytest.approx([0, 0.5, 0, 0.5])
    assert first_entry(corridor, (1, 0), 2)[:, 1] == pytest.approx([1, 0.75, 1, 0.75])
    # West w = 1/2 + d w / 2 for a discount d, as a child that is in the cell already comes into it by staying.
    assert discounted_entry(corridor, (1,), 0.8)[:, 0] == pytest.approx([0, 0.5 / 0.6, 0, 0.5 / 0.6])


def test_expected_hits(corridor):
    # West w = d (w + e) / 2 and east e = 1/2 + d (w + e) / 2 for a discount d: e = w + 1/2, w = d / 4 / (1 - d).
    d = 0.8
    west = d / 4 / (1 - d)
    assert expected_hits(corridor, d)[:, 0] == pytest.approx([0, west, 0, west + 0.5])


def test_goals_are_drawn_anew():
    # One cell between two goals, and never a random move: it reaches its goal every time, and has each as often.
    greedy = np.eye(2)[None]
    chain = ChildChain(greedy, np.zeros(1), np.zeros((1, 2), int), np.eye(2, dtype=bool)[None], np.full((1, 2), -1), 0)
    assert chain.transition.toarray() == pytest.approx(0.5)


@pytest.fixture
def between():
    """Three cells between two objects, one goal that nobody reaches; moves west and east, all of them at random."""
    next_cell = np.array([[0, 1], [0, 2], [1, 2]])
    object_at = np.array([[0, -1], [-1, -1], [-1, 1]])
    greedy = np.full((3, 1, 2), 0.5)
    return ChildChain(greedy, np.ones(1), next_cell, np.zeros((3, 2, greedy.shape[1]), bool), object_at, 2)


def test_any_of_several_objects(between):
    either = np.array([[True], [True]])
    # In one move from an end; in two also from the middle, and else from an end: stay (1/2), or back and out (0).
    assert first_passage(between, 1, either)[:, 0] == pytest.approx([0.5, 0.0, 0.5])
    assert first_passage(between, 2, either)[:, 0] == pytest.approx([0.5, 0.5, 0.5])
    # From the west end in three: at once (1/2), or to the middle and (1/2) out of it at either side.
    assert first_passage(between, 3, either)[:, 0] == pytest.approx([0.75, 0.5, 0.75])


def test_presence_of_a_child_in_one_state_and_in_several(between):
    west = np.array([1.0, 0.0, 0.0])
    assert presence(between, west, 1) == pytest.approx([0.5, 0.5, 0.0])
    # In two moves: back at the west end unless it went east twice; in the middle unless it stayed twice.
    assert presence(between, west, 2) == pytest.approx([0.75, 0.75, 0.25])
    # In three: not in the west only after east, east and any; in the middle unless it stayed three times; at the east
    # end after stay, east, east, or east, east and any.
    assert presence(between, west, 3) == pytest.approx([0.75, 0.875, 0.375])
    now = np.array([0.5, 0.0, 0.5])
    each = [presence(between, state, 3) for state in np.eye(3)]
    assert presence(between, now, 3) == pytest.approx((each[0] + each[2]) / 2)
    # Nowhere in no moves.
    assert presence(between, np.array([0.0, 1.0, 0.0]), 0) == pytest.approx(0.0)
