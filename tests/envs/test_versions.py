"""What an environment's version promises. A test fails here? Register a `-v1` beside the `-v0`, and pin that as well.

Numbers are written out: those who have learned in a `-v0` must find the same one tomorrow.
"""

import gymnasium
import numpy as np
import pytest
from small import PLAN, TARGETS

from caregiver_mj.envs.recipe import house_of

# Seconds of an episode, and of a step.
HOUSE = {
    "caregiver_mj/Supervise-v0": (336.0, 0.02),
    "caregiver_mj/RelocateCandle-v0": (60.0, 0.02),
    "caregiver_mj/BlockStairs-v0": (60.0, 0.02),
    TARGETS: (336.0, 0.02),
}
ACTIONS = [0] * 30 + [1] * 15 + [2] * 15  # leave all as it is; block the stairwell; relocate the candle
REWARDS = {14: -5, 15: -5, 17: -5, 18: -5, 19: -5, 40: -1, 42: -4, 58: -1}  # of seed 7, by step; all others are 0


def test_every_environment_has_its_version_pinned():
    ours = {name for name in gymnasium.registry if name.startswith("caregiver_mj/")}
    assert ours == {*HOUSE}
    assert all(gymnasium.spec(name).max_episode_steps is None for name in ours)  # the horizon is their own


@pytest.mark.parametrize("name", HOUSE)
def test_horizon_and_timestep_in_the_house(name):
    env = house_of(gymnasium.make(name, **({"world": "house"} if name == TARGETS else {})).unwrapped)
    assert (env.task.time_limit, env.control_timestep()) == pytest.approx(HOUSE[name])


def test_rewards_of_targets():
    env = gymnasium.make(TARGETS, world="grid", house=PLAN, epsilon=1.0)
    env.reset(seed=7)
    rewards = [env.step(action)[1] for action in ACTIONS]
    assert {i: reward for i, reward in enumerate(rewards) if reward} == REWARDS
    several = gymnasium.make_vec(TARGETS, num_envs=2, house=PLAN, epsilon=1.0)
    several.reset(seed=[7, 7])
    found = np.array([several.step(np.full(2, action))[1] for action in ACTIONS])
    np.testing.assert_array_equal(found, np.repeat(rewards, 2).reshape(-1, 2))
