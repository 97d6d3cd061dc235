"""Supervision by targets: an action is a hazard to protect from, and the caregiver executes it."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np

from caregiver_mj.caregivers.target_observation import Observations
from caregiver_mj.children.child_group import ChildrenLike
from caregiver_mj.envs.spaces import Seed, check_render_mode, episode_seed, observation_space, plain_seed
from caregiver_mj.envs.target_grid import FRAME_RATE, OVERVIEW, TargetGrid, check_world
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan


class TargetsEnv(gymnasium.Env):
    """Supervision by targets. Each step is a novice timestep, decided when the children's moves are clear.

    Action 0 protects from nothing: the caregiver keeps out of the way. The others are the hazards: stairwells, things
    to carry, then things on the floor. A hazard that the caregiver can do nothing about counts as 0; with a candle in
    the hand it puts that down first. `info["action_mask"]` has whether each action has an effect.

    The reward is minus the damage to the children since the last step, so the return of an episode is minus its
    `damage`. The first step includes the damage of the first moves, which nobody could prevent. `info` has `cost`,
    `diverged`, `seed`, `outcome` and `episode_score`, as in `HouseEnv`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": FRAME_RATE}  # noqa: RUF012 (Gymnasium's own manner)

    def __init__(self, world: Any, draw: Callable[[], np.ndarray] | None = None):
        """Make an environment of a `TargetGrid` or a `TargetHouse`.

        For rendering, `draw` returns an image, uint8 (height, width, 3).
        """
        self.world, self._draw = world, draw
        self.render_mode = "rgb_array" if draw else None
        self.observation_space = observation_space(world.encoder)
        self.action_space = gymnasium.spaces.Discrete(world.encoder.actions)
        self._runs = self._is_reset = False

    def reset(self, *, seed: Seed = None, options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begin the episode with a seed, as in the column `seed` of `evaluate`; without one it draws a seed.

        A `Generator` or a `RandomState` draws the seed.
        """
        asked = plain_seed(seed)
        super().reset(seed=asked)
        drawn = episode_seed(asked, self.np_random)
        self.world.begin([drawn])
        self._runs = self._is_reset = True
        observation, mask = self._look()
        return observation, {"seed": drawn, "action_mask": mask}

    def step(self, action: int) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        if not self._runs:
            raise gymnasium.error.ResetNeeded("call reset() before the first step and after the end of an episode")
        if np.ndim(action):
            raise CaregiverError(f"an action must be one integer, got {action!r}")
        self.world.act(np.array([action]))
        cost = {key: values[0].item() for key, values in self.world.cost().items()}
        observation, mask = self._look()
        info = {**cost, "diverged": self.world.diverged, "action_mask": mask}
        if self.world.ended:
            self._runs = False
            info |= {"outcome": self.world.outcome(), "episode_score": self.world.scores()[0].item()}
        return observation, 0.0 - cost["damage"], False, self.world.ended, info

    def render(self) -> np.ndarray | None:
        if self._draw and not self._is_reset:
            raise gymnasium.error.ResetNeeded("call reset() before the first picture")
        return self._draw() if self._draw else None

    def close(self) -> None:
        if self.world.dm_env:
            self.world.dm_env.close()

    def action_masks(self) -> np.ndarray:
        """Return whether each action has an effect now, bool (actions,); sb3-contrib's MaskablePPO calls this."""
        return self.world.encoder.mask(self.world.percept())[0].astype(bool)

    def _look(self) -> tuple[Observations, np.ndarray]:
        observations, mask = self.world.encoder.look(self.world.percept())
        if isinstance(observations, dict):
            return {key: np.asarray(values[0]) for key, values in observations.items()}, mask[0]
        return observations[0], mask[0]


def make_targets(
    world: str = "grid",
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: ChildrenLike | Sequence[ChildrenLike] = 0.5,
    *,
    task_kwargs: dict[str, Any] | None = None,
    render_mode: str | None = None,
    width: int = 640,
    height: int = 480,
    camera: str = OVERVIEW,
    **options: Any,
) -> TargetsEnv:
    """Make an environment whose actions are targets.

    Args:
        world: "grid", or "house", in which the robot executes the targets.
        house: A floor plan, its name in the package, or its path.
        epsilon: The children, as `load` takes them.
        task_kwargs: Further arguments of the task in the house, as `load` takes them.
        render_mode: "rgb_array" or None. An image of the grid is its floor plan with children and caregiver.
        width: Width of an image, in pixels.
        height: Height of an image, in pixels.
        camera: Camera of the images, in the house.
        options: `observation`, the kind of observation: "numbers", a dictionary; "flat", one array, in the order of
            that dictionary's keys; or "map" or "graph", a dictionary with a map or graph of the house. `slots`, the
            numbers of slots for stairwells, candles and, optionally, things on the floor, which give different houses
            the same shapes; None for the house's. `shape`, rows and columns of a map, or of the nodes of a graph; None
            for the house's.

    Raises:
        CaregiverError: The world, observation, render mode, slots or shape are invalid; or as of `load`.
    """
    check_world(world)
    check_render_mode(render_mode)
    if world == "grid":
        grid = TargetGrid(house, epsilon, task_kwargs, camera, **options)
        return TargetsEnv(grid, grid.painter(width, height) if render_mode else None)
    from caregiver_mj.envs.house import TargetHouse, picture  # imports MuJoCo, which the grid does not need

    made = TargetHouse(house, epsilon, task_kwargs, render_mode is not None, **options)
    if render_mode is None:
        return TargetsEnv(made)
    physics = made.dm_env.physics
    return TargetsEnv(made, functools.partial(physics.render, **picture(physics, width, height, camera)))
