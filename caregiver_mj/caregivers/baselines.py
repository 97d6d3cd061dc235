"""Caregivers to compare with: they know no danger."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, first_of_greatest
from caregiver_mj.caregivers.followers import Followers
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, pick
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


class RandomCaregiver(Caregiver):
    """Draws, in every novice timestep, one of the hazards that are worth protecting the children from.

    It draws once a timestep and not once an action, or it would turn round before it gets anywhere.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        seeds = [0] * batch if seeds is None else seeds
        length = EPISODE_TIMESTEPS + 1
        self._draws = np.stack([np.random.default_rng((self.seed, int(s))).random(length) for s in seeds], axis=1)
        self._timestep = 0

    def watch(self, percept: Percept) -> None:
        self._timestep = (self._timestep + 1) % len(self._draws)

    def choose(self, percept: Percept) -> np.ndarray:
        worth = self.worth_protecting(percept)
        count = worth.sum(axis=1)
        chosen = pick(self._draws[self._timestep], count)
        target, _ = first_of_greatest(worth & (worth.cumsum(axis=1) == chosen[:, None] + 1))
        return np.where(count > 0, target, NOTHING)


class NearestCaregiver(Caregiver):
    """Protects from what is nearest to a child, whatever the damage."""

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.followers = Followers(self.plan, batch, children)

    def watch(self, percept: Percept) -> None:
        if self.followers:
            self.followers.watch(percept)

    def choose(self, percept: Percept) -> np.ndarray:
        distance = self.hazard_distances(percept).min(axis=1)
        target, nearness = first_of_greatest(np.where(self.worth_protecting(percept), 1.0 / distance, 0.0))
        return np.where(nearness > 0, target, NOTHING)


class GuardCaregiver(Caregiver):
    """Goes to the stairwell that is nearest to itself at the start, and stays there."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        landings = [plan.cell_index[cell] for cell in plan.stairwells]
        self._walk = plan.graph.distances_from(landings).T  # (caregiver cells, stairwells)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._post = np.full(batch, NOTHING)

    def choose(self, percept: Percept) -> np.ndarray:
        if self.plan.stairwells:
            nearest = self.plan.hazards.of_stairwell(self._walk[percept.caregiver_cell].argmin(axis=1))
            self._post = np.where(self._post == NOTHING, nearest, self._post)
        return self._post
