"""Children that change in mid-episode: their epsilon, or the bins that they want."""

import numpy as np
import pytest
from worlds import streams

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.variants import SWITCH, Drifter, Waverer
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

PLAN = FloorPlan.load("paper")
SIGHT = ChildPercept(np.zeros(2, int), np.zeros(2, int), np.full(2, NOTHING), np.zeros(2, bool))


def course(child, timesteps, third=0.0):
    """The epsilons before each of so many moves, (timesteps, 2)."""
    child.reset(2)
    found = []
    for timestep in range(timesteps):
        found.append(child.epsilons(2))
        draw = third[timestep] if np.ndim(third) else third
        child.act(SIGHT, np.array([[0.5, 0.5, draw], [0.5, 0.5, 0.0]]))
    return np.array(found)


@pytest.mark.parametrize(("epsilon", "low", "high"), [(0.4, 0.05, 0.75), (0.1, 0.0, 0.2), (0.9, 0.8, 1.0), (1.0, 1, 1)])
def test_the_drifter_goes_evenly_from_one_end_to_the_other(epsilon, low, high):
    found = course(Drifter(PLAN, epsilon), 250)
    assert found[0] == pytest.approx(low)
    assert found[199:] == pytest.approx(high)
    assert np.diff(found[:200], axis=0) == pytest.approx((high - low) / 199)
    assert found[:200].mean() == pytest.approx(epsilon)


def test_the_waverer_walks_by_its_own_draws_and_turns_at_the_ends():
    # The fraction of 2^20 draws: 0 is up, 0.75 is down.
    down = 0.75 / 2**20
    found = course(Waverer(PLAN, 0.05), 4, [down, down, 0.0, 0.0])
    assert found[:, 0] == pytest.approx([0.05, 0.02, 0.01, 0.04])
    assert found[:, 1] == pytest.approx([0.05, 0.08, 0.11, 0.14])
    assert course(Waverer(PLAN, 0.98), 3)[:, 0] == pytest.approx([0.98, 0.99, 0.98])


def test_the_switcher_wants_one_half_of_the_bins_and_then_the_other():
    world = GridWorld(PLAN, "switcher:0.25", None)
    goals = []
    families = streams(20)
    world.reset(families)
    for _ in range(200):
        goals.append(world.goal.copy())
        world.step()
    half = (len(PLAN.bins) + 1) // 2
    before, after = np.array(goals[:SWITCH]), np.array(goals[SWITCH + 1 :])
    assert set(np.unique(before)) == set(range(half))
    assert set(np.unique(after)) == set(range(half, len(PLAN.bins)))
