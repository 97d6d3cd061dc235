"""The experts: shortest routes, for so many timesteps, by their generator alone."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.children.novice import expert_trajectories
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan

SQUARE = FloorPlan.parse("#####\n#..B#\n#...#\n#B.B#\n#####")


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
    with pytest.raises(CaregiverError, match="timesteps of experts must be at least 1, got 0"):
        expert_trajectories(SQUARE, np.random.default_rng(0), 0)
