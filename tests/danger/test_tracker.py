"""The filter over where a child is, against enumeration, and against the filter of a child that is always seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan


def views(*cells):
    return np.isin(np.arange(3), cells)[None]


def one(value):
    return np.array([[value]])


def test_who_follows_the_caregiver_comes_the_shortest_way():
    plan = FloorPlan.parse("#####\n#..B#\n#.###\n#..S#\n#####", "bend")
    cell, follows = plan.cell_index, child_chain(plan).follows
    ways = follows(np.array([cell[1, 1], cell[2, 1]]), np.array([cell[1, 2], cell[1, 1]]))
    assert [ACTIONS[move] for move in ways.argmax(axis=1)] == [(0, -1), (1, 0)]
    assert ways.sum(axis=1).tolist() == [1.0, 1.0]


def test_in_a_corridor():
    """Three cells in a row, a goal at either end, of moves west and east; no move is random."""
    greedy = np.zeros((3, 2, 2))
    greedy[:, 0, 0] = greedy[:, 1, 1] = 1.0
    next_cell = np.array([[0, 1], [0, 2], [1, 2]])
    ends = np.array([[0, -1], [-1, -1], [-1, 1]])[..., None] == np.arange(2)
    tracker = Tracker(ChildChain(greedy, np.array([0.0]), next_cell, ends, np.full((3, 2), -1), 0))
    tracker.look(one(-1), views(0))  # not in the west
    assert tracker.presence[0, 0] == pytest.approx([0, 1 / 2, 1 / 2])
    # From the middle it goes west or east; in the east it reaches its goal and stays, or goes to the middle.
    tracker.move(one(-1), one(-1), one(-1), views())
    assert tracker.presence[0, 0] == pytest.approx([1 / 4, 1 / 4, 1 / 2])
    # It comes to the middle: so it was in the east, and wants to the west.
    tracker.look(one(1), views(1))
    assert tracker.presence[0, 0] == pytest.approx([0, 1, 0])
    assert tracker.goal[0, 0] == pytest.approx([1, 0])
    assert not tracker.surprised.any()
    # It cannot be in the east now, but there it is: nothing holds that was believed.
    tracker.move(one(1), one(0), one(-1), views(1))
    assert tracker.presence[0, 0] == pytest.approx([1, 0, 0])
    tracker.look(one(2), views(2))
    assert tracker.surprised.all()
    assert tracker.goal[0, 0] == pytest.approx([1 / 2, 1 / 2])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_it_is_exact(seed):
    """By forward filtering with dense matrices: what is seen of one child now and then."""
    random = np.random.default_rng(seed)
    plan = FloorPlan.parse("########\n#.....B#\n#.#C#..#\n#....T.#\n###S####\n########", "tiny")
    chain = child_chain(plan)
    cells, goals, epsilons = chain.shape
    tracker = Tracker(chain)
    dense, belief = chain.transition.toarray(), np.ravel(chain.prior / cells * np.ones((cells, 1, 1)))
    state = random.choice(chain.size, p=belief)
    for _ in range(12):
        in_view = random.random((1, cells)) < 0.3
        state = random.choice(chain.size, p=dense[state] / dense[state].sum())
        cell = state // (goals * epsilons)
        seen = in_view[0, cell]
        tracker.move(one(-1), one(-1), one(cell if seen else -1), in_view)
        belief = (belief @ dense).reshape(cells, -1)
        belief *= (np.arange(cells) == cell)[:, None] if seen else ~in_view[0][:, None]
        belief = belief.ravel() / belief.sum()
        assert tracker.joint[0, 0].ravel() == pytest.approx(belief, abs=1e-5)
        assert tracker.probability[0, 0].sum() == pytest.approx(1, abs=1e-5)


def test_of_a_child_that_is_always_seen_it_knows_what_a_belief_does():
    plan = FloorPlan.load("paper")
    chain, random = child_chain(plan), np.random.default_rng(0)
    belief, tracker = (kind(chain, 2, 2, CHANGE) for kind in (Belief, Tracker))
    cell = random.integers(chain.shape[0], size=(2, 2))
    in_view = np.ones((2, chain.shape[0]), bool)
    tracker.look(cell, in_view)
    for _ in range(30):
        move = random.integers(-1, 4, size=(2, 2))
        after = np.where(move < 0, cell, chain.next_cell[cell, move])
        belief.watch(cell, move)
        tracker.move(cell, move, after, in_view)
        cell = after
        assert tracker.probability == pytest.approx(belief.probability, abs=1e-6)
        assert (tracker.understood == belief.understood).all()
        assert (tracker.cell == cell).all()
