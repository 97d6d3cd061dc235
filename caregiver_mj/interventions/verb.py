"""What a verb has to say: how the grid carries it out, how the robot does, what it is called and drawn as."""

from __future__ import annotations

import abc
from typing import TYPE_CHECKING, Literal

import numpy as np

from caregiver_mj.interventions.intervention import Intervention
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import HazardKind

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.interventions.routine import Means, Routine
    from caregiver_mj.robot.view import View

Mark = tuple[Literal["cell", "candle"], Cell | int]  # what a display points at: a cell, or a candle by its index


class Verb(abc.ABC):
    """Something that a caregiver can do. It holds no state: that is the world's, or the routine's.

    Attributes:
        name: What it is called in an `Intervention`.
        counts: Whether to begin it counts as an intervention, and interrupts another one.
        about: The kind of hazard that it is about; None if that may be any, or none.
    """

    name: str
    counts = True
    about: HazardKind | None = None

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
