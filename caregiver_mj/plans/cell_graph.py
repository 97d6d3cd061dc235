"""Moves and walking distances on the cells of a floor plan."""

from __future__ import annotations

import enum
import functools
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from caregiver_mj.plans import hazards
from caregiver_mj.plans.hazards import Where

Cell = tuple[int, int]  # (row, column)
# The child's action set: north, east, south, west as (row, column) steps.
ACTIONS: tuple[Cell, ...] = ((-1, 0), (0, 1), (1, 0), (0, -1))
UNREACHABLE = np.iinfo(np.int16).max  # distance between cells without a path; above `MOST_CELLS` of a plan
_AT_ONCE = 2**20  # distances computed at a time, which bounds memory
WALL, FREE, BIN = "#.B"
STAIRWELL, CANDLE, TABLE = (kind.symbol for kind in (hazards.STAIRWELL, hazards.CANDLE, hazards.TABLE))


class Target(enum.IntEnum):
    """The content of the cell that a child's move leads to."""

    FREE = 0
    WALL = 1
    STAIRWELL = 2
    TABLE = 3
    BIN = 4


WALKABLE = (FREE, *(kind.symbol for kind in hazards.kinds_at(Where.FLOOR)))  # a child's cells
_TARGETS = (
    {WALL: Target.WALL, BIN: Target.BIN}
    | dict.fromkeys(WALKABLE, Target.FREE)
    | {
        kind.symbol: Target.STAIRWELL if kind.where is Where.OPENING else Target.TABLE
        for kind in hazards.KINDS
        if kind.where is not Where.FLOOR
    }
)
LEGEND = {  # names of each symbol, singular and plural
    WALL: ("wall", "walls"),
    FREE: ("free cell", "free cells"),
    **{kind.symbol: kind.cell for kind in hazards.KINDS},
    BIN: ("toy bin", "toy bins"),
}


