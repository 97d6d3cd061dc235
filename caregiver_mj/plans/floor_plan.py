"""Floor plans: a house as text, its objects, and the walking distances in it.

A plan is a rectangle of characters, one a cell::

    #####
    #B.S#      # wall          . free cell       S stairwell
    #.C.#      C table with a candle on it       T bare table
    #..T#      B toy bin
    #####

Cells are ``(row, column)`` pairs counted from the upper left corner. Only free cells are walkable for the
novice; the caregiver may also step onto a stairwell's landing. Moves are 4-connected.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import importlib.resources
import os
import pathlib
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csgraph, csr_array

from caregiver_mj.errors import FloorPlanError

Cell = tuple[int, int]  # (row, column)

WALL, FREE, STAIRWELL, CANDLE, TABLE, BIN = "#.SCTB"
_LEGEND = {
    WALL: "wall",
    FREE: "free cell",
    STAIRWELL: "stairwell",
    CANDLE: "table with a candle",
    TABLE: "bare table",
    BIN: "toy bin",
}

# The novice's action set: north, east, south, west as (row, column) steps.
ACTIONS: tuple[Cell, ...] = ((-1, 0), (0, 1), (1, 0), (0, -1))
ACTION_NAMES = ("north", "east", "south", "west")

UNREACHABLE = np.iinfo(np.int16).max  # the distance between cells that no path connects

DEFAULT_CELL_SIZE = 0.75  # metres; a toddler's timestep at 1.6 km/h is then 1.69 s


class Target(enum.IntEnum):
    """What lies in the cell that a novice's move leads to."""

    FREE = 0
    WALL = 1
    STAIRWELL = 2
    TABLE = 3
    BIN = 4


