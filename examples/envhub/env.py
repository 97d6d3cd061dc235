"""Environments as LeRobot's EnvHub loads them, with observations as those of `caregiver-mj record --format lerobot`.

LeRobot's `make_env("OWNER/NAME", n_envs=2, trust_remote_code=True)` finds this file in a repository of its hub, and
needs the package `caregiver_mj[gym]` where it runs.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

import caregiver_mj
from caregiver_mj.registry import summary
from caregiver_mj.tasks import TASKS

gymnasium.register_envs(caregiver_mj)
REACHED = 0.99  # from this reward at the end on a goal is reached


class ForLeRobot(gymnasium.Wrapper):
    """A task in the house: `agent_pos` is `observation.state` of the data sets, `pixels` are `observation.images`."""

    def __init__(
        self, task: str, cameras: Sequence[str] = ("overview",), size: tuple[int, int] = (128, 96), **options: Any
    ):
        """Make a task's environment, with further options of it, and pictures of a size in pixels."""
        super().__init__(gymnasium.make(TASKS[task].id, observation="flat", render_mode="rgb_array", **options))
        env = self.env.unwrapped.dm_env
        env.physics.check_cameras(cameras)
        self._render, self._width, self._height = env.physics.render, *size
        self._cameras, self.task = cameras, task
        self.task_description = summary(type(env.task))
        self._max_episode_steps = int(env.task.length)
        picture = spaces.Box(0, 255, (self._height, self._width, 3), np.uint8)
        pixels = spaces.Dict(dict.fromkeys(cameras, picture))
        self.observation_space = spaces.Dict({"agent_pos": self.env.observation_space, "pixels": pixels})

    def reset(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        observation, info = self.env.reset(**options)
        return self._look(observation), info | {"is_success": False}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        success = False
        if "outcome" in info and not info["diverged"]:
            success = info["outcome"]["damage"] == 0 if self.task == "supervise" else reward >= REACHED
        return self._look(observation), reward, terminated, truncated, info | {"is_success": bool(success)}

    def _look(self, observation: np.ndarray) -> dict[str, Any]:
        unshadowed = {"shadow": False}  # as in the data sets
        size = {"width": self._width, "height": self._height}
        pixels = {
            name: self._render(camera_id=name, render_flag_overrides=unshadowed, **size) for name in self._cameras
        }
        return {"agent_pos": observation, "pixels": pixels}


def make_env(
    n_envs: int = 1, use_async_envs: bool = False, cfg: Any = None
) -> dict[str, dict[int, gymnasium.vector.VectorEnv]]:
    """Return vectors of environments by suite and number of the task: all tasks, or `cfg.task` alone.

    Of a `cfg` also `house`, `epsilon`, `cameras` and `size` count, if it has them.
    """
    given = {name: getattr(cfg, name, None) for name in ("house", "epsilon", "cameras", "size")}
    options = {name: value for name, value in given.items() if value is not None}
    names = [cfg.task] if getattr(cfg, "task", None) else [*TASKS]
    makers = [functools.partial(ForLeRobot, name, **options) for name in names]
    again = gymnasium.vector.AutoresetMode.SAME_STEP  # as LeRobot's own environments do
    if use_async_envs and n_envs > 1:  # in new processes, for OpenGL does not work in a copy of one that uses it
        kind = functools.partial(gymnasium.vector.AsyncVectorEnv, autoreset_mode=again, context="spawn")
    else:
        kind = functools.partial(gymnasium.vector.SyncVectorEnv, autoreset_mode=again)
    return {"caregiver_mj": {i: kind([make] * n_envs) for i, make in enumerate(makers)}}