class CellGraph:
    """The graph of walkable cells of a valid floor plan.

    Cells are indices into `FloorPlan.caregiver_cells`; the first of them are the child's, `FloorPlan.free_cells`.
    """

    def __init__(
        self,
        symbols: np.ndarray,
        free_cells: Sequence[Cell],
        landings: Sequence[Cell],
        stairwells: Sequence[Cell],
        tables: Sequence[Cell],
        bins: Sequence[Cell],
        floor_cells: Sequence[int],
        mouths: Mapping[Cell, Cell],
    ):
        """Take the attributes of a `FloorPlan`; symbols are (rows, columns)."""
        self._symbols, self._mouths = symbols, mouths
        self._stairwells, self._tables, self._bins, self._floor_cells = stairwells, tables, bins, floor_cells
        places = [*free_cells, *landings]
        self._free, self._cells = len(free_cells), len(places)
        # Cell index at each place of the plan, -1 where nobody can stand.
        self._index = np.full(symbols.shape, -1)
        rows, columns = np.array(places, int).reshape(-1, 2).T
        self._index[rows, columns] = np.arange(self._cells)
        self._places = rows, columns

    # -- Moves -----------------------------------------------------------------------------------

    @functools.cached_property
    def moves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The result of every move of a child, three arrays (free cells, 4).

        They are the cell after it (the same for a bump), the `Target`, and its index among `stairwells`, `tables` or
        `bins` (-1 for free cells and walls).
        """
        kinds, objects = np.full_like(self._index, Target.WALL), np.full_like(self._index, -1)
        for symbol, kind in _TARGETS.items():
            kinds[self._symbols == symbol] = kind
        for cells in (self._stairwells, self._tables, self._bins):
            for i, cell in enumerate(cells):
                objects[cell] = i
        (rows, columns), steps = self._places, np.array(ACTIONS).T  # steps: (2, 4)
        there = rows[: self._free, None] + steps[0], columns[: self._free, None] + steps[1]
        target, index = kinds[there], objects[there]
        for cell, mouth in self._mouths.items():  # a fence is a wall except from the mouth
            beside = (there[0] == cell[0]) & (there[1] == cell[1])
            beside[self._index[mouth]] = False
            target[beside], index[beside] = Target.WALL, -1
        here = np.arange(self._free)[:, None]
        return np.where(target == Target.FREE, self._index[there], here), target, index

    @functools.cached_property
    def bumps(self) -> np.ndarray:
        """The object that every move bumps into, (free cells, 4): stairwells, then tables; -1 for neither."""
        _, target, index = self.moves
        tables = np.where(target == Target.TABLE, index + len(self._stairwells), -1)
        return np.where(target == Target.STAIRWELL, index, tables)

    @functools.cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """The caregiver cells north, east, south and west of every cell."""
        return tuple(tuple(int(n) for n in around if n >= 0) for around in self.around)

    def beside(self, objects: Sequence[Cell]) -> list[list[int]]:
        """Return the free cells north, east, south and west of each object, or its mouth."""
        found = []
        for row, column in objects:
            mouth = self._mouths.get((row, column))
            around = [mouth] if mouth else [(row + down, column + right) for down, right in ACTIONS]
            cells = (int(self._index[cell]) for cell in around)
            found.append([cell for cell in cells if 0 <= cell < self._free])
        return found

    # -- Distances -------------------------------------------------------------------------------

    def distances_from(
        self, goals: Sequence[int | Sequence[int] | np.ndarray], closed: Collection[int] = ()
    ) -> np.ndarray:
        """Return the caregiver's walking distances, in moves, int16 (goals, caregiver cells).

        Goals are cells, or groups of cells of which the nearest counts. Closed cells, such as children's, cannot be
        entered. A distance without a path is `UNREACHABLE`.
        """
        return self._distances(goals, self._open_edges(closed), self._cells, closed)

    def bump_distances(self, objects: Sequence[Cell]) -> np.ndarray:
        """Return a child's moves until it bumps into the object in each cell, integers (free cells, objects)."""
        return self._distances(self.beside(objects), self._child_edges, self._free).T.astype(int) + 1

    def child_distances_from(self, cells: Sequence[int]) -> np.ndarray:
        """Return a child's walking distances from free cells, (cells, free cells). It does not cross landings."""
        return self._distances(cells, self._child_edges, self._free).astype(int)

    @functools.cached_property
    def bin_distances(self) -> np.ndarray:
        """A child's moves until it reaches into each toy bin, (free cells, bins)."""
        return self.bump_distances(self._bins)

    @functools.cached_property
    def table_distances(self) -> np.ndarray:
        """A child's moves until it bumps into each table, (free cells, tables)."""
        return self.bump_distances(self._tables)

    @functools.cached_property
    def floor_distances(self) -> np.ndarray:
        """A child's moves until it takes each thing on the floor, at least 1, (free cells, things)."""
        return np.maximum(1, self.child_distances_from(self._floor_cells).T)

    @functools.cached_property
    def stairwell_distances(self) -> np.ndarray:
        """A child's moves until it falls down each stairwell, (free cells, stairwells)."""
        return self.bump_distances(self._stairwells)

    def breadth_first(self, start: int, closed: Collection[int] = ()) -> dict[int, int]:
        """Search from a cell; return the predecessor of every reachable cell, nearest cells first.

        Closed cells cannot be entered. The start, which may be closed, is its own predecessor.
        """
        before = {start: start}
        queue = deque([start])
        neighbours = self.neighbours
        while queue:
            cell = queue.popleft()
            for neighbour in neighbours[cell]:
                if neighbour not in before and neighbour not in closed:
                    before[neighbour] = cell
                    queue.append(neighbour)
        return before

    def depth_first(self) -> tuple[np.ndarray, np.ndarray]:
        """Search from cell 0; return the cells in the order of discovery, and their predecessors, (cells,) each."""
        from scipy.sparse import csgraph

        return csgraph.depth_first_order(_as_graph(self._edges, self._cells), 0)

    def parts(self, closed: Collection[int] = ()) -> np.ndarray:
        """Return the number of each cell's part of the house, divided by closed cells, (caregiver cells,)."""
        from scipy.sparse import csgraph

        return csgraph.connected_components(_as_graph(self._open_edges(closed), self._cells))[1]

    def downhill(self, height: np.ndarray) -> np.ndarray:
        """Return for every caregiver cell the lowest of itself and its neighbours, itself if none is lower.

        `height`, such as a distance, and the result are (..., caregiver cells).
        """
        best = height[..., self._self_and_neighbours].argmin(axis=-1)
        return self._self_and_neighbours[np.arange(best.shape[-1]), best]

    def _distances(
        self,
        goals: Sequence[int | Sequence[int] | np.ndarray],
        edges: np.ndarray,
        cells: int,
        closed: Collection[int] = (),
    ) -> np.ndarray:
        from scipy.sparse import csgraph

        distances = np.empty((len(goals), cells), np.int16)
        step = max(1, _AT_ONCE // cells)
        for first in range(0, len(goals), step):
            some = goals[first : first + step]
            # Every goal is a further node, with one-way edges to its cells.
            entries = [(cells + i, cell) for i, goal in enumerate(some) for cell in np.atleast_1d(goal)]
            entry = np.array(entries, int).reshape(-1, 2)
            entry = entry[~np.isin(entry[:, 1], [*closed])]
            graph = _as_graph(np.concatenate([edges, entry]), cells + len(some))
            sources = cells + np.arange(len(some))
            found = csgraph.dijkstra(graph, unweighted=True, indices=sources)[:, :cells] - 1
            distances[first : first + step] = np.where(np.isfinite(found), found, UNREACHABLE)
        return distances

    # -- Edges -----------------------------------------------------------------------------------

    @functools.cached_property
    def around(self) -> np.ndarray:
        """The cells north, east, south and west of every cell, -1 for none, (caregiver cells, 4)."""
        padded = np.pad(self._index, 1, constant_values=-1)
        rows, columns = self._places
        return np.stack([padded[rows + 1 + down, columns + 1 + right] for down, right in ACTIONS], axis=-1)

    @functools.cached_property
    def _edges(self) -> np.ndarray:
        """All moves between caregiver cells, (moves, 2)."""
        cells, actions = np.nonzero(self.around >= 0)
        return np.stack([cells, self.around[cells, actions]], axis=-1)

    @functools.cached_property
    def _child_edges(self) -> np.ndarray:
        return self._edges[(self._edges < self._free).all(axis=1)]

    def _open_edges(self, closed: Collection[int]) -> np.ndarray:
        return self._edges[~np.isin(self._edges, [*closed]).any(axis=1)] if closed else self._edges

    @functools.cached_property
    def _self_and_neighbours(self) -> np.ndarray:
        """Every caregiver cell, then the cells north, east, south and west, itself for none: (cells, 5)."""
        here = np.arange(self._cells)[:, None]
        return np.concatenate([here, np.where(self.around >= 0, self.around, here)], axis=1)


def _as_graph(edges: np.ndarray, size: int) -> Any:
    """Return the `csr_array` of a graph of edges, (edges, 2), sorted by their first nodes."""
    from scipy.sparse import csr_array

    begins, ends = edges.T.copy()
    return csr_array((np.ones(len(edges)), ends, np.searchsorted(begins, np.arange(size + 1))), shape=(size, size))
