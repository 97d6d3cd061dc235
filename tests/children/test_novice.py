"""The novice: who moves where, how often, and from which draws."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj import FloorPlan
from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Expert, Novice, expert_trajectories
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.hazards import NOTHING

NORTH, EAST, SOUTH, WEST = range(4)

# Two shortest ways from the upper left to the bin in the lower right: south first or east first.
SQUARE = FloorPlan.parse("#####\n#..B#\n#...#\n#B.B#\n#####")


def draws(*rows):
    return np.array(rows, float)


def sight(cell, goal):
    cell, goal = np.asarray(cell), np.asarray(goal)
    return ChildPercept(cell, goal, np.full(cell.shape, NOTHING), np.zeros(cell.shape, bool))


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


def test_the_probabilities_of_its_moves_by_hand():
    # In the upper left: to bin (1, 3) east, to (3, 1) south, to (3, 3) either. A quarter of 0.4 for each, and 0.6.
    probability = Novice(SQUARE, 0.4).action_probabilities()
    wanted = [[0.1, 0.7, 0.1, 0.1], [0.1, 0.1, 0.7, 0.1], [0.1, 0.4, 0.4, 0.1]]
    np.testing.assert_allclose(probability[0], wanted, atol=1e-12)
    np.testing.assert_allclose(probability.sum(axis=-1), 1.0)
    expert, careful = (kind(SQUARE, epsilon).action_probabilities() for kind, epsilon in ((Expert, 1.0), (Novice, 0.0)))
    np.testing.assert_array_equal(expert, careful)


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
