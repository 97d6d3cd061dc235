"""What a generated house shall be like, and its name."""

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
# What a house has if nothing is asked for: the least and the most in a small one and in a large one, whose areas
# within the outer walls are given in cells. Other sizes have as much for their area.
_SIDES = (10, 18)  # rows or columns
_AREAS = (8 * 8, 16 * 16)
_USUAL = {
    "rooms": ((2, 4), (4, 6)),
    "stairwells": ((1, 2), (1, 4)),
    "candles": ((2, 3), (2, 6)),
    "tables": ((2, 3), (2, 6)),
    "bins": ((2, 3), (2, 5)),
}
_ROOMY, _THINGS = 16, 12  # cells of a very small house for each room, and for each thing of a kind
_ADDED = ("gates", "mugs", "batteries")  # that only a home has unless they are asked for
_LEAST = {"rooms": 1, "stairwells": 0, "candles": 0, "tables": 0, "bins": 1} | dict.fromkeys(_ADDED, 0)
_FIELDS = (*_USUAL, *_ADDED)
_MOST_BATTERIES = 3  # in a home; one at least
Thing = TypeVar("Thing")


@dataclasses.dataclass(frozen=True)
class Request:
    """What a house shall be like. What is None is drawn from the seed."""

    seed: int  # where all chance comes from, a whole number from 0 on, below `SEEDS`
    size: tuple[int, int] | None = None  # columns and rows, outer walls included
    rooms: int | None = None  # how many rooms, a corridor included
    stairwells: int | None = None
    candles: int | None = None
    tables: int | None = None
    bins: int | None = None
    gates: int | None = None
    mugs: int | None = None
    batteries: int | None = None
    home: bool = False  # whether gates, mugs and batteries, too, are drawn if they are None; else there are none

    @property
    def name(self) -> str:
        """What the house is called, and can be loaded by: `house-17`, `home-17`, or `house-17-14x12-rooms3`."""
        words = [f"{'home' if self.home else 'house'}-{self.seed}"]
        if self.size is not None:
            words.append("x".join(map(str, self.size)) if isinstance(self.size, Sequence) else str(self.size))
        words += [f"{field}{count}" for field in _FIELDS if (count := getattr(self, field)) is not None]
        return "-".join(words)

    @classmethod
    def from_name(cls, name: str) -> Request | None:
        """Read the name of a generated house; None if it is no such name."""
        counts = "".join(rf"(?:-{field}(?P<{field}>\d{{1,9}}))?" for field in _FIELDS)
        size = r"(?:-(?P<width>\d{1,9})x(?P<height>\d{1,9}))?"
        found = re.fullmatch(rf"(house|home)-(?P<seed>\d{{1,20}}){size}{counts}", name, re.ASCII)
        if found is None:
            return None
        sides = None if found["width"] is None else (int(found["width"]), int(found["height"]))
        wishes = {field: None if found[field] is None else int(found[field]) for field in _FIELDS}
        return cls(int(found["seed"]), sides, **wishes, home=found[1] == "home")

    def check(self) -> None:
        """Raise FloorPlanError if there can be no such house."""
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
        """Raise FloorPlanError if there is nothing to protect a child from, or nowhere to take it."""
        drawn = self.home and self.batteries is None  # one at least
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
        """Return an error about it."""
        return FloorPlanError(f"floor plan '{self.name}' cannot be made: {problem}")

    def settled(self) -> tuple[tuple[int, int], dict[str, int]]:
        """Return the size, and how many of everything, with what was left open drawn.

        In a home every stairwell has an open gate, and everything on a table is a mug, with even chances. Of the stairs
        that are not shut in the homes of healthy children 45 % have a gate that stands open: from the odds ratios and
        attributable fractions in Kendrick et al., Arch Dis Child 2016. For mugs and batteries we know of no such share.
        """
        random = np.random.RandomState(self.seed)
        drawn = [_SIDES[0] + draw(random, _SIDES[1] - _SIDES[0] + 1) for _ in range(2)]
        size = self.size or (drawn[0], drawn[1])
        area = (size[0] - 2) * (size[1] - 2)
        counts: dict[str, int] = {}
        for field, (small, large) in _USUAL.items():
            chance = draw(random, 2**32)  # always drawn: one wish does not change what else is drawn
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
            counts["candles"] = counts["mugs"] = 0  # there would be nowhere to take them
        counts |= {field: count for field in counts if (count := getattr(self, field)) is not None}
        return size, counts


def _between(area: int, small: int, large: int) -> int:
    """A number between those for a small and for a large area, in proportion, or beyond them; at least 1."""
    return max(1, small + round((large - small) * (area - _AREAS[0]) / (_AREAS[1] - _AREAS[0])))


def draw(random: np.random.RandomState, below: int) -> int:
    """Return a whole number from 0 on, below another one, the same on every machine.

    NumPy promises that the stream of a `RandomState` never changes, and whole numbers are rounded nowhere.
    """
    return int(random.randint(below, dtype=np.int64))


def pick(random: np.random.RandomState, things: Sequence[Thing], weights: Sequence[int]) -> Thing:
    """Return one of several things, by whole weights."""
    totals = np.cumsum(weights)
    return things[int(np.searchsorted(totals, draw(random, int(totals[-1])), side="right"))]
