"""Hazards: what a child can be hurt by and a caregiver can do something about, in one table and one order."""

from __future__ import annotations

import dataclasses
import enum
import functools
import math
import numbers
from collections.abc import Iterator, Sequence
from typing import overload

import numpy as np

from caregiver_mj.errors import CaregiverError

MOST_DAMAGE = 1e6  # of a collision: far from where sums of it are no numbers any more
NOTHING = -1  # no hazard, no candle, no table, no action


@dataclasses.dataclass(frozen=True)
class DamageWeights:
    """Damage of one collision with each kind of thing (paper, section V.B). Walls, bins and the caregiver do none.

    Attributes:
        stairwell: Of a fall down the stairs.
        candle: Of a bump into a table with a candle; in the house also into a candle anywhere.
        table: Of a bump into a bare table. It is no `Hazard`, because nobody can do anything about a table.
    """

    stairwell: float = 5.0
    candle: float = 4.0
    table: float = 1.0

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not (isinstance(value, numbers.Real) and math.isfinite(value) and float(value) >= 0):
                raise CaregiverError(f"the damage of a {field.name} must be a number of at least 0, got {value!r}")
            if float(value) > MOST_DAMAGE:
                raise CaregiverError(f"the damage of a {field.name} must be at most {MOST_DAMAGE:g}, got {value!r}")

    @classmethod
    def parse(cls, text: str) -> DamageWeights:
        """Reads `STAIRWELL:CANDLE:TABLE`, such as "5:4:1".

        Raises:
            CaregiverError: It is not three numbers of at least 0.
        """
        try:
            stairwell, candle, table = map(float, text.split(":"))
        except ValueError:
            raise CaregiverError(f"damage must be STAIRWELL:CANDLE:TABLE, such as 5:4:1, got '{text}'") from None
        return cls(stairwell, candle, table)

    def __str__(self) -> str:
        """What `parse` makes the same weights of again."""
        return ":".join(np.format_float_positional(getattr(self, f.name), trim="-") for f in dataclasses.fields(self))

    @property
    def worst(self) -> float:
        """The greatest of them."""
        return max(self.stairwell, self.candle, self.table)


class HazardKind(enum.StrEnum):
    """What a hazard is."""

    STAIRWELL = "stairwell"
    CANDLE = "candle"


@dataclasses.dataclass(frozen=True)
class Hazard:
    """One thing that can hurt a child.

    Attributes:
        kind: What it is.
        index: Its number among those of its kind, from 0, in the floor plan's order.
        damage: d_o of the paper: damage of one collision with it.
    """

    kind: HazardKind
    index: int
    damage: float

    def __str__(self) -> str:
        """Its name in sentences, such as "stairwell 1"."""
        return f"{self.kind} {self.index + 1}"

    @property
    def label(self) -> str:
        """Its name where there is little room, such as "S1"."""
        return f"{self.kind[0].upper()}{self.index + 1}"


