"""Interventions, and what a verb has to say: how grid and robot carry it out, what it is called and drawn as."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.interventions.routine import Means, Routine
    from caregiver_mj.robot.view import View


Mark = tuple[Literal["cell", "candle"], Cell | int]  # what a display points at: a cell, or a candle by its index
# Names of the verbs that come with the package; each is a module of its own beside this one.
BLOCK, RELOCATE, STAND_ASIDE, DO_NOTHING = "block", "relocate", "stand aside", "nothing"


@dataclasses.dataclass(frozen=True)
class Intervention:
    """One intervention.

    Attributes:
        verb: Name of what to do, one of `VERBS`.
        hazard: Number in the house's table of hazards of what it is about, or NOTHING.
        destination: Where to, as the verb understands it (for a candle the index of a table), or NOTHING.
    """

    verb: str = STAND_ASIDE
    hazard: int = NOTHING
    destination: int = NOTHING


@dataclasses.dataclass(frozen=True)
class Interventions(Sequence[Intervention]):
    """An intervention for each of B worlds.

    Attributes:
        verb: Names of the verbs, (B,).
        hazard: Numbers of the hazards, (B,).
        destination: Destinations, (B,).
    """

    verb: np.ndarray
    hazard: np.ndarray
    destination: np.ndarray

    @classmethod
    def of(cls, interventions: Sequence[Intervention]) -> Interventions:
        """Makes a batch of single interventions."""
        verbs = np.array([one.verb for one in interventions], object)
        hazards = np.array([one.hazard for one in interventions], int)
        return cls(verbs, hazards, np.array([one.destination for one in interventions], int))

    @classmethod
    def idle(cls, batch: int) -> Interventions:
        """To stand aside, in B worlds."""
        return cls.of([Intervention()] * batch)

    def __len__(self) -> int:
        return len(self.verb)

    def __getitem__(self, world: int) -> Intervention:  # type: ignore[override]  # no slices
        return Intervention(str(self.verb[world]), int(self.hazard[world]), int(self.destination[world]))

    def where(self, mask: np.ndarray, other: Interventions) -> Interventions:
        """These where a mask (B,) holds, others elsewhere."""
        return Interventions(
            np.where(mask, self.verb, other.verb),
            np.where(mask, self.hazard, other.hazard),
            np.where(mask, self.destination, other.destination),
        )

    def begins_after(self, other: Interventions) -> np.ndarray:
        """Whether each is another one than before, (B,). A new destination alone does not make it another one."""
        return (self.verb != other.verb) | (self.hazard != other.hazard)


class Verb(abc.ABC):
    """Something that a caregiver can do. It holds no state: that is the world's, or the routine's.

    Attributes:
        name: What it is called in an `Intervention`.
        counts: Whether to begin it counts as an intervention, and interrupts another one.
    """

    name: str
    counts = True

    # -- What it is called and drawn as ----------------------------------------------------------

    @abc.abstractmethod
    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        """What is being done, in words: "block stairwell 1"."""

    def mark(self, plan: FloorPlan, intervention: Intervention) -> Mark | None:
        """What a display points at while it is being done."""
        return None

    # -- In the grid -----------------------------------------------------------------------------

    def places(self, plan: FloorPlan) -> list[list[int]]:
        """Where in the grid one stands to do it: groups of caregiver cells, any of which will do."""
        return []

    @abc.abstractmethod
    def place(self, world: GridWorld, which: np.ndarray) -> np.ndarray:
        """Where some of a grid's worlds must go for it now.

        Args:
            world: The grid.
            which: Indices of the worlds, (n,).

        Returns:
            Indices into `places`, ASIDE or STAY, (n,).
        """

    def carry_out(  # noqa: B027 (some are done by standing there)
        self, world: GridWorld, which: np.ndarray, came: np.ndarray, stood: np.ndarray
    ) -> None:
        """Does what there is to do in the place, in some of a grid's worlds, after the caregiver's move.

        Args:
            world: The grid, whose state it changes.
            which: Indices of the worlds, (n,).
            came: Whether the caregiver is in the place now, (n,).
            stood: Whether it has been there already, and so has its action left, (n,).
        """

    # -- In the house ----------------------------------------------------------------------------

    @abc.abstractmethod
    def routine(self, means: Means, intervention: Intervention, view: View, percept: Percept) -> Routine:
        """How the robot does it.

        Args:
            means: What there is to do it with.
            intervention: What to do.
            view: What the robot sees at the beginning.
            percept: What the caregiver sees then.
        """
