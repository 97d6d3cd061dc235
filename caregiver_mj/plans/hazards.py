"""Hazards: their kinds, and the table of a house's hazards."""

from __future__ import annotations

import dataclasses
import enum
import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from caregiver_mj.errors import CaregiverError, check_kind, check_number

MOST_DAMAGE = 1e6  # of a collision; sums of it stay exact enough
NOTHING = -1  # no hazard, no candle, no table, no action
_Number = TypeVar("_Number", int, np.ndarray)


class Where(enum.Enum):
    """Place of a hazard. The table of a house's hazards is in this order."""

    OPENING = enum.auto()  # entering the cell hurts; an occupant blocks it
    ON_TABLE = enum.auto()  # bumping into the table hurts; the thing can be carried to another table
    FLOOR = enum.auto()  # entering the cell takes it and hurts, once; the cell is free
    FURNITURE = enum.auto()  # the table itself


class State(enum.IntEnum):
    """State of a hazard. Verbs declare the state that they leave; the worlds apply it."""

    AS_PLANNED = 0
    SHUT = 1  # an opening that no child gets through
    GONE = 2  # off the floor, taken by a child or the caregiver


@dataclasses.dataclass(frozen=True)
class HazardKind:
    """A kind of hazard, without its model."""

    name: str  #: in sentences, in columns (`damage_candle`) and in the scene (`candle_0/...`)
    symbol: str  #: character in floor plans, and in labels such as "C1"
    where: Where  #: its place
    damage: float  #: default damage of one collision (paper, section V.B)
    verb: str | None  #: name of the verb against it; None without one: then it is no `Hazard`
    cell: tuple[str, str]  #: names of its cell, singular and plural
    at: str  #: place of the damage, in tables
    harm: str  #: cause of the damage, in a sentence
    #: file in `models/`; its first geom is the one to touch, for a carried thing the upright cylinder to grip
    model: str
    colour: tuple[int, int, int]  #: in drawings: red, green, blue, 0 to 255
    fenced: bool = False  #: whether only children can enter it, and only opposite to its stairs
    grip: float = 0.10  #: m; height of the grip above the foot of a carried thing
    upset: float = 30.0  #: degrees; tilt beyond which a carried thing has fallen or spilt

    def __str__(self) -> str:
        return self.name


STAIRWELL = HazardKind(
    name="stairwell", symbol="S", where=Where.OPENING, damage=5.0, verb="block", cell=("stairwell", "stairwells"),
    at="stairs", harm="falls down stairs", model="stairwell", colour=(204, 121, 167),
)  # fmt: skip
GATE = HazardKind(
    name="gate", symbol="G", where=Where.OPENING, damage=5.0, verb="close",
    cell=("stairwell with an open gate", "stairwells with open gates"), at="open gates",
    harm="falls down stairs whose gate stands open", model="gate", colour=(213, 94, 0), fenced=True,
)  # fmt: skip
CANDLE = HazardKind(
    name="candle", symbol="C", where=Where.ON_TABLE, damage=4.0, verb="relocate",
    cell=("table with a candle", "tables with a candle"), at="candles",
    harm="bumps into tables with a candle, in the house also into a candle anywhere",
    model="candle", colour=(230, 159, 0),
)  # fmt: skip
TABLE = HazardKind(
    name="table", symbol="T", where=Where.FURNITURE, damage=1.0, verb=None, cell=("bare table", "bare tables"),
    at="bare tables", harm="bumps into bare tables", model="table", colour=(133, 100, 72),
)  # fmt: skip
MUG = HazardKind(
    name="mug", symbol="M", where=Where.ON_TABLE, damage=5.0, verb="relocate",
    cell=("table with a hot drink", "tables with a hot drink"), at="hot drinks",
    harm="pulls a hot drink over itself, in the house also bumps into one anywhere",
    model="mug", colour=(0, 114, 178), grip=0.08, upset=20.0,
)  # fmt: skip
BATTERY = HazardKind(
    name="battery", symbol="o", where=Where.FLOOR, damage=5.0, verb="pick up",
    cell=("free cell with a battery", "free cells with batteries"), at="batteries",
    harm="takes batteries off the floor", model="battery", colour=(186, 192, 206),
)  # fmt: skip


