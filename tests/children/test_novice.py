"""The novice: who moves where, how often, and from which draws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.novice import Expert, Novice
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

NORTH, EAST, SOUTH, WEST = range(4)

# Two shortest ways from the upper left to the bin in the lower right: south first or east first.
SQUARE = FloorPlan.parse("#####\n#..B#\n#...#\n#B.B#\n#####")


def draws(*rows):
    return np.array(rows, float)


def sight(cell, goal):
    cell, goal = np.asarray(cell), np.asarray(goal)
    return Sight(cell, goal, np.full(cell.shape, NOTHING), np.zeros(cell.shape, bool))


@pytest.mark.parametrize("epsilon", [-0.01, 1.01, float("nan"), float("inf")])
def test_epsilon_outside_its_range_is_refused(epsilon):
    with pytest.raises(CaregiverError, match=r"epsilon must be in \[0, 1\], got"):
        Novice(SQUARE, epsilon)


def test_a_draw_below_epsilon_makes_a_random_move_in_the_order_of_the_actions():
    novice = Novice(SQUARE, 0.3)
    cell, goal = np.zeros(4, int), np.zeros(4, int)
    which = [0.1, 0.3, 0.6, 0.9]
    actions = novice.act(sight(cell, goal), draws(*[(0.29, w) for w in which]))
    assert actions.tolist() == [NORTH, EAST, SOUTH, WEST]


def test_a_draw_of_epsilon_or_more_makes_a_shortest_move():
    # To bin (1, 3) from (1, 1): east, east. To (3, 1): south, south. Bins in reading order.
    novice = Novice(SQUARE, 0.3)
    cell, goal = np.array([0, 0, 0]), np.array([0, 1, 0])
    assert novice.act(sight(cell, goal), draws((0.3, 0.1), (0.9, 0.1), (0.3, 0.999))).tolist() == [EAST, SOUTH, EAST]


def test_equally_short_moves_are_drawn_equally_often():
    novice = Novice(SQUARE, 0.0)
    cell, goal = np.zeros(4, int), np.full(4, 2)  # from (1, 1) to (3, 3): east or south
    assert novice.act(sight(cell, goal), draws((0, 0.0), (0, 0.49), (0, 0.5), (0, 0.99))).tolist() == [
        EAST,
        EAST,
        SOUTH,
        SOUTH,
    ]


def test_epsilon_1_is_uniform_and_epsilon_0_never_random():
    random = np.random.default_rng(0)
    many = 40_000
    cell, goal = np.zeros(many, int), np.zeros(many, int)
    share = np.bincount(Novice(SQUARE, 1.0).act(sight(cell, goal), random.random((many, 2))), minlength=4) / many
    np.testing.assert_allclose(share, 0.25, atol=4 * np.sqrt(0.25 * 0.75 / many))
    assert set(Novice(SQUARE, 0.0).act(sight(cell, goal), random.random((many, 2)))) == {EAST}


def test_the_share_of_shortest_moves_is_one_minus_epsilon_plus_a_quarter_of_it():
    random = np.random.default_rng(1)
    many = 40_000
    actions = Novice(SQUARE, 0.6).act(sight(np.zeros(many, int), np.zeros(many, int)), random.random((many, 2)))
    # East is the one shortest move: 0.4 + 0.6 / 4 = 0.55.
    assert np.mean(actions == EAST) == pytest.approx(0.55, abs=4 * np.sqrt(0.55 * 0.45 / many))


@settings(max_examples=25, deadline=None)
@given(plan_texts(), st.integers(0, 2**31 - 1))
def test_without_chance_it_needs_the_bump_distance_to_its_bin(text, seed):
    plan = FloorPlan.parse(text)
    novice, random = Novice(plan, 0.0), np.random.default_rng(seed)
    next_cell, target, index = plan.graph.moves
    cell = start = random.integers(len(plan.free_cells), size=5)
    goal = random.integers(len(plan.bins), size=5)
    arrival = np.zeros(5, int)
    for timestep in range(1, len(plan.free_cells) + 2):
        action = novice.act(sight(cell, goal), random.random((5, 3)))
        reached = (target[cell, action] == Target.BIN) & (index[cell, action] == goal)
        assert (reached | (target[cell, action] == Target.FREE) | (arrival > 0)).all()
        arrival[reached & (arrival == 0)] = timestep
        cell = next_cell[cell, action]
    assert arrival.tolist() == plan.graph.bump_distances(plan.bins)[start, goal].tolist()


def test_bins_are_uniform():
    grid = (np.arange(600) + 0.5) / 600
    assert np.bincount(Novice(SQUARE, 0.5).next_bin(grid)).tolist() == [200] * 3


def test_an_expert_makes_no_random_move_whatever_its_epsilon():
    random = np.random.default_rng(0)
    expert = Expert(SQUARE, 1.0)
    assert expert.epsilon == 0.0
    assert set(expert.act(sight(np.zeros(100, int), np.zeros(100, int)), random.random((100, 3)))) == {EAST}


def test_actions_are_the_four_directions():
    assert ACTIONS == ((-1, 0), (0, 1), (1, 0), (0, -1))


def test_the_probabilities_of_its_moves_by_hand():
    # In the upper left: to bin (1, 3) east, to (3, 1) south, to (3, 3) either. A quarter of 0.4 for each, and 0.6.
    probability = Novice(SQUARE, 0.4).action_probabilities()
    np.testing.assert_allclose(
        probability[0], [[0.1, 0.7, 0.1, 0.1], [0.1, 0.1, 0.7, 0.1], [0.1, 0.4, 0.4, 0.1]], atol=1e-12
    )
    np.testing.assert_allclose(probability.sum(axis=-1), 1.0)
