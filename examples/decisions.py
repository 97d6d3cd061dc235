"""What makes a task in the house easier to learn: few decisions, about the base alone."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np


class Drive(gymnasium.Wrapper):
    """An action is the base's velocity, -1 to 1 a component; arm and gripper stay as the episode begins.

    It takes an environment of the house whose observations are dictionaries.
    """

    def __init__(self, env: gymnasium.Env):
        super().__init__(env)
        self._layout, self._whole = env.unwrapped.dm_env.task.embodiment.layout, env.action_space
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(self, **options: Any):
        observation, info = self.env.reset(**options)
        self._still = np.zeros(self._layout.size)
        self._still[self._layout.arm] = observation["arm_position"]
        self._still[self._layout.gripper] = observation["finger_position"].mean()
        return observation, info

    def step(self, action: np.ndarray):
        whole, base = self._still.copy(), self._layout.base
        whole[base] = np.clip(action, -1.0, 1.0) * self._whole.high[base]
        return self.env.step(np.clip(whole, self._whole.low, self._whole.high).astype(np.float32))


class Repeat(gymnasium.Wrapper):
    """Does every action so many times over; the reward of a decision is the mean of theirs, its cost their sum."""

    def __init__(self, env: gymnasium.Env, times: int):
        super().__init__(env)
        self._times = times

    def step(self, action: Any):
        rewards, costs, ended = [], [], False
        while len(rewards) < self._times and not ended:
            observation, reward, terminated, truncated, info = self.env.step(action)
            rewards.append(float(reward))
            costs.append(info["cost"])
            ended = terminated or truncated
        return observation, float(np.mean(rewards)), terminated, truncated, {**info, "cost": float(np.sum(costs))}