@dataclasses.dataclass(frozen=True)
class Hazards(Sequence[Hazard]):
    """All hazards of a house: first its stairwells, then its candles.

    A number of a hazard is its place in this table. The methods take such numbers, or numbers among one kind, as
    integers or as integer arrays of any shape, and leave NOTHING as it is.

    Attributes:
        stairwells: How many stairwells there are.
        candles: How many candles.
        weights: Damage of a collision with each kind.
    """

    stairwells: int
    candles: int
    weights: DamageWeights = DamageWeights()

    def __len__(self) -> int:
        return self.stairwells + self.candles

    def __getitem__(self, number: int) -> Hazard:  # type: ignore[override]  # no slices
        if not 0 <= number < len(self):
            raise IndexError(f"no hazard {number}: there are {len(self)}")
        if number < self.stairwells:
            return Hazard(HazardKind.STAIRWELL, int(number), self.weights.stairwell)
        return Hazard(HazardKind.CANDLE, int(number) - self.stairwells, self.weights.candle)

    def __iter__(self) -> Iterator[Hazard]:
        return (self[number] for number in range(len(self)))

    @functools.cached_property
    def damage(self) -> np.ndarray:
        """d_o of every hazard, (hazards,)."""
        return np.array([hazard.damage for hazard in self], float)

    @overload
    def of_stairwell(self, index: int) -> int: ...
    @overload
    def of_stairwell(self, index: np.ndarray) -> np.ndarray: ...
    def of_stairwell(self, index: int | np.ndarray) -> int | np.ndarray:
        """Return the number of the hazard that a stairwell is.

        Raises:
            CaregiverError: There is no such stairwell.
        """
        _check_index("stairwell", index, self.stairwells)
        return np.where(np.equal(index, NOTHING), NOTHING, index) if np.ndim(index) else int(index)

    @overload
    def of_candle(self, index: int) -> int: ...
    @overload
    def of_candle(self, index: np.ndarray) -> np.ndarray: ...
    def of_candle(self, index: int | np.ndarray) -> int | np.ndarray:
        """Return the number of the hazard that a candle is.

        Raises:
            CaregiverError: There is no such candle.
        """
        _check_index("candle", index, self.candles)
        if np.ndim(index):
            return np.where(np.equal(index, NOTHING), NOTHING, np.add(index, self.stairwells))
        return NOTHING if index == NOTHING else int(index) + self.stairwells

    @overload
    def stairwell(self, number: int) -> int: ...
    @overload
    def stairwell(self, number: np.ndarray) -> np.ndarray: ...
    def stairwell(self, number: int | np.ndarray) -> int | np.ndarray:
        """Which stairwell a hazard is, NOTHING if it is none."""
        found = np.where(self.is_stairwell(number), number, NOTHING)
        return found if np.ndim(number) else int(found)

    @overload
    def candle(self, number: int) -> int: ...
    @overload
    def candle(self, number: np.ndarray) -> np.ndarray: ...
    def candle(self, number: int | np.ndarray) -> int | np.ndarray:
        """Which candle a hazard is, NOTHING if it is none."""
        found = np.where(self.is_candle(number), np.subtract(number, self.stairwells), NOTHING)
        return found if np.ndim(number) else int(found)

    @overload
    def is_stairwell(self, number: int) -> np.bool: ...
    @overload
    def is_stairwell(self, number: np.ndarray) -> np.ndarray: ...
    def is_stairwell(self, number: int | np.ndarray) -> np.bool | np.ndarray:
        """Whether a hazard is a stairwell."""
        return np.greater(number, NOTHING) & np.less(number, self.stairwells)

    @overload
    def is_candle(self, number: int) -> np.bool: ...
    @overload
    def is_candle(self, number: np.ndarray) -> np.ndarray: ...
    def is_candle(self, number: int | np.ndarray) -> np.bool | np.ndarray:
        """Whether a hazard is a candle."""
        return np.greater_equal(number, self.stairwells) & np.less(number, len(self))

    def join(self, stairwells: np.ndarray, candles: np.ndarray) -> np.ndarray:
        """Values of stairwells (..., stairwells) and of candles (..., candles) as values of hazards (..., hazards)."""
        return np.concatenate([stairwells, candles], axis=-1)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reverse of `join`."""
        return values[..., : self.stairwells], values[..., self.stairwells :]


def _check_index(kind: str, index: int | np.ndarray, count: int) -> None:
    """Raises CaregiverError unless numbers among one kind are of so many, or NOTHING."""
    wrong = np.less(index, NOTHING) | np.greater_equal(index, count)
    if wrong.any():
        first = int(np.asarray(index)[wrong][0])
        there = f"from 0 to {count - 1}, or NOTHING ({NOTHING})" if count else f"NOTHING ({NOTHING}), for there is none"
        raise CaregiverError(f"the number of a {kind} must be {there}, got {first}")
