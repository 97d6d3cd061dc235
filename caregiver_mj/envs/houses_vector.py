"""Targets in the grid of many houses: a vector environment for policies that generalise over houses."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from caregiver_mj.caregivers.target_observation import Observations, places_needed
from caregiver_mj.children.behaviour import Behaviour
from caregiver_mj.children.child_group import ChildGroup, ChildrenLike, ChildSpec, side_by_side
from caregiver_mj.envs.spaces import Seed, plain_seed
from caregiver_mj.envs.target_grid import MOST_EPISODES, GridTargetsVector
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.plans.floor_plan import FloorPlan

_AT_ONCE = 8  # default number of houses at once


class GridHousesVector(gymnasium.vector.VectorEnv):
    """`Supervise-Targets` in the grid, in several houses at once that change with every episode.

    See `GridTargetsVector`. Observations and actions of all houses have the same shapes, with enough slots for every
    house, or more by request. Episodes of one house are contiguous, and within it those of one family; `info["house"]`
    has the number of each episode's house.

    Attributes:
        plans: The houses.
        now: Numbers of the present houses, (at once,).
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (Gymnasium's own manner)

    def __init__(
        self,
        houses: Sequence[str | os.PathLike[str] | FloorPlan],
        num_envs: int = 256,
        at_once: int | None = None,
        families: Sequence[ChildrenLike] = (0.5,),
        **options: Any,
    ):
        """Make an environment.

        Args:
            houses: Floor plans, or their names, as `FloorPlan.load` takes them.
            num_envs: Episodes at once, 100,000 at most, equally many for each house and family.
            at_once: Number of different houses at once, drawn anew for every episode; None for 8, or all if fewer.
            families: Several child groups, as `ChildGroup.of` takes them, with equally many children.
            options: Further arguments of `GridTargetsVector`, except for rendering; `slots` and `shape` default to the
                needs of the houses.

        Raises:
            CaregiverError: `num_envs` is no multiple of houses and families, there are too few houses, or the families
                differ in size; or as of `make_targets`.
        """
        check_integer("num_envs", num_envs, 1, MOST_EPISODES)
        if isinstance(houses, (str, os.PathLike, FloorPlan)) or not isinstance(houses, Iterable):
            raise CaregiverError(f"houses must be several, such as house_set('train-100') has, got {houses!r}")
        self.plans = tuple(one if isinstance(one, FloorPlan) else FloorPlan.load(one) for one in houses)
        if isinstance(families, (str, ChildGroup, ChildSpec, Behaviour)) or not isinstance(families, Iterable):
            raise CaregiverError(f"families must be several, such as (0.5,) or ('1', '0.5'), got {families!r}")
        self._families = tuple(map(ChildGroup.of, families))
        if not self.plans:
            raise CaregiverError("houses must be at least 1, got none")
        at_once = min(_AT_ONCE, len(self.plans)) if at_once is None else at_once
        check_integer("at_once, how many of the houses the episodes are in,", at_once, 1, len(self.plans))
        shares = at_once * len(self._families)
        if not shares or num_envs % shares:
            raise CaregiverError(
                f"num_envs must be a multiple of {at_once} houses at once x {len(self._families)} families, "
                f"got {num_envs}"
            )
        if options.get("render_mode") is not None:
            raise CaregiverError(
                f"render_mode must be None, for there are several houses, got {options['render_mode']!r}"
            )
        shape = tuple(map(max, zip(*(plan.shape for plan in self.plans), strict=True)))
        given = {key: value for key, value in options.items() if value is not None}
        self._options = {"slots": places_needed(self.plans), "shape": shape} | given
        self.num_envs, self._each = num_envs, num_envs // at_once
        self._made: dict[int, GridTargetsVector] = {}
        self.now = np.arange(at_once)
        first = self._vector(0)
        self.single_observation_space = first.single_observation_space
        self.single_action_space = first.single_action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = False

    def reset(self, *, seed: Seed = None, options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begin episodes in random houses, with seeds from `seed` on, or with random seeds.

        After a reset with a seed, all later draws depend on it alone.

        Raises:
            CaregiverError: The options reset only some of the episodes.
        """
        if options and not np.all(options.get("reset_mask", True)):
            raise CaregiverError("reset_mask must be left out: all episodes of the batch begin together")
        number = plain_seed(seed)
        super().reset(seed=number)
        self._ended = False
        at_once = len(self.now)
        self.now = self.np_random.choice(len(self.plans), at_once, replace=False)
        drawn = self.np_random.integers(2**32, size=self.num_envs)
        seeds = drawn if number is None else number + np.arange(self.num_envs)
        parts = np.split(seeds, at_once)
        found = [self._vector(int(i)).reset(seed=part.tolist()) for i, part in zip(self.now, parts, strict=True)]
        observations, infos = zip(*found, strict=True)
        return _joined(observations), self._join_infos(infos)

    def step(self, actions: np.ndarray) -> tuple[Observations, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        if self._ended:
            none = np.zeros(self.num_envs, bool)
            observations, info = self.reset()
            return observations, np.zeros(self.num_envs), none, none.copy(), info
        if np.shape(actions) != (self.num_envs,):
            raise CaregiverError(f"actions must be {self.num_envs} integers, one for each episode, got {actions!r}")
        parts = np.split(np.asarray(actions), len(self.now))
        found = [self._vector(int(i)).step(part) for i, part in zip(self.now, parts, strict=True)]
        observations, *numbers, infos = zip(*found, strict=True)
        rewards, terminated, truncated = map(np.concatenate, numbers)
        self._ended = bool(truncated.all())
        return _joined(observations), rewards, terminated, truncated, self._join_infos(infos)

    def _vector(self, house: int) -> GridTargetsVector:
        if house not in self._made:
            plan = self.plans[house]
            children = side_by_side(plan, self._families, self._each // len(self._families))
            self._made[house] = GridTargetsVector(self._each, house=plan, epsilon=children, **self._options)
        return self._made[house]

    def _join_infos(self, infos: Sequence[dict[str, Any]]) -> dict[str, Any]:
        """Return the joined infos of the houses, with the number of each episode's house."""
        of_all = {"house": np.repeat(self.now, self._each), "_house": np.ones(self.num_envs, bool)}
        return _joined(infos) | of_all


def _joined(parts: Sequence[Any]) -> Any:
    """Join arrays, or dictionaries of arrays, of several houses."""
    if not isinstance(parts[0], dict):
        return np.concatenate(parts)
    return {key: _joined([part[key] for part in parts]) for key in parts[0]}
