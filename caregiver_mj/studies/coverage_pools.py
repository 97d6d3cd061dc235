"""Populations to draw episodes from, whose true means are known: many real episodes of the grid world."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.symbols import BIN, CANDLE, STAIRWELL, TABLE

EPSILONS = (1.0, 0.75, 0.5, 0.25, 0.05)

_BLOCK = 1000  # episodes at once
_CAREGIVERS = ("none", "paper")
# Written out, so that the study stays the same: houses as the generator makes them, with many hazards and with few.
_GENERATED = {
    "generated A": """
        ###############
        #S.....C...S..#
        #........#....#
        #.......T#....#
        #........#.T..#
        #..C.....#...C#
        #T.......#T...#
        #........#....#
        #B......B#.C.B#
        ###############
    """,
    "generated B": """
        #############
        #.......#B..#
        #...T...#..C#
        #......S#...#
        #...........#
        #.......#...#
        #.......#...#
        #.C.....#..T#
        #.......#...#
        #B..C...#B..#
        #############
    """,
}


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


def plans() -> tuple[FloorPlan, ...]:
    """Four houses."""
    written = ("\n".join(text.split()) for text in _GENERATED.values())
    generated = (FloorPlan.parse(text, name) for text, name in zip(written, _GENERATED, strict=True))
    return FloorPlan.load("paper"), FloorPlan.load("apartment"), *generated


def rearranged(count: int, seed: int) -> Iterator[FloorPlan]:
    """Many houses: those four in turn, with what stands in them in other places, each where something stood before."""
    random = np.random.default_rng(seed)
    for number in range(count):
        plan = plans()[number % len(plans())]
        rows = [list(row) for row in plan.rows]
        places = plan.cells_of(STAIRWELL, CANDLE, TABLE, BIN)
        symbols = random.permutation([rows[row][column] for row, column in places])
        for (row, column), symbol in zip(places, symbols, strict=True):
            rows[row][column] = str(symbol)
        yield FloorPlan.parse("\n".join(map("".join, rows)), f"{plan.name} {number}")


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
