"""First passage and expected bumps, against values worked by hand."""

import numpy as np
import pytest

from caregiver_mj.danger.chain import ChildChain, discounted_entry, expected_hits, first_entry, first_passage


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
