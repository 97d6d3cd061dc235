"""What a child's move meets, and what is denied it: the rules of both worlds, for one child or for a batch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

DENIED = Target.STAIRWELL, Target.FREE  # what somebody who stands there can deny a child


class Way(NamedTuple):
    """What moves lead to, (...) each."""

    next_cell: np.ndarray  # free cell after it if nobody is in the way; that before it for a bump, or no move
    target: np.ndarray  # the `Target` that it meets, or NOTHING for a child that stays where it is
    number: np.ndarray  # the number of that among stairwells, tables or bins, or NOTHING
    entered: np.ndarray  # the caregiver's cell that it would enter, or NOTHING

    def waits(self, others: np.ndarray) -> np.ndarray:
        """Return whether a child waits, as another one is in its way, by the free cells of the others, (..., n)."""
        return (self.target == Target.FREE) & (self.next_cell[..., None] == others).any(axis=-1)

    def meets(self, caregiver_cell: np.ndarray | int) -> np.ndarray:
        """Return whether the caregiver is in the way; its cell is NOTHING where there is none."""
        return (self.entered == caregiver_cell) & (self.entered != NOTHING)

    def reaches(self, goal: np.ndarray | int) -> np.ndarray:
        """Return whether it is into the toy bin of that number."""
        return (self.target == Target.BIN) & (self.number == goal)


class MoveRules:
    """The moves of the children of one house."""

    def __init__(self, plan: FloorPlan):
        self._moves, self._free = plan.graph.moves, len(plan.free_cells)

    def way(self, cell: np.ndarray | int, action: np.ndarray | int) -> Way:
        """Return what moves lead to, by indices into `ACTIONS` or NOTHING, from free cells, (...) both."""
        stays = np.equal(action, NOTHING)
        next_cell, target, index = (table[cell, action] for table in self._moves)
        next_cell, target = np.where(stays, cell, next_cell), np.where(stays, NOTHING, target)
        # A stairwell's landing is the cell after the free ones; that behind a gate is none of the caregiver's.
        stairwell = np.where(target == Target.STAIRWELL, self._free + index, NOTHING)
        entered = np.where(target == Target.FREE, next_cell, stairwell)
        return Way(next_cell, target, np.where(stays, NOTHING, index), entered)


def denied(target: np.ndarray | int, blocked: np.ndarray | bool) -> np.ndarray:
    """Return what children are denied, bool (..., `DENIED`), by what their moves met and whether they were blocked."""
    return np.stack([np.asarray(blocked & (target == one)) for one in DENIED], axis=-1)
