"""Paths of the grid's caregiver round the children, and out of their way."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import ASIDE, STAY
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.yielding import yielding

Places = tuple[tuple[int, ...], ...]  # groups of caregiver cells

LARGEST = 6e9  # bytes of tables when one child has been in every cell; houses generated of 60x60 cells take about 4e9
_TABLES = 3  # of a distance or a cell for each cell of a child, place and cell of the caregiver


@functools.lru_cache(maxsize=4)
def paths(plan: FloorPlan, places: Places) -> Paths:
    """The paths to some places; made once, for what they have learnt serves every caregiver and every child."""
    return Paths(plan, places)


class Paths:
    """Shortest paths to places round the children, computed once for every set of children's cells that occurs.

    A place is a group of cells, any of which will do. Two more of them are `ASIDE`, to be out of the children's way (on
    as few shortest paths from a child to a toy bin as can be), and `STAY`.

    Where children stand in the only way to a place there is no path, and two that wait for each other in a doorway
    would wait for ever. A caregiver that yields then follows the children as closely as it can while they walk away,
    and steps aside when one comes.
    """

    def __init__(self, plan: FloorPlan, places: Sequence[Sequence[int]]):
        """Prepares the tables.

        Raises:
            CaregiverError: The house is too large.
        """
        check_size(plan, places)
        self._plan, self._yielding = plan, yielding(plan)
        cells = len(plan.caregiver_cells)
        self._stand = [list(place) for place in places]
        # Better not where a child could shut it in.
        traps = self._yielding.traps
        self._safe_stand = [[cell for cell in stand if not traps[cell]] for stand in self._stand]
        self.open_distance = plan.graph.distances_from(self._stand)  # (places, cells), as if there were no child
        self._between = plan.graph.distances_from(range(cells))  # (cells, cells), likewise
        self._intended_cell = plan.graph.moves[0]
        self._row_of: dict[tuple[int, ...], int] = {}  # by the children's cells: where in the tables below
        # Zero pages until written to, so a large plan costs only what occurs. The last place of a row is ASIDE.
        shape = _shape(plan, places)
        self._distance, self._next_cell, self._next_aside = (np.zeros(shape, np.int16) for _ in range(_TABLES))

    def towards(self, place: np.ndarray, percept: Percept, yields: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """How to get to places.

        Args:
            place: Numbers of places, `ASIDE` or `STAY`, (B,).
            percept: What the caregiver sees.
            yields: Whether it makes room where its way is barred; else it stays where it is.

        Returns:
            Moves left to each place, `UNREACHABLE` where no path leads, and the cell to be in next, both (B,).
        """
        cell, row = percept.caregiver_cell, self._rows(percept.child_cell)
        stays = place == STAY
        place = np.where(stays, ASIDE, place)
        # A child that has just bumped into the caregiver comes, too: what counts is where it meant to go.
        previous, action = percept.previous_cell, percept.previous_action
        intended = np.where(action == NOTHING, previous, self._intended_cell[previous, action])
        comes = (self._between[cell[:, None], intended] < self._between[cell[:, None], previous]).any(axis=1)
        distance = self._distance[row, place, cell]
        next_cell = np.where(
            comes & (distance == UNREACHABLE),
            self._next_aside[row, place, cell],
            self._next_cell[row, place, cell],
        )
        waits = stays if yields else stays | (distance == UNREACHABLE)
        return np.where(stays, 0, distance), np.where(waits, cell, next_cell)

    def _rows(self, child_cell: np.ndarray) -> np.ndarray:
        """Rows of the tables for the children's cells (B, K), which are filled in where they are new: (B,)."""
        if child_cell.shape[1] == 1:  # the same as below, and quicker
            families, inverse = np.unique(child_cell, return_inverse=True)
            families = families[:, None]
        else:
            families, inverse = np.unique(np.sort(child_cell, axis=1), axis=0, return_inverse=True)
        rows = []
        for family in map(tuple, families.tolist()):
            if family not in self._row_of:
                self._row_of[family] = self._learn(sorted(set(family)))
            rows.append(self._row_of[family])
        return np.array(rows)[inverse.ravel()]

    def _learn(self, closed: list[int]) -> int:
        """Fills the tables in for one set of children's cells; returns the row."""
        row = len(self._row_of)
        if row == len(self._distance):
            for name in ("_distance", "_next_cell", "_next_aside"):
                table = getattr(self, name)
                larger = np.zeros((2 * len(table), *table.shape[1:]), table.dtype)
                larger[: len(table)] = table
                setattr(self, name, larger)
        graph = self._plan.graph
        part = graph.parts(closed)
        in_the_way = np.asarray(sum(self._yielding.routes_over(cell) for cell in closed))

        def lowest(height: np.ndarray) -> np.ndarray:
            """The lowest cells of every part."""
            least = np.full(part.max() + 1, np.iinfo(int).max)
            np.minimum.at(least, part, height)
            return np.flatnonzero(height == least[part])

        way, *far = graph.distances_from([lowest(in_the_way), *self._safe_stand, *self._stand], closed)
        aside = graph.downhill(way)
        self._distance[row, ASIDE] = UNREACHABLE
        self._next_cell[row, ASIDE] = self._next_aside[row, ASIDE] = aside
        if self._stand:
            safe, unsafe = np.split(np.array(far), 2)
            distance = np.where(safe < UNREACHABLE, safe, unsafe)
            self._distance[row, :ASIDE] = height = distance
            barred = distance == UNREACHABLE
            if np.delete(barred, closed, axis=1).any():
                left = self.open_distance.astype(int)
                nearest = [lowest(d) for d in (*left, *(left + UNREACHABLE * in_the_way))]
                close, clear = np.split(graph.distances_from(nearest, closed), 2)
                height = np.where(barred, close, distance)
                self._next_aside[row, :ASIDE] = graph.downhill(clear)
            self._next_cell[row, :ASIDE] = graph.downhill(height)
        return row


def check_size(plan: FloorPlan, places: Sequence[Sequence[int]]) -> None:
    """Raises CaregiverError if the tables of a house could grow too large for a machine's memory."""
    needed = _TABLES * math.prod(_shape(plan, places)) * np.dtype(np.int16).itemsize
    if needed > LARGEST:
        raise CaregiverError(
            f"floor plan '{plan.name}' is too large for a caregiver in the grid: with {len(plan.free_cells)} free "
            f"cells, {len(plan.tables)} tables and {len(plan.stairwells)} stairwells the paths round a child would "
            f"take {needed / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f}"
        )


def _shape(plan: FloorPlan, places: Sequence[Sequence[int]]) -> tuple[int, int, int]:
    """Of each table: a row for each cell of one child, in it every place and ASIDE, and the caregiver's cells."""
    return len(plan.free_cells), len(places) + 1, len(plan.caregiver_cells)
