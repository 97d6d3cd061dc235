"""Interventions and their verbs, as data.

`grid/verbs.py` and, for the robot, `policy/routines.py` carry them out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Literal, TypeVar

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State, Where

Half = TypeVar("Half")
Mark = tuple[Literal["cell", "candle"], Cell | int]  # target to mark in a display: a cell, or a candle by its index
BLOCK, CLOSE, RELOCATE, PICK_UP = "block", "close", "relocate", "pick up"
LOOK = "look"
STAND_ASIDE, DO_NOTHING = "stand aside", "nothing"


@dataclasses.dataclass(frozen=True)
class Intervention:
    """One intervention."""

    verb: str = STAND_ASIDE  #: one of `VERBS`
    hazard: int = NOTHING  #: number of the hazard in the house, or NOTHING
    #: depends on the verb: index of a table for a candle, of one of `plans.visibility.lookouts` to look from, of a
    #: caregiver cell to do nothing in; or NOTHING
    destination: int = NOTHING


@dataclasses.dataclass(frozen=True)
class Interventions(Sequence[Intervention]):
    """An intervention for each of B worlds."""

    verb: np.ndarray  #: names of the verbs, (B,)
    hazard: np.ndarray  #: numbers of the hazards, (B,)
    destination: np.ndarray  #: destinations, (B,)

    @classmethod
    def of(cls, interventions: Sequence[Intervention]) -> Interventions:
        """Make a batch of single interventions."""
        verbs = np.array([one.verb for one in interventions], object)
        hazards = np.array([one.hazard for one in interventions], int)
        return cls(verbs, hazards, np.array([one.destination for one in interventions], int))

    @classmethod
    def idle(cls, batch: int) -> Interventions:
        """Return the intervention of standing aside, in B worlds."""
        return cls(np.full(batch, STAND_ASIDE, object), *np.full((2, batch), NOTHING))

    def __len__(self) -> int:
        return len(self.verb)

    def __getitem__(self, world: int) -> Intervention:  # type: ignore[override]  # no slices
        return Intervention(str(self.verb[world]), int(self.hazard[world]), int(self.destination[world]))

    @property
    def handles(self) -> np.ndarray:
        """Whether each needs the hand, bool (B,)."""
        return np.isin(self.verb, [name for name, verb in VERBS.items() if verb.handles])

    def where(self, mask: np.ndarray, other: Interventions) -> Interventions:
        """Return these where a mask (B,) holds, others elsewhere."""
        return Interventions(
            np.where(mask, self.verb, other.verb),
            np.where(mask, self.hazard, other.hazard),
            np.where(mask, self.destination, other.destination),
        )

    def begins_after(self, other: Interventions) -> np.ndarray:
        """Return whether each differs from the one before, (B,), regardless of the destination."""
        return (self.verb != other.verb) | (self.hazard != other.hazard)


@dataclasses.dataclass(frozen=True)
class Verb:
    """A kind of intervention."""

    name: str  #: its name in an `Intervention`
    activity: str  #: description in words; `{hazard}` stands for the hazard
    where: Where | None = None  #: place of its hazards; None for any, or for no hazard
    to_table: bool = False  #: whether its destination is a table
    counts: bool = True  #: whether starting it counts as an intervention, and interrupts another one
    leaves: State = State.AS_PLANNED  #: permanent state of its hazard when it is done
    handles: bool = False  #: whether it needs the hand

    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        """Return an intervention in words, such as "block stairwell 1"."""
        return self.activity.format(hazard="" if intervention.hazard == NOTHING else plan.hazards[intervention.hazard])

    def mark(self, plan: FloorPlan, intervention: Intervention) -> Mark | None:
        """Return the target to mark in a display during an intervention."""
        if self.where is None or intervention.hazard == NOTHING:
            return None
        index = plan.hazards.among(self.where, intervention.hazard)
        if self.where is Where.ON_TABLE:
            return "candle", index
        cells = plan.stairwells if self.where is Where.OPENING else [plan.free_cells[cell] for cell in plan.floor_cells]
        return "cell", cells[index]


VERBS = {
    verb.name: verb
    for verb in (
        Verb(BLOCK, "block {hazard}", Where.OPENING),
        Verb(CLOSE, "close {hazard}", Where.OPENING, leaves=State.SHUT, handles=True),
        Verb(RELOCATE, "fetch {hazard}", Where.ON_TABLE, to_table=True, handles=True),
        Verb(PICK_UP, "pick up {hazard}", Where.FLOOR, leaves=State.GONE, handles=True),
        Verb(LOOK, "look for the child"),
        Verb(STAND_ASIDE, "keep out of the way", counts=False),
        Verb(DO_NOTHING, "watch", counts=False),
    )
}


def verb_of(name: str) -> Verb:
    """Return a verb by name; raise CaregiverError if it is unknown."""
    if name not in VERBS:
        raise CaregiverError(f"no verb '{name}': there are {', '.join(VERBS)}")
    return VERBS[name]


def half_of(name: str, halves: Mapping[str, Half], table: str) -> Half:
    """Return a world's half of a verb from its table; raise CaregiverError if it has none there."""
    if verb_of(name).name not in halves:
        raise CaregiverError(f"verb '{name}' must have its half in {table} to be carried out, got {', '.join(halves)}")
    return halves[name]
