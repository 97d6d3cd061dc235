"""The novice and the experts: who moves where, how often, and from which draws."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.expert import expert_trajectories
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, Tape, pick, start_cells
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

NORTH, EAST, SOUTH, WEST = range(4)

# Two shortest ways from the upper left to the bin in the lower right: south first or east first.
SQUARE = FloorPlan.parse("#####\n#..B#\n#...#\n#B.B#\n#####")


def draws(*rows):
    return np.array(rows, float)


def see(cell, goal):
    """What children see who are alone."""
    cell = np.asarray(cell)
    return Sight(cell, np.asarray(goal), np.full(len(cell), NOTHING), np.zeros(len(cell), bool))


@pytest.mark.parametrize("epsilon", [-0.01, 1.01, float("nan"), float("inf")])
def test_epsilon_outside_its_range_is_refused(epsilon):
    with pytest.raises(CaregiverError, match=r"epsilon must lie in \[0, 1\], not"):
        Novice(SQUARE, epsilon)


def test_a_draw_below_epsilon_makes_a_random_move_in_the_order_of_the_actions():
    novice = Novice(SQUARE, 0.3)
    cell, goal = np.zeros(4, int), np.zeros(4, int)
    which = [0.1, 0.3, 0.6, 0.9]
    actions = novice.act(see(cell, goal), draws(*[(0.29, w) for w in which]))
    assert actions.tolist() == [NORTH, EAST, SOUTH, WEST]


def test_a_draw_of_epsilon_or_more_makes_a_shortest_move():
    # To bin (1, 3) from (1, 1): east, east. To (3, 1): south, south. Bins in reading order.
    novice = Novice(SQUARE, 0.3)
    cell, goal = np.array([0, 0, 0]), np.array([0, 1, 0])
    assert novice.act(see(cell, goal), draws((0.3, 0.1), (0.9, 0.1), (0.3, 0.999))).tolist() == [EAST, SOUTH, EAST]


def test_equally_short_moves_are_drawn_equally_often():
    novice = Novice(SQUARE, 0.0)
    cell, goal = np.zeros(4, int), np.full(4, 2)  # from (1, 1) to (3, 3): east or south
    assert novice.act(see(cell, goal), draws((0, 0.0), (0, 0.49), (0, 0.5), (0, 0.99))).tolist() == [
        EAST,
        EAST,
        SOUTH,
        SOUTH,
    ]


def test_epsilon_1_is_uniform_and_epsilon_0_never_random():
    random = np.random.default_rng(0)
    many = 40_000
    cell, goal = np.zeros(many, int), np.zeros(many, int)
    share = np.bincount(Novice(SQUARE, 1.0).act(see(cell, goal), random.random((many, 2))), minlength=4) / many
    np.testing.assert_allclose(share, 0.25, atol=4 * np.sqrt(0.25 * 0.75 / many))
    assert set(Novice(SQUARE, 0.0).act(see(cell, goal), random.random((many, 2)))) == {EAST}


def test_the_share_of_shortest_moves_is_one_minus_epsilon_plus_a_quarter_of_it():
    random = np.random.default_rng(1)
    many = 40_000
    actions = Novice(SQUARE, 0.6).act(see(np.zeros(many, int), np.zeros(many, int)), random.random((many, 2)))
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
        action = novice.act(see(cell, goal), random.random((5, 3)))
        reached = (target[cell, action] == Target.BIN) & (index[cell, action] == goal)
        assert (reached | (target[cell, action] == Target.FREE) | (arrival > 0)).all()
        arrival[reached & (arrival == 0)] = timestep
        cell = next_cell[cell, action]
    assert arrival.tolist() == plan.graph.bump_distances(plan.bins)[start, goal].tolist()


def test_starts_and_bins_are_uniform():
    novice = Novice(SQUARE, 0.5)
    grid = (np.arange(600) + 0.5) / 600
    child, _ = start_cells(6, 0, np.stack([grid, grid, grid], axis=1)[:, None])
    assert np.bincount(child[:, 0]).tolist() == [100] * 6
    assert np.bincount(novice.next_bin(grid)).tolist() == [200] * 3


def test_the_probabilities_of_its_moves_by_hand():
    # In the upper left: to bin (1, 3) east, to (3, 1) south, to (3, 3) either. A quarter of 0.4 for each, and 0.6.
    probability = Novice(SQUARE, 0.4).action_probabilities()
    np.testing.assert_allclose(
        probability[0], [[0.1, 0.7, 0.1, 0.1], [0.1, 0.1, 0.7, 0.1], [0.1, 0.4, 0.4, 0.1]], atol=1e-12
    )
    np.testing.assert_allclose(probability.sum(axis=-1), 1.0)


@given(st.integers(1, 10_000))
def test_the_largest_draw_picks_the_last(count):
    assert pick(np.array([0.0, np.nextafter(1.0, 0.0)]), count).tolist() == [0, count - 1]


# -- The tape ------------------------------------------------------------------------------------


def test_a_tape_is_determined_by_its_seed():
    one, same, other = (Tape.draw(np.random.RandomState(seed)) for seed in (5, 5, 6))
    assert one.start.shape == (3,)
    assert one.steps.shape == (EPISODE_TIMESTEPS, 3)
    assert (one.steps == same.steps).all()
    assert (one.start == same.start).all()
    assert one.caregiver_seed == same.caregiver_seed != other.caregiver_seed
    assert not (one.steps == other.steps).any()


def test_a_longer_tape_begins_like_a_shorter_one():
    short, long = (Tape.draw(np.random.RandomState(5), timesteps) for timesteps in (10, 20))
    assert (short.start == long.start).all()
    assert (short.steps == long.steps[:10]).all()


# -- The experts ---------------------------------------------------------------------------------


@settings(max_examples=15, deadline=None)
@given(plan_texts(largest=12), st.integers(1, 300), st.integers(0, 2**31 - 1))
def test_experts_walk_shortest_collision_free_routes_for_so_many_timesteps(text, timesteps, seed):
    plan = FloorPlan.parse(text)
    next_cell, target, index = plan.graph.moves
    distance = plan.graph.bump_distances(plan.bins)
    trajectories = expert_trajectories(plan, np.random.default_rng(seed), timesteps)
    assert sum(len(t) for t in trajectories) == timesteps
    for number, trajectory in enumerate(trajectories):
        for (cell, action), (after, _) in itertools.pairwise(trajectory):
            assert target[cell, action] == Target.FREE
            assert next_cell[cell, action] == after
        cell, action = trajectory[-1]
        if target[cell, action] == Target.BIN:
            assert len(trajectory) == distance[trajectory[0][0], index[cell, action]]
        else:
            assert number == len(trajectories) - 1  # only the last one is cut off
            assert target[cell, action] == Target.FREE


def test_experts_depend_on_their_generator_only():
    first, again, other = (expert_trajectories(SQUARE, np.random.default_rng(seed), 50) for seed in (3, 3, 4))
    assert first == again != other


def test_experts_need_a_timestep():
    with pytest.raises(CaregiverError, match="at least 1 timestep, not 0"):
        expert_trajectories(SQUARE, np.random.default_rng(0), 0)


def test_actions_are_the_four_directions():
    assert ACTIONS == ((-1, 0), (0, 1), (1, 0), (0, -1))