@dataclasses.dataclass(frozen=True)
class FloorPlan:
    """A validated floor plan.

    Build one with `FloorPlan.load` or `FloorPlan.parse`; both refuse malformed plans.

    Attributes:
        name: What the plan is called in tables and messages.
        rows: The text, one string a row, all of one length.
        cell_size: Side of a cell in metres.
    """

    name: str
    rows: tuple[str, ...]
    cell_size: float = DEFAULT_CELL_SIZE

    # -- Reading ---------------------------------------------------------------------------------

    @classmethod
    def load(cls, name_or_path: str | os.PathLike[str], cell_size: float = DEFAULT_CELL_SIZE) -> FloorPlan:
        """Reads a plan that comes with the package, or one of your own from a file.

        Args:
            name_or_path: One of `house_names()`, or the path of a text file.
            cell_size: Side of a cell in metres.

        Raises:
            FloorPlanError: There is no such plan, the file cannot be read, or the plan is malformed.
        """
        if str(name_or_path) in house_names():
            resource = _houses_folder() / f"{name_or_path}.txt"
            return cls.parse(resource.read_text(encoding="utf-8"), str(name_or_path), cell_size)
        path = pathlib.Path(name_or_path)
        try:
            text = path.read_text(encoding="utf-8")
        except FileNotFoundError:
            raise FloorPlanError(
                f"no floor plan '{name_or_path}': neither a file nor one of {', '.join(house_names())}"
            ) from None
        except (OSError, UnicodeDecodeError) as error:
            raise FloorPlanError(f"floor plan '{name_or_path}' cannot be read: {error}") from None
        return cls.parse(text, path.stem, cell_size)

    @classmethod
    def parse(cls, text: str, name: str = "house", cell_size: float = DEFAULT_CELL_SIZE) -> FloorPlan:
        """Makes a plan of its text.

        Args:
            text: The rows, separated by newlines. Blank lines before and after them are ignored.
            name: What to call the plan.
            cell_size: Side of a cell in metres.

        Raises:
            FloorPlanError: The text is not a valid plan. The message says what is wrong and where.
        """
        lines = [line.rstrip() for line in text.splitlines()]
        first = next((i for i, line in enumerate(lines) if line), None)
        if first is None:
            raise FloorPlanError(f"floor plan '{name}' line 1, column 1: the plan is empty")
        last = max(i for i, line in enumerate(lines) if line)
        if not (np.isfinite(cell_size) and cell_size > 0):
            raise FloorPlanError(f"floor plan '{name}': the cell size must be a positive length, not {cell_size} m")
        plan = cls(name, tuple(lines[first : last + 1]), float(cell_size))
        _validate(plan, first_line=first + 1)
        return plan

    # -- What stands where -----------------------------------------------------------------------

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.rows), len(self.rows[0])

    def __getitem__(self, cell: Cell) -> str:
        return self.rows[cell[0]][cell[1]]

    def cells_of(self, *kinds: str) -> tuple[Cell, ...]:
        """All cells that bear one of the characters, in reading order."""
        return tuple((r, c) for r, row in enumerate(self.rows) for c, kind in enumerate(row) if kind in kinds)

    @functools.cached_property
    def free_cells(self) -> tuple[Cell, ...]:
        """The novice's cells; an index into this tuple is the novice's state."""
        return self.cells_of(FREE)

    @functools.cached_property
    def stairwells(self) -> tuple[Cell, ...]:
        return self.cells_of(STAIRWELL)

    @functools.cached_property
    def tables(self) -> tuple[Cell, ...]:
        """All tables, with a candle or bare."""
        return self.cells_of(CANDLE, TABLE)

    @functools.cached_property
    def candle_tables(self) -> tuple[int, ...]:
        """For each candle the index of the table on which it starts."""
        return tuple(i for i, cell in enumerate(self.tables) if self[cell] == CANDLE)

    @functools.cached_property
    def bins(self) -> tuple[Cell, ...]:
        return self.cells_of(BIN)

    @functools.cached_property
    def caregiver_cells(self) -> tuple[Cell, ...]:
        """Where the caregiver can stand: the free cells, then the stairwells' landings."""
        return self.free_cells + self.stairwells

    @functools.cached_property
    def cell_index(self) -> dict[Cell, int]:
        """The index in `caregiver_cells` of a cell (for free cells, also that in `free_cells`)."""
        return {cell: i for i, cell in enumerate(self.caregiver_cells)}

    # -- Where the cells lie in the house --------------------------------------------------------

    def position(self, cell: Cell) -> np.ndarray:
        """Centre of a cell, (2,), in metres: x to the east, y to the north, origin in the plan's middle."""
        height, width = self.shape
        return np.array([cell[1] - (width - 1) / 2, (height - 1) / 2 - cell[0]]) * self.cell_size

    def cell_at(self, position: np.ndarray) -> Cell:
        """The cell that holds a point (2,) in metres; points outside count to the nearest cell."""
        height, width = self.shape
        column = round(float(position[0]) / self.cell_size + (width - 1) / 2)
        row = round((height - 1) / 2 - float(position[1]) / self.cell_size)
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    # -- Moves and distances ---------------------------------------------------------------------

    @functools.cached_property
    def moves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What every move of the novice leads to, three arrays of shape (free cells, 4).

        Returns:
            The cell after the move (the same one if it was a bump), the `Target` in the way, and the index
            of that object among `stairwells`, `tables` or `bins` (-1 for free cells and walls).
        """
        kinds = {FREE: Target.FREE, WALL: Target.WALL, STAIRWELL: Target.STAIRWELL, BIN: Target.BIN}
        objects = {cell: i for cells in (self.stairwells, self.tables, self.bins) for i, cell in enumerate(cells)}
        shape = (len(self.free_cells), len(ACTIONS))
        next_cell, target, index = np.empty(shape, int), np.empty(shape, int), np.full(shape, -1)
        for i, (row, column) in enumerate(self.free_cells):
            for a, (down, right) in enumerate(ACTIONS):
                there = (row + down, column + right)
                target[i, a] = kinds.get(self[there], Target.TABLE)
                next_cell[i, a] = self.cell_index[there] if target[i, a] == Target.FREE else i
                index[i, a] = objects.get(there, -1)
        return next_cell, target, index

    def distances_from(self, goals: Sequence[int] | Sequence[Sequence[int]], closed: int | None = None) -> np.ndarray:
        """Walking distances of the caregiver, in moves, optionally round a closed cell.

        Args:
            goals: Indices into `caregiver_cells`, or groups of them, in which the nearest cell counts.
            closed: Index of a cell that cannot be entered, such as the novice's.

        Returns:
            int16 array (goals, caregiver cells); `UNREACHABLE` where no path leads.
        """
        # Every goal becomes one more node, from which one-way edges lead to its cells.
        cells = len(self.caregiver_cells)
        entries = [(cells + i, cell) for i, goal in enumerate(goals) for cell in np.atleast_1d(goal)]
        edges = np.concatenate([self._open_edges(closed), np.array(entries, int).reshape(-1, 2)])
        edges = edges[edges[:, 1] != closed]
        sources = cells + np.arange(len(goals))
        distances = csgraph.dijkstra(_as_graph(edges, cells + len(goals)), unweighted=True, indices=sources)
        distances = distances[:, :cells] - 1
        return np.where(np.isfinite(distances), distances, UNREACHABLE).astype(np.int16)

    def parts(self, closed: int) -> np.ndarray:
        """Numbers the parts into which a closed cell divides the caregiver's cells: (caregiver cells,)."""
        return csgraph.connected_components(_as_graph(self._open_edges(closed), len(self.caregiver_cells)))[1]

    def downhill(self, height: np.ndarray) -> np.ndarray:
        """For every caregiver cell the lowest among itself and its neighbours; itself if none is lower.

        Args:
            height: A number for each cell, such as a distance, (..., caregiver cells).

        Returns:
            Indices of cells, of that shape.
        """
        best = height[..., self._self_and_neighbours].argmin(axis=-1)
        return self._self_and_neighbours[np.arange(best.shape[-1]), best]

    def bump_distances(self, objects: tuple[Cell, ...]) -> np.ndarray:
        """Moves that a novice needs to bump into each object: to a free neighbour, and one more.

        Args:
            objects: Cells of objects.

        Returns:
            Integer array (free cells, objects).
        """
        distances = np.empty((len(self.free_cells), len(objects)), int)
        for i, cell in enumerate(objects):
            beside = [self.cell_index[n] for n in self.free_neighbours(cell)]
            distances[:, i] = self._novice_distances[:, beside].min(axis=1) + 1  # finite in a valid plan
        return distances

    def routes_over(self, novice_cell: int) -> np.ndarray:
        """How much a caregiver would be in the novice's way in each cell.

        Args:
            novice_cell: Index of the novice's free cell.

        Returns:
            The number of toy bins to which a shortest path of the novice leads over the cell, (caregiver cells,).
        """
        routes = np.zeros(len(self.caregiver_cells), int)  # none leads over a landing
        routes[: len(self.free_cells)] = self._on_shortest_path(novice_cell).sum(axis=1)
        return routes

    def _on_shortest_path(self, novice_cell: int) -> np.ndarray:
        """Whether a free cell is on some shortest path from the novice to a toy bin: bool (free cells, bins)."""
        distance, to_bins = self._novice_distances[novice_cell], self._bin_distances
        return distance[:, None] + to_bins == to_bins[novice_cell]

    @functools.cached_property
    def traps(self) -> np.ndarray:
        """Whether a novice can shut the caregiver in where every cell bars its way: bool (caregiver cells,).

        Such as at the end of a passage that leads to a toy bin: neither can then go on.
        """
        traps = np.zeros(len(self.caregiver_cells), bool)
        for novice_cell in range(len(self.free_cells)):
            part = self.parts(novice_cell)
            if part.max() > 1:  # more than the novice's cell and the rest
                # A cell bars the way if it is the only one so far away on the shortest paths to some bin.
                on_path, far = self._on_shortest_path(novice_cell), self._novice_distances[novice_cell].astype(int)
                alternatives = np.zeros((far.max() + 1, len(self.bins)), int)
                np.add.at(alternatives, far, on_path)
                bars = np.zeros(len(traps), bool)
                bars[: len(far)] = (on_path & (alternatives[far] == 1)).any(axis=1)
                has_refuge = np.zeros(part.max() + 1, bool)
                has_refuge[part[~bars]] = True
                has_refuge[part[novice_cell]] = True
                traps |= ~has_refuge[part]
        return traps

    def free_neighbours(self, cell: Cell) -> list[Cell]:
        """The free cells north, east, south and west of a cell."""
        around = [(cell[0] + down, cell[1] + right) for down, right in ACTIONS]
        height, width = self.shape
        return [n for n in around if 0 <= n[0] < height and 0 <= n[1] < width and self[n] == FREE]

    @functools.cached_property
    def _novice_distances(self) -> np.ndarray:
        """Walking distances of the novice, (free cells, free cells), infinite without a path.

        Landings are no way through, unlike for the caregiver.
        """
        free = len(self.free_cells)
        return csgraph.dijkstra(_as_graph(self._edges[(self._edges < free).all(axis=1)], free), unweighted=True)

    @functools.cached_property
    def _bin_distances(self) -> np.ndarray:
        return self.bump_distances(self.bins)

    @functools.cached_property
    def _edges(self) -> np.ndarray:
        """All moves between caregiver cells, (moves, 2)."""
        edges = [
            (i, self.cell_index[there])
            for i, (row, column) in enumerate(self.caregiver_cells)
            for down, right in ACTIONS
            if (there := (row + down, column + right)) in self.cell_index
        ]
        return np.array(edges, int).reshape(-1, 2)

    def _open_edges(self, closed: int | None) -> np.ndarray:
        return self._edges if closed is None else self._edges[(self._edges != closed).all(axis=1)]

    @functools.cached_property
    def _self_and_neighbours(self) -> np.ndarray:
        """Every caregiver cell, then the cells north, east, south and west (itself for want of one): (cells, 5)."""
        cells = self.caregiver_cells
        around = [
            [i] + [self.cell_index.get((row + down, column + right), i) for down, right in ACTIONS]
            for i, (row, column) in enumerate(cells)
        ]
        return np.array(around, int).reshape(-1, 1 + len(ACTIONS))


