"""Targets in many houses at once."""

import numpy as np
import pytest
from small import OTHER, PLAN

from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.target_grid import GridTargetsVector
from caregiver_mj.plans.floor_plan import FloorPlan

THIRD = FloorPlan.parse("######\n#..SB#\n#....#\n######", "third")
PLANS = (PLAN, OTHER, THIRD)


@pytest.mark.parametrize("observation", ["flat", "map"])
def test_it_is_the_houses_side_by_side(observation):
    families = (1.0, 0.25)
    vector = GridHousesVector(PLANS, 8, 2, families, observation=observation)
    observations, info = vector.reset(seed=3)
    groups, shapes = [*map(ChildGroup.of, families)], {"slots": (2, 2), "shape": (5, 8)}
    alone = [
        GridTargetsVector(4, house=plan, epsilon=side_by_side(plan, groups, 2), observation=observation, **shapes)
        for plan in map(PLANS.__getitem__, vector.now)
    ]
    assert vector.observation_space.contains(observations)
    assert info["seed"].tolist() == list(range(3, 11))
    assert info["house"].tolist() == np.repeat(vector.now, 4).tolist()
    [each.reset(seed=3 + 4 * i) for i, each in enumerate(alone)]
    random = np.random.RandomState(0)
    for step in range(1, 201):
        actions = (random.random_sample(info["action_mask"].shape) * info["action_mask"]).argmax(axis=1)
        observations, rewards, terminated, truncated, info = vector.step(actions)
        parts = [each.step(part) for each, part in zip(alone, np.split(actions, 2), strict=True)]
        np.testing.assert_array_equal(rewards, np.concatenate([part[1] for part in parts]))
        np.testing.assert_array_equal(info["action_mask"], np.concatenate([part[-1]["action_mask"] for part in parts]))
        assert truncated.all() == (step == 200)
        assert not terminated.any()
    for key in ("map", "clock") if observation == "map" else ():
        np.testing.assert_array_equal(observations[key], np.concatenate([part[0][key] for part in parts]))
    wanted = np.concatenate([part[-1]["outcome"]["damage"] for part in parts])
    np.testing.assert_array_equal(info["outcome"]["damage"], wanted)
    assert wanted.any()


def test_every_episode_is_in_houses_that_are_drawn_by_the_seed():
    seen = []
    for _ in range(2):
        vector = GridHousesVector(PLANS, 2, 2)
        vector.reset(seed=0)
        been = []
        for _ in range(6):
            _, info = vector.reset()
            been.append((*vector.now.tolist(), *info["seed"].tolist()))
        seen.append(been)
    assert seen[0] == seen[1]
    assert len({each[:2] for each in seen[0]}) > 1
    assert all(each[0] != each[1] for each in seen[0])
