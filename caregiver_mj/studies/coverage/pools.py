"""Populations to draw episodes from, whose true means are known: many real episodes of the grid world."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan

_BLOCK = 1000  # episodes at once
_CAREGIVERS = ("none", "paper")


@dataclasses.dataclass(frozen=True)
class Pool:
    """Pairs of episodes, the same child in both.

    Attributes:
        house: Name of the floor plan.
        epsilon: Share of the child's moves that are random.
        ours: Damage with the paper's caregiver, (episodes,).
        theirs: Damage without any, likewise.
    """

    house: str
    epsilon: float
    ours: np.ndarray
    theirs: np.ndarray

    @property
    def ratio(self) -> float:
        """The true damage left."""
        return float(self.ours.mean() / self.theirs.mean())

    @property
    def harmless(self) -> float:
        """Share of the pairs without damage in either."""
        return float(((self.ours == 0) & (self.theirs == 0)).mean())

    def draw(self, random: np.random.Generator, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Pairs at random: ours and theirs, of some shape."""
        drawn = random.integers(len(self.ours), size=shape)
        return self.ours[drawn], self.theirs[drawn]


def run_pool(plan: FloorPlan, epsilon: float, episodes: int, seed: int) -> Pool:
    """Runs so many pairs of episodes."""
    damage = []
    for name in _CAREGIVERS:
        blocks = [range(first, min(first + _BLOCK, episodes)) for first in range(0, episodes, _BLOCK)]
        runs = (
            run_episodes(plan, epsilon, make_caregiver(name, plan), [seed + i for i in block]).damage
            for block in blocks
        )
        damage.append(np.concatenate(list(runs)))
    return Pool(plan.name, epsilon, ours=damage[1], theirs=damage[0])
