"""Rules of children's moves in both worlds, for one child or a batch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

DENIED = Target.STAIRWELL, Target.FREE  # targets that a caregiver in them blocks


class Way(NamedTuple):
    """The targets of moves, (...) each."""

    next_cell: np.ndarray  # free cell after an unobstructed move; the present one for a bump or no move
    target: np.ndarray  # the `Target`, or NOTHING for no move
    number: np.ndarray  # number of the target among stairwells, tables or bins, or NOTHING
    entered: np.ndarray  # caregiver cell to enter, or NOTHING

    def waits(self, others: np.ndarray) -> np.ndarray:
        """Return whether another child's free cell, (..., n), is in the way."""
        return (self.target == Target.FREE) & (self.next_cell[..., None] == others).any(axis=-1)

    def meets(self, caregiver_cell: np.ndarray | int) -> np.ndarray:
        """Return whether the caregiver is in the way; NOTHING stands for none."""
        return (self.entered == caregiver_cell) & (self.entered != NOTHING)

    def reaches(self, goal: np.ndarray | int) -> np.ndarray:
        """Return whether the move reaches the toy bin with this number."""
        return (self.target == Target.BIN) & (self.number == goal)


class MoveRules:
    """The moves of children in a house."""

    def __init__(self, plan: FloorPlan):
        self._moves, self._free = plan.graph.moves, len(plan.free_cells)

    def way(self, cell: np.ndarray | int, action: np.ndarray | int) -> Way:
        """Return the targets of moves, indices into `ACTIONS` or NOTHING, from free cells, (...) each."""
        stays = np.equal(action, NOTHING)
        next_cell, target, index = (table[cell, action] for table in self._moves)
        next_cell, target = np.where(stays, cell, next_cell), np.where(stays, NOTHING, target)
        # Landings follow the free cells; the cell behind a gate is no caregiver cell.
        stairwell = np.where(target == Target.STAIRWELL, self._free + index, NOTHING)
        entered = np.where(target == Target.FREE, next_cell, stairwell)
        return Way(next_cell, target, np.where(stays, NOTHING, index), entered)


def denied(target: np.ndarray | int, blocked: np.ndarray | bool) -> np.ndarray:
    """Return whether each of `DENIED` was denied, bool (..., 2), from targets and whether moves were blocked."""
    return np.stack([np.asarray(blocked & (target == one)) for one in DENIED], axis=-1)