def distinct(*kinds: HazardKind) -> tuple[HazardKind, ...]:
    """Return kinds, each once; raise CaregiverError if two kinds have the same name or symbol."""
    for field in ("name", "symbol"):
        first: dict[str, HazardKind] = {}
        for kind in kinds:
            if (other := first.setdefault(getattr(kind, field), kind)) != kind:
                raise CaregiverError(
                    f"the {field} of a kind of hazard must be its own, got {getattr(kind, field)!r} for {kind} and "
                    f"{other}"
                )
    return tuple(dict.fromkeys(kinds))


KINDS = distinct(STAIRWELL, CANDLE, TABLE, GATE, MUG, BATTERY)  # a new kind needs a record here, and a model
_IN_SHORT = tuple(kind.name for kind in (STAIRWELL, CANDLE, TABLE))  # kinds of the short form "5:4:1"


def kinds_at(*where: Where) -> tuple[HazardKind, ...]:
    """Return the kinds in some places, in the order of `KINDS`, with fenced ones last."""
    return tuple(sorted((kind for kind in KINDS if kind.where in where), key=lambda kind: kind.fenced))


class DamageWeights(Mapping[str, float]):
    """Damage of one collision with each kind of hazard, by name. Walls, bins and the caregiver do none.

    Example: `DamageWeights(stairwell=20)`, or for stairwell, candle and table `DamageWeights(5, 4, 1)`. Other kinds
    have their default.
    """

    def __init__(self, *in_order: float, **by_name: float):
        """Set the weights.

        Raises:
            CaregiverError: A kind is unknown or given twice, or a number is not in [0, `MOST_DAMAGE`].
        """
        self._weights = {kind.name: kind.damage for kind in KINDS}
        given = dict(zip(_IN_SHORT, in_order, strict=False))
        if len(given) < len(in_order) or given.keys() & by_name:
            raise CaregiverError(f"damage must be one number for each of {', '.join(_IN_SHORT)}")
        for name, value in (given | by_name).items():
            if name not in self._weights:
                raise CaregiverError(f"no kind of damage '{name}': there are {', '.join(self._weights)}")
            check_number(f"the damage of a {name}", value, 0.0, MOST_DAMAGE)
            self._weights[name] = float(value)

    @classmethod
    def of(cls, damage: Mapping[str, float] | str) -> DamageWeights:
        """Make weights from "stairwell=5,candle=4", "5:4:1" (stairwell, candle, table), or `{"stairwell": 5}`.

        Raises:
            CaregiverError: The form is another, a number is out of range, or a kind is unknown.
        """
        if isinstance(damage, Mapping):
            return damage if isinstance(damage, cls) else cls(**{str(name): value for name, value in damage.items()})
        check_kind("the damage, if no DamageWeights or mapping,", damage, str)
        try:
            if "=" not in damage:
                return cls(**dict(zip(_IN_SHORT, map(float, damage.split(":")), strict=True)))
            said = [(name.strip(), float(value)) for name, value in (part.split("=") for part in damage.split(","))]
        except ValueError:
            raise CaregiverError(
                "damage must be KIND=NUMBER, such as stairwell=5,candle=4, or "
                f"{':'.join(_IN_SHORT).upper()}, such as 5:4:1, got '{damage}'"
            ) from None
        if len(dict(said)) < len(said):
            raise CaregiverError(f"damage must name each kind once, got '{damage}'")
        return cls(**dict(said))

    def __str__(self) -> str:
        """Return the shortest text from which `of` makes the same weights."""
        said = {name: np.format_float_positional(value, trim="-") for name, value in self.items()}
        if self == DamageWeights(**{name: self[name] for name in _IN_SHORT}):
            return ":".join(said[name] for name in _IN_SHORT)
        return ",".join(f"{name}={value}" for name, value in said.items())

    def __repr__(self) -> str:
        return f"DamageWeights({', '.join(f'{name}={value!r}' for name, value in self.items())})"

    def __getitem__(self, name: str) -> float:
        return self._weights[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._weights)

    def __len__(self) -> int:
        return len(self._weights)

    def __hash__(self) -> int:
        return hash(tuple(self.values()))

    @property
    def worst(self) -> float:
        """The greatest weight."""
        return max(self.values())


