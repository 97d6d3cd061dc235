"""Episodes for a data set, run step by step."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
import pathlib
from typing import Any, BinaryIO

import mujoco
import numpy as np
from dm_control.mujoco import engine

from caregiver_mj.envs.house import HouseEnv
from caregiver_mj.envs.recipe import Recipe, house_of, prepared
from caregiver_mj.envs.targets import TargetsEnv
from caregiver_mj.recording.steps import Steps, frames_file, new_episode


def collect(recipe: Recipe, store: pathlib.Path, which: tuple[int, int]) -> None:
    """Runs an episode and puts it into a store.

    Args:
        recipe: What is recorded.
        store: Folder of a `Store`.
        which: Number and seed of the episode.
    """
    number, seed = which
    env, actor = prepared(recipe)
    with new_episode(store, number) as folder, _Cameras(env, recipe, folder) as cameras:
        observation, _ = env.reset(seed=seed)
        actor.begin(seed)
        observations, rows = [observation], []
        cameras.look()
        terminated = truncated = False
        info: dict[str, Any] = {}
        while not (terminated or truncated):
            action = actor.act()
            observation, reward, terminated, truncated, info = env.step(action)
            observations.append(observation)
            rows.append((action, reward, info["cost"], info["damage"], info["strikes"], actor.intervention))
            cameras.look()
        actions, rewards, costs, damage, strikes, interventions = map(np.array, zip(*rows, strict=True))
        Steps(
            number=number,
            seed=seed,
            observations={key: np.array([seen[key] for seen in observations]) for key in observation},
            actions=actions.astype(env.action_space.dtype),
            rewards=rewards,
            costs=costs,
            damage=damage,
            strikes=strikes,
            interventions=interventions,
            terminated=terminated,
            diverged=info["diverged"],
            outcome=info["outcome"],
            frames=cameras.frames(),
        ).save(folder)


class _Cameras:
    """Cameras on an episode, whose pictures go to disk at once, for they are many. They see no shadows."""

    def __init__(self, env: HouseEnv | TargetsEnv, recipe: Recipe, folder: pathlib.Path):
        self._count, (self._width, self._height), self._folder = 0, recipe.size, folder
        self._cameras: dict[str, engine.Camera] = {}
        self._files: dict[str, BinaryIO] = {}
        if recipe.cameras:
            physics = house_of(env).physics
            for name in recipe.cameras:
                camera = engine.Camera(physics, height=self._height, width=self._width, camera_id=name)
                camera.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # which take four fifths of the time
                self._cameras[name] = camera

    def __enter__(self) -> _Cameras:
        for name in self._cameras:
            self._files[name] = open(frames_file(self._folder, name), "wb")
        return self

    def __exit__(self, *error: Any) -> None:
        for file in self._files.values():
            file.close()

    def look(self) -> None:
        """Takes a picture with each."""
        for name, file in self._files.items():
            file.write(np.ascontiguousarray(self._cameras[name].render()).tobytes())
        self._count += 1

    def frames(self) -> dict[str, np.ndarray]:
        """All pictures so far, (n + 1, height, width, 3) each."""
        for file in self._files.values():
            file.flush()
        shape = self._count, self._height, self._width, 3
        return {name: np.memmap(frames_file(self._folder, name), np.uint8, "r", shape=shape) for name in self._files}