def house_names() -> tuple[str, ...]:
    """Names of the floor plans that come with the package."""
    return tuple(sorted(f.name.removesuffix(".txt") for f in _houses_folder().iterdir() if f.name.endswith(".txt")))


def _as_graph(edges: np.ndarray, size: int) -> csr_array:
    return csr_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(size, size))


def _houses_folder():
    return importlib.resources.files("caregiver_mj.models") / "houses"


def _validate(plan: FloorPlan, first_line: int) -> None:
    """Raises FloorPlanError at the first thing that is wrong with a plan."""

    def fail(cell: Cell, problem: str) -> None:
        row, column = cell
        raise FloorPlanError(f"floor plan '{plan.name}' line {row + first_line}, column {column + 1}: {problem}")

    height, width = len(plan.rows), len(plan.rows[0])
    for r, row in enumerate(plan.rows):
        for c, kind in enumerate(row):
            if kind not in _LEGEND:
                fail((r, c), f"{kind!r} is none of " + ", ".join(f"{k} ({n})" for k, n in _LEGEND.items()))
        if len(row) != width:
            fail((r, min(len(row), width)), f"the row has {len(row)} cells, but the first one has {width}")
    for r, row in enumerate(plan.rows):
        for c, kind in enumerate(row):
            if kind != WALL and (r in (0, height - 1) or c in (0, width - 1)):
                fail((r, c), f"the border must be all wall (#), and here is a {_LEGEND[kind]} ({kind})")

    if not plan.free_cells:
        fail((0, 0), "the plan has no free cell (.)")
    start = plan.free_cells[0]
    for cell, distance in zip(plan.free_cells, plan._novice_distances[0], strict=True):
        if not np.isfinite(distance):
            origin = f"line {start[0] + first_line}, column {start[1] + 1}"
            fail(cell, f"this free cell is not connected to the one at {origin}")
    for cell in plan.cells_of(STAIRWELL, CANDLE, TABLE, BIN):
        if not plan.free_neighbours(cell):
            fail(cell, f"this {_LEGEND[plan[cell]]} ({plan[cell]}) cannot be reached: no free cell is beside it")
    everywhere = f"in lines {first_line} to {first_line + height - 1}, columns 1 to {width}"
    if not plan.bins:
        raise FloorPlanError(f"floor plan '{plan.name}' has no toy bin (B) {everywhere}: the novice has nowhere to go")
    if plan.candle_tables and len(plan.candle_tables) == len(plan.tables):
        raise FloorPlanError(
            f"floor plan '{plan.name}' has no bare table (T) {everywhere}: there is nowhere to take a candle"
        )
