"""Stable-Baselines3 takes no vector environment of Gymnasium's: this makes one of its own of it."""

from __future__ import annotations

from typing import Any

import needs_learn  # noqa: F401 (says so if it is missing)

# isort: split
import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv


class FromGymnasium(VecEnv):
    """A `VecEnv` of a `VectorEnv` whose episodes end together and whose `info` has an `action_mask`."""

    def __init__(self, env: gymnasium.vector.VectorEnv):
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self):
        (seed, *_), self._seeds = self._seeds, [None] * self.num_envs  # what `seed` has kept for this
        observations, info = self.env.reset(seed=seed)
        self._masks = info["action_mask"]
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self):
        observations, rewards, _, ended, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if ended.all():  # this kind of vector is to begin anew in the same step
            for i, one in enumerate(infos):
                last = {key: values[i] for key, values in observations.items()}
                one |= {"terminal_observation": last, "TimeLimit.truncated": True}
                one |= {"damage": info["outcome"]["damage"][i], "house": info["house"][i]}
            observations, info = self.env.reset()
        self._masks = info["action_mask"]
        return observations, rewards.astype(np.float32), ended, infos

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        if method_name != "action_masks":
            raise AttributeError(f"a batch of episodes has no method '{method_name}'")
        return list(self._masks.astype(bool))

    def has_attr(self, attr_name: str) -> bool:
        return attr_name == "action_masks"

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.env, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(f"'{attr_name}' of a batch of episodes cannot be set")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs

    def close(self) -> None:
        self.env.close()
