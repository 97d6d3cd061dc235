"""Seeds: episode i is the same whoever runs it."""

import numpy as np
import pytest

import caregiver_mj.tasks
from caregiver_mj.experiments.settings import episode_random, episode_seed, episode_tapes
from caregiver_mj.plans.floor_plan import FloorPlan

PLAN = FloorPlan.parse("########\n#B....C#\n#....T.#\n#.S....#\n#....TB#\n########", "small")


def test_seeds_depend_on_the_run_and_the_episode():
    seeds = {episode_seed(seed, episode) for seed in range(20) for episode in range(20)}
    assert len(seeds) == 400
    assert episode_seed(3, 1) == episode_seed(3, 1)


def test_seeds_are_those_of_all_former_runs():
    assert [episode_seed(0, i) for i in range(3)] == [2968811710, 3964924996, 3141116543]


@pytest.mark.parametrize("children", [1, 3])
def test_the_house_draws_the_children_of_the_grid(children):
    seed = episode_seed(5, 2)
    env = caregiver_mj.tasks.load("supervise", PLAN, ",".join(["1"] * children), task_kwargs={"robot": False})
    env.task.reseed(episode_random(seed))
    step = env.reset()
    tapes = episode_tapes(seed, children)
    assert env.task.caregiver_seed == tapes[0].caregiver_seed
    positions = step.observation["toddler_position"].reshape(children, 3)
    first = int(tapes[0].start[0] * len(PLAN.free_cells))
    np.testing.assert_allclose(positions[0, :2], PLAN.position(PLAN.free_cells[first]))
    assert len(np.unique(positions[:, :2], axis=0)) == children