@dataclasses.dataclass(frozen=True)
class Hazard:
    """A hazard of a house."""

    kind: HazardKind  #: its kind
    index: int  #: number among those of its kind, from 0, in the floor plan's order
    damage: float  #: d_o of the paper: damage of one collision with it

    def __str__(self) -> str:
        """Return its name in sentences, such as "stairwell 1"."""
        return f"{self.kind.name} {self.index + 1}"

    @property
    def label(self) -> str:
        """Short name, such as "S1"."""
        return f"{self.kind.symbol}{self.index + 1}"

    @property
    def element(self) -> str:
        """Name in the scene, such as "stairwell_0", the prefix of its parts."""
        return f"{self.kind.name}_{self.index}"


@dataclasses.dataclass(frozen=True)
class Hazards(Sequence[Hazard]):
    """All hazards of a house: those in openings, on tables and on the floor, kind by kind.

    A hazard's number is its index in this table. Methods take numbers, or indices among the hazards in one place, as
    integers or arrays of any shape, and pass NOTHING through.
    """

    kinds: tuple[HazardKind, ...]  #: kind of each hazard
    weights: DamageWeights = DamageWeights()  #: damage of a collision with each kind

    def __len__(self) -> int:
        return len(self.kinds)

    def __getitem__(self, number: int) -> Hazard:  # type: ignore[override]  # no slices
        if not 0 <= number < len(self):
            raise IndexError(f"no hazard {number}: there are {len(self)}")
        kind = self.kinds[number]
        return Hazard(kind, self.kinds[:number].count(kind), self.weights[kind.name])

    @functools.cached_property
    def damage(self) -> np.ndarray:
        """d_o of every hazard, (hazards,)."""
        return np.array([hazard.damage for hazard in self], float)

    @functools.cached_property
    def verb(self) -> np.ndarray:
        """Name of the verb that protects from every hazard, (hazards,)."""
        return np.array([kind.verb for kind in self.kinds], object)

    @functools.cached_property
    def _spans(self) -> dict[Where, tuple[int, int]]:
        """First number of the hazards in each place, and that after the last."""
        counts = [sum(kind.where is where for kind in self.kinds) for where in Where]
        ends = np.cumsum(counts).tolist()
        return {where: (end - count, end) for where, count, end in zip(Where, counts, ends, strict=True)}

    def at(self, where: Where) -> list[Hazard]:
        """Return the hazards in one place."""
        return list(self)[slice(*self._spans[where])]

    def worst(self, where: Where) -> float:
        """Return the greatest damage of the hazards in one place; 0 if there are none."""
        return float(self.damage[slice(*self._spans[where])].max(initial=0.0))

    def number(self, where: Where, index: _Number) -> _Number:
        """Return the numbers of hazards by their indices in one place; raise CaregiverError if one is out of range."""
        first, end = self._spans[where]
        wrong = np.asarray(index)[np.less(index, NOTHING) | np.greater_equal(index, end - first)]
        if wrong.size:
            words = " or ".join(kind.name for kind in kinds_at(where))
            there = f"from 0 to {end - first - 1}, or " if end > first else ""
            raise CaregiverError(f"the number of a {words} must be {there}NOTHING ({NOTHING}), got {wrong[0]}")
        found = np.where(np.equal(index, NOTHING), NOTHING, np.add(index, first))
        return found if isinstance(index, np.ndarray) else int(found)

    def among(self, where: Where, number: _Number) -> _Number:
        """Return the indices of hazards among those in one place, NOTHING for hazards elsewhere."""
        found = np.where(self.are_at(where, number), np.subtract(number, self._spans[where][0]), NOTHING)
        return found if isinstance(number, np.ndarray) else int(found)

    def are_at(self, where: Where, number: int | np.ndarray) -> np.ndarray:
        """Return whether each hazard is in one place."""
        first, end = self._spans[where]
        return np.asarray(np.greater_equal(number, first) & np.less(number, end))

    def join(self, openings: np.ndarray, on_tables: np.ndarray, on_floor: np.ndarray) -> np.ndarray:
        """Join values of hazards in openings, on tables and on the floor into (..., hazards)."""
        return np.concatenate([openings, on_tables, on_floor], axis=-1)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the inverse of `join`."""
        (_, openings), (_, on_tables) = self._spans[Where.OPENING], self._spans[Where.ON_TABLE]
        return values[..., :openings], values[..., openings:on_tables], values[..., on_tables:]
