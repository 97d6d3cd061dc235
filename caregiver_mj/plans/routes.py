"""Routes of a caregiver round the children, and its behaviour where they bar its only way.

The rule: *where children bar its only way, the caregiver waits as near as it can without being beside a child, and
goes back when one comes.* A free cell always remains between them, in which the child can turn round; a waiting
caregiver denies no child a move unless it is cornered.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

Places = tuple[tuple[int, ...], ...]  # groups of caregiver cells

ASIDE = -1  # the place where the caregiver is least in the children's way
STAY = -2  # the caregiver's present place

LARGEST = 6e9  # bytes; greatest size of the tables of one child. Generated houses of 60 x 60 cells need about 3e9
_TABLES = 2  # of distances and of next cells


@functools.lru_cache(maxsize=4)
def routes(plan: FloorPlan, places: Places) -> RouteTables:
    """Return the routes to some places, cached because all caregivers and children share their tables."""
    return RouteTables(plan, places)


class RouteTables:
    """Shortest routes to places round the children, computed once for every set of children's cells.

    A place is a group of cells, any of which will do. Two more places are `ASIDE`, out of the children's way (on the
    fewest shortest paths from a child to a toy bin, and away from hazards), and `STAY`.
    """

    def __init__(self, plan: FloorPlan, places: Sequence[Sequence[int]]):
        """Prepare the tables.

        Raises:
            CaregiverError: The house is too large.
        """
        check_size(plan, places)
        self._plan, self._yielding = plan, yielding(plan)
        self._stand = [list(place) for place in places]
        # Cells where a child could not trap the caregiver are preferred.
        traps = self._yielding.traps
        self._safe_stand = [[cell for cell in stand if not traps[cell]] for stand in self._stand]
        self.open_distance = plan.graph.distances_from(self._stand)  # without children, (places, cells)
        self._learning = threading.Lock()
        self._row_of: dict[tuple[int, ...], int] = {}  # row of the tables, by the children's cells
        # Memory is used only for rows that are written. The last place of a row is ASIDE.
        self._distance, self._next_cell = (np.zeros(_shape(plan, places), np.int16) for _ in range(_TABLES))

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle by `routes`, because the tables are large and shared."""
        return routes, (self._plan, tuple(map(tuple, self._stand)))

    def towards(
        self, place: np.ndarray, child_cell: np.ndarray, caregiver_cell: np.ndarray, yields: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the routes to places.

        Args:
            place: Numbers of places, `ASIDE` or `STAY`, (B,).
            child_cell: The children's cells, (B, K).
            caregiver_cell: The caregiver's cell, (B,).
            yields: Whether it keeps its distance from children that bar its way; else it stays.

        Returns:
            Moves to each place, `UNREACHABLE` without a path, and the next cell, (B,) each.
        """
        row = self._rows(child_cell)
        stays = place == STAY
        place = np.where(stays, ASIDE, place)
        distance = self._distance[row, place, caregiver_cell]
        waits = stays if yields else stays | (distance == UNREACHABLE)
        next_cell = np.where(waits, caregiver_cell, self._next_cell[row, place, caregiver_cell])
        return np.where(stays, 0, distance), next_cell

    def around(self, child: int) -> tuple[np.ndarray, np.ndarray]:
        """Return `towards` from every cell to every place and `ASIDE` with one child, (places + 1, cells) each."""
        row = self._rows(np.array([[child]]))[0]
        return self._distance[row], self._next_cell[row]

    def _rows(self, child_cell: np.ndarray) -> np.ndarray:
        """Return the rows of the tables for the children's cells (B, K), computing new ones, (B,)."""
        if child_cell.shape[1] == 1:  # a faster special case
            groups, inverse = np.unique(child_cell, return_inverse=True)
            groups = groups[:, None]
        else:
            groups, inverse = np.unique(np.sort(child_cell, axis=1), axis=0, return_inverse=True)
        rows = []
        for group in map(tuple, groups.tolist()):
            if group not in self._row_of:
                with self._learning:
                    if group not in self._row_of:  # nor computed by another thread meanwhile
                        self._row_of[group] = self._learn(sorted(set(group)))
            rows.append(self._row_of[group])
        return np.array(rows)[inverse.ravel()]

    def _learn(self, closed: list[int]) -> int:
        """Compute the row of one set of children's cells; return its number."""
        row = len(self._row_of)
        if row == len(self._distance):
            for name in ("_distance", "_next_cell"):
                table = getattr(self, name)
                larger = np.zeros((2 * len(table), *table.shape[1:]), table.dtype)
                larger[: len(table)] = table
                setattr(self, name, larger)
        graph = self._plan.graph
        clear = _lowest(self._yielding.in_the_way(closed), graph.parts(closed))
        way, *far = graph.distances_from([clear, *self._safe_stand, *self._stand], closed)
        self._distance[row, ASIDE] = UNREACHABLE
        self._next_cell[row, ASIDE] = graph.downhill(way)
        if self._stand:
            safe, any_stand = np.split(np.array(far), 2)
            self._distance[row, :ASIDE] = distance = np.where(safe < UNREACHABLE, safe, any_stand)
            height = distance.astype(int)
            if np.delete(distance == UNREACHABLE, closed, axis=1).any():
                height = np.where(distance == UNREACHABLE, self._waiting(closed), height)
            self._next_cell[row, :ASIDE] = graph.downhill(height)
        return row

    def _waiting(self, closed: list[int]) -> np.ndarray:
        """Return the distance from each cell to where to wait for an unreachable place, (places, cells)."""
        graph = self._plan.graph
        beside = graph.distances_from([closed])[0] <= 1  # in a child's cell, or next to one
        shut = np.flatnonzero(beside).tolist()
        part = graph.parts(shut)
        nearest = [_lowest(np.where(beside, UNREACHABLE, far), part) for far in self.open_distance.astype(int)]
        nearest = [cells[~beside[cells]] for cells in nearest]
        # A caregiver beside a child moves away from it; none walks past one.
        away, out = (graph.distances_from(nearest, closed).astype(int) for closed in (shut, closed))
        return np.where(beside, UNREACHABLE + out, away)


def check_size(plan: FloorPlan, places: Sequence[Sequence[int]]) -> None:
    """Raise CaregiverError if the tables of a house could exceed a machine's memory."""
    needed = _TABLES * math.prod(_shape(plan, places)) * np.dtype(np.int16).itemsize
    if needed > LARGEST:
        raise CaregiverError(
            f"floor plan '{plan.name}' is too large for a caregiver in the grid: with {len(plan.free_cells)} free "
            f"cells, {len(plan.tables)} tables and {len(plan.stairwells)} stairwells the paths round a child would "
            f"take {needed / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f}"
        )


def _shape(plan: FloorPlan, places: Sequence[Sequence[int]]) -> tuple[int, int, int]:
    """Return the shape of each table: cells of one child, places and ASIDE, caregiver cells."""
    return len(plan.free_cells), len(places) + 1, len(plan.caregiver_cells)


def _lowest(height: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Return the lowest cells of every part of a divided house, given height and part of each cell, (cells,)."""
    least = np.full(part.max() + 1, np.iinfo(int).max)
    np.minimum.at(least, part, height)
    return np.flatnonzero(height == least[part])
