"""Requests for generated houses, and their names."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from numbers import Integral
from typing import TypeVar

import numpy as np

from caregiver_mj.errors import FloorPlanError

SMALLEST, LARGEST = 5, 100  # rows or columns, outer walls included
SEEDS = 2**32
# Default contents: least and greatest numbers in a small and a large house, with areas within the outer walls of
# `_AREAS` cells. Other areas are interpolated.
_SIDES = (10, 18)  # rows or columns
_AREAS = (8 * 8, 16 * 16)
_USUAL = {
    "rooms": ((2, 4), (4, 6)),
    "stairwells": ((1, 2), (1, 4)),
    "candles": ((2, 3), (2, 6)),
    "tables": ((2, 3), (2, 6)),
    "bins": ((2, 3), (2, 5)),
}
_ROOMY, _THINGS = 16, 12  # cells; least area of a house for each room, and for each thing of a kind
_ADDED = ("gates", "mugs", "batteries")  # by default in homes only
_LEAST = {"rooms": 1, "stairwells": 0, "candles": 0, "tables": 0, "bins": 1} | dict.fromkeys(_ADDED, 0)
_FIELDS = (*_USUAL, *_ADDED)
_MOST_BATTERIES = 3  # in a home, which has at least one
Thing = TypeVar("Thing")


@dataclasses.dataclass(frozen=True)
class Request:
    """A request for a house. Fields that are None are drawn from the seed."""

    seed: int  # from 0, below `SEEDS`
    size: tuple[int, int] | None = None  # columns and rows, outer walls included
    rooms: int | None = None  # number of rooms, including a corridor
    stairwells: int | None = None
    candles: int | None = None
    tables: int | None = None
    bins: int | None = None
    gates: int | None = None
    mugs: int | None = None
    batteries: int | None = None
    home: bool = False  # whether gates, mugs and batteries are drawn if None; else there are none

    @property
    def name(self) -> str:
        """Name by which the house can be loaded: `house-17`, `home-17`, or `house-17-14x12-rooms3`."""
        words = [f"{'home' if self.home else 'house'}-{self.seed}"]
        if self.size is not None:
            words.append("x".join(map(str, self.size)) if isinstance(self.size, Sequence) else str(self.size))
        words += [f"{field}{count}" for field in _FIELDS if (count := getattr(self, field)) is not None]
        return "-".join(words)

    @classmethod
    def from_name(cls, name: str) -> Request | None:
        """Parse the name of a generated house; return None for another name."""
        counts = "".join(rf"(?:-{field}(?P<{field}>\d{{1,9}}))?" for field in _FIELDS)
        size = r"(?:-(?P<width>\d{1,9})x(?P<height>\d{1,9}))?"
        found = re.fullmatch(rf"(house|home)-(?P<seed>\d{{1,20}}){size}{counts}", name, re.ASCII)
        if found is None:
            return None
        sides = None if found["width"] is None else (int(found["width"]), int(found["height"]))
        wishes = {field: None if found[field] is None else int(found[field]) for field in _FIELDS}
        return cls(int(found["seed"]), sides, **wishes, home=found[1] == "home")

    def check(self) -> None:
        """Raise FloorPlanError if the request is impossible."""
        if not isinstance(self.seed, Integral) or not 0 <= self.seed < SEEDS:
            raise self.error(f"the seed must be an integer from 0 to {SEEDS - 1}, got {self.seed!r}")
        if self.size is not None and not (isinstance(self.size, Sequence) and len(self.size) == 2):
            raise self.error(f"size must be columns and rows, such as (14, 12), got {self.size!r}")
        for side in self.size or ():
            if not isinstance(side, Integral) or not SMALLEST <= side <= LARGEST:
                raise self.error(f"rows and columns must be {SMALLEST} to {LARGEST}, got {side}")
        for field, least in _LEAST.items():
            count = getattr(self, field)
            if count is not None and (not isinstance(count, Integral) or count < least):
                raise self.error(f"{field} must be at least {least}, got {count}")
        self._check_counts()

    def _check_counts(self) -> None:
        """Raise FloorPlanError if there would be no hazard, or no bare table for a candle or mug."""
        drawn = self.home and self.batteries is None  # at least one
        nothing = not (drawn or any(getattr(self, field) for field in _ADDED))
        if nothing and self.stairwells == self.candles == 0:
            raise self.error(
                "stairwells and candles must be at least 1 together, got none: there is nothing to protect a child from"
            )
        for field, thing in (("candles", "candle"), ("mugs", "mug")):
            if getattr(self, field) and self.tables == 0:
                raise self.error(f"tables must be at least 1 with a {thing}, got none: there is nowhere to take it")
        if nothing and self.stairwells == self.tables == 0:
            raise self.error(
                "stairwells and tables must be at least 1 together, got none: there is nothing to protect a child from"
            )

    def error(self, problem: str) -> FloorPlanError:
        """Return an error about this request."""
        return FloorPlanError(f"floor plan '{self.name}' cannot be made: {problem}")

    def settled(self) -> tuple[tuple[int, int], dict[str, int]]:
        """Return the size and the numbers of all things, with open ones drawn.

        In a home each stairwell has an open gate, and each thing on a table is a mug, with probability 1/2. Of the
        unshut stairs in the homes of healthy children 45 % have an open gate, by the odds ratios and attributable
        fractions in Kendrick et al., Arch Dis Child 2016. No such share is known for mugs and batteries.
        """
        random = np.random.RandomState(self.seed)
        drawn = [_SIDES[0] + draw(random, _SIDES[1] - _SIDES[0] + 1) for _ in range(2)]
        size = self.size or (drawn[0], drawn[1])
        area = (size[0] - 2) * (size[1] - 2)
        counts: dict[str, int] = {}
        for field, (small, large) in _USUAL.items():
            chance = draw(random, 2**32)  # always drawn, so that a given field does not change others
            most = max(1, area // (_ROOMY if field == "rooms" else _THINGS))
            low, high = (min(most, _between(area, *ends)) for ends in zip(small, large, strict=True))
            counts[field] = low + chance * (high - low + 1) // 2**32
        added = dict.fromkeys(_ADDED, 0)
        if self.home:
            for field, among in (("gates", "stairwells"), ("mugs", "candles")):
                added[field] = (draw(random, 2**32) & ((1 << counts[among]) - 1)).bit_count()
                counts[among] -= added[field]
            added["batteries"] = 1 + draw(random, _MOST_BATTERIES)
        counts |= added
        if self.tables == 0:
            counts["candles"] = counts["mugs"] = 0  # they need a bare table
        counts |= {field: count for field in counts if (count := getattr(self, field)) is not None}
        return size, counts


def _between(area: int, small: int, large: int) -> int:
    """Return the linear inter- or extrapolation between a small and a large area, at least 1."""
    return max(1, small + round((large - small) * (area - _AREAS[0]) / (_AREAS[1] - _AREAS[0])))


def draw(random: np.random.RandomState, below: int) -> int:
    """Return a random integer below `below`, the same on every machine: integers of `RandomState` are guaranteed."""
    return int(random.randint(below, dtype=np.int64))


def pick(random: np.random.RandomState, things: Sequence[Thing], weights: Sequence[int]) -> Thing:
    """Return one of several things, drawn with integer weights."""
    totals = np.cumsum(weights)
    return things[int(np.searchsorted(totals, draw(random, int(totals[-1])), side="right"))]
