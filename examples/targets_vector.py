"""The grid of many houses as Stable-Baselines3 takes it, with what was to be seen a little earlier beside it."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import batch_space

EARLIER = 3  # timesteps that are remembered


class Remembering(gymnasium.vector.VectorWrapper):
    """Adds to each observation how near the child was to each hazard at the last timesteps: `before`, (B, 3, hazards).

    For one child. All episodes of the batch must begin together.
    """

    def __init__(self, env: gymnasium.vector.VectorEnv):
        super().__init__(env)
        hazards = env.single_observation_space["holding"].shape[0]
        before = spaces.Box(0, 1, (EARLIER, hazards), np.float32)
        self.single_observation_space = spaces.Dict({**env.single_observation_space, "before": before})
        self.observation_space = batch_space(self.single_observation_space, env.num_envs)

    def reset(self, **options: Any):
        observation, info = self.env.reset(**options)
        return self._begun(observation), info

    def step(self, actions: np.ndarray):
        observation, *rest, info = self.env.step(actions)
        if "seed" in info:  # it was the step that begins new episodes
            return self._begun(observation), *rest, info
        return self._remembered(observation), *rest, info

    def _begun(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        self._seen = [observation["hazard_nearness_to_child"][:, 0]] * EARLIER
        return self._remembered(observation)

    def _remembered(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        before = np.stack(self._seen, axis=1)
        self._seen = [*self._seen[1:], observation["hazard_nearness_to_child"][:, 0]]
        return {**observation, "before": before}
