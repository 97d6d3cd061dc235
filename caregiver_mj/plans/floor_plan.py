"""Floor plans: a house as text.

A plan is a rectangle of characters, one a cell::

    #####
    #B.S#      # wall          . free cell       S stairwell
    #.C.#      C table with a candle on it       T bare table
    #o.T#      B toy bin                         G stairwell with an open gate
    #####      o free cell with a battery        M table with a hot drink on it

Cells are ``(row, column)`` pairs counted from the upper left corner. Only free cells are walkable for a
child; the caregiver may also step onto a stairwell's landing. Moves are 4-connected.
"""

from __future__ import annotations

import collections
import dataclasses
import errno
import functools
import importlib.resources
import numbers
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.resources.abc import Traversable
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError, FloorPlanError, check_kind
from caregiver_mj.outside import LARGEST_PLAN, MOST_CELLS, read_file, visible
from caregiver_mj.plans.cell_graph import ACTIONS, BIN, FREE, LEGEND, UNREACHABLE, WALKABLE, WALL, Cell, CellGraph
from caregiver_mj.plans.hazards import KINDS, TABLE, DamageWeights, Hazards, Where, kinds_at

_FENCED = tuple(kind.symbol for kind in KINDS if kind.fenced)
# m. A child that walks into a thing has half of a move to get there, enough for .70 of a cell. Beyond 1.12 m that ends
# before the face of a toy bin in the next cell, at cell - BIN_HALF_SIZE - CHILD_RADIUS: it would reach no toy.
_LARGEST_CELL = 1.1
_EXCERPT = 100  # most characters of a line in an error
_Problem = tuple[str, str]  # message and excerpt of a `FloorPlanError`
# Functions that return a plan by name, or None. `plans/__init__.py` adds that of generated houses, which imports
# this module.
SOURCES: list[Callable[[str], FloorPlan | None]] = []
DEFAULT_CELL_SIZE = 0.75  # m; makes a toddler's timestep at 1.6 km/h 1.69 s


@dataclasses.dataclass(frozen=True)
class FloorPlan:
    """A validated floor plan, made by `FloorPlan.load` or `FloorPlan.parse`, which reject malformed ones."""

    name: str  #: name of the plan in tables and messages
    rows: tuple[str, ...]  #: the text, one string a row, all of one length
    cell_size: float = DEFAULT_CELL_SIZE  #: m; side of a cell
    damage: DamageWeights = DamageWeights()  #: damage of collisions

    # -- Reading ---------------------------------------------------------------------------------

    @classmethod
    def load(
        cls,
        name_or_path: str | os.PathLike[str],
        cell_size: float = DEFAULT_CELL_SIZE,
        damage: Mapping[str, float] | str = DamageWeights(),
    ) -> FloorPlan:
        """Load a plan of the package, a generated one, or one from a file.

        Args:
            name_or_path: One of `house_names()`, a generated house (`house-17`, see `caregiver_mj.plans.generator`), a
                house of a set (`test-100/17`, see `caregiver_mj.plans.sets`), or the path of a text file.
            cell_size: Side of a cell in metres.
            damage: Damage of collisions, as `DamageWeights.of` takes it.

        Raises:
            FloorPlanError: The name is unknown, the file cannot be read, or the plan is malformed.
        """
        check_kind("a house, if no FloorPlan,", name_or_path, str, os.PathLike)
        if str(name_or_path) in house_names():
            resource = _houses_folder() / f"{name_or_path}.txt"
            return cls.parse(resource.read_text(encoding="utf-8"), str(name_or_path), cell_size, damage)
        for source in SOURCES:
            if (made := source(str(name_or_path))) is not None:
                return cls.parse(made.text, made.name, cell_size, damage)
        path = pathlib.Path(name_or_path)
        try:
            text = read_file(path, LARGEST_PLAN).decode("utf-8-sig")  # some editors write a byte order mark
        except FileNotFoundError:
            raise FloorPlanError(
                f"no floor plan '{name_or_path}': neither a file nor one of {', '.join(house_names())}, "
                "nor generated as house-17 or test-100/17 are"
            ) from None
        except UnicodeDecodeError as error:
            raise FloorPlanError(f"floor plan '{name_or_path}' must be UTF-8, got other bytes: {error}") from None
        except (OSError, ValueError) as error:
            if getattr(error, "errno", None) == errno.EFBIG:
                size = f"at most {MOST_CELLS:,} cells, got a file of more than {LARGEST_PLAN:,} bytes"
                raise FloorPlanError(f"floor plan '{name_or_path}' must have {size}") from None
            raise FloorPlanError(f"floor plan '{name_or_path}' cannot be read: {error}") from None
        return cls.parse(text, visible(path.stem), cell_size, damage)

    @classmethod
    def parse(
        cls,
        text: str,
        name: str = "house",
        cell_size: float = DEFAULT_CELL_SIZE,
        damage: Mapping[str, float] | str = DamageWeights(),
    ) -> FloorPlan:
        """Parse the text of a plan: rows separated by newlines, ignoring blank lines before and after them.

        The cell size is in metres, the damage as `DamageWeights.of` takes it.

        Raises:
            FloorPlanError: The text is not a valid plan. The message names the problems and their places.
        """
        check_kind("the text of a floor plan", text, str)
        check_kind("the name of a floor plan", name, str)
        lines = [line.rstrip() for line in text.splitlines()]
        first = next((i for i, line in enumerate(lines) if line), None)
        if first is None:
            raise FloorPlanError(f"floor plan '{name}' line 1, column 1: the plan must not be empty")
        last = max(i for i, line in enumerate(lines) if line)
        if (cells := (last - first + 1) * max(map(len, lines))) > MOST_CELLS:
            raise FloorPlanError(f"floor plan '{name}' must have at most {MOST_CELLS:,} cells, got {cells:,}")
        if not (isinstance(cell_size, numbers.Real) and 0 < cell_size <= _LARGEST_CELL):
            raise FloorPlanError(
                f"floor plan '{name}': the cell size must be above 0 and at most {_LARGEST_CELL} m, so that a child "
                f"reaches what stands in the next cell, got {cell_size} m"
            )
        plan = cls(name, tuple(lines[first : last + 1]), float(cell_size), DamageWeights.of(damage))
        for problems in (_of_rows, _of_border, _of_cells):  # in order: later problems may follow from earlier ones
            if found := list(problems(plan, first + 1)):
                messages, excerpts = zip(*found, strict=True)
                raise FloorPlanError(*messages, excerpts=excerpts)
        return plan

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields only: cached properties would make a pickle a hundred times larger."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    # -- Contents --------------------------------------------------------------------------------

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.rows), len(self.rows[0])

    def __getitem__(self, cell: Cell) -> str:
        return self.rows[cell[0]][cell[1]]

    @property
    def text(self) -> str:
        """The plan as text, which `parse` accepts."""
        return "\n".join(self.rows)

    @functools.cached_property
    def symbols(self) -> np.ndarray:
        """The characters, (rows, columns)."""
        return np.array([list(row) for row in self.rows])

    def cells_of(self, *kinds: str) -> tuple[Cell, ...]:
        """Return all cells with one of the characters, in reading order."""
        return tuple((row, column) for row, column in np.argwhere(np.isin(self.symbols, kinds)).tolist())

    @functools.cached_property
    def free_cells(self) -> tuple[Cell, ...]:
        """The child's cells; an index into this tuple is its state."""
        return self.cells_of(*WALKABLE)

    @functools.cached_property
    def stairwells(self) -> tuple[Cell, ...]:
        return self._cells_at(Where.OPENING)

    @functools.cached_property
    def tables(self) -> tuple[Cell, ...]:
        """All tables, bare or not."""
        return self.cells_of(*(kind.symbol for kind in kinds_at(Where.ON_TABLE, Where.FURNITURE)))

    @functools.cached_property
    def candle_tables(self) -> tuple[int, ...]:
        """Index of the table on which each candle starts."""
        return tuple(map(self.tables.index, self._cells_at(Where.ON_TABLE)))

    @functools.cached_property
    def floor_cells(self) -> tuple[int, ...]:
        """Index of the free cell of each hazard on the floor."""
        return tuple(map(self.free_cells.index, self._cells_at(Where.FLOOR)))

    @functools.cached_property
    def bins(self) -> tuple[Cell, ...]:
        return self.cells_of(BIN)

    @functools.cached_property
    def hazards(self) -> Hazards:
        """All hazards that a caregiver can do something about."""
        kinds = kinds_at(Where.OPENING) + kinds_at(Where.ON_TABLE) + kinds_at(Where.FLOOR)
        return Hazards(tuple(kind for kind in kinds for _ in self.cells_of(kind.symbol)), self.damage)

    def _cells_at(self, where: Where) -> tuple[Cell, ...]:
        return tuple(cell for kind in kinds_at(where) for cell in self.cells_of(kind.symbol))

    @functools.cached_property
    def graph(self) -> CellGraph:
        """Moves and walking distances."""
        cells, objects = (self.free_cells, self.landings), (self.stairwells, self.tables, self.bins)
        return CellGraph(self.symbols, *cells, *objects, self.floor_cells, self.mouths)

    @functools.cached_property
    def caregiver_cells(self) -> tuple[Cell, ...]:
        """The cells in which the caregiver can stand: the free cells, then the landings that are not fenced."""
        return self.free_cells + self.landings

    @functools.cached_property
    def starts(self) -> np.ndarray:
        """Start cells of an episode: indices into `caregiver_cells` of those without a thing on the floor."""
        return np.setdiff1d(np.arange(len(self.caregiver_cells)), self.floor_cells)

    @functools.cached_property
    def cell_index(self) -> dict[Cell, int]:
        """Index of each cell in `caregiver_cells`, for free cells also in `free_cells`."""
        return {cell: i for i, cell in enumerate(self.caregiver_cells)}

    # -- Places in the house ---------------------------------------------------------------------

    def position(self, cell: Cell) -> np.ndarray:
        """Return the centre of a cell, (2,), in metres: x to the east, y to the north, origin in the plan's middle."""
        height, width = self.shape
        return np.array([cell[1] - (width - 1) / 2, (height - 1) / 2 - cell[0]]) * self.cell_size

    def cell_at(self, position: np.ndarray | Sequence[float]) -> Cell:
        """Return the cell of a point (2,) in metres; outside the plan, the nearest cell."""
        height, width = self.shape
        column = round(float(position[0]) / self.cell_size + (width - 1) / 2)
        row = round((height - 1) / 2 - float(position[1]) / self.cell_size)
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    @functools.cached_property
    def landings(self) -> tuple[Cell, ...]:
        """The stairwells in which the caregiver can stand, which are the first of `stairwells`."""
        return tuple(cell for cell in self.stairwells if self[cell] not in _FENCED)

    @functools.cached_property
    def posts(self) -> tuple[Cell, ...]:
        """The cell from which the caregiver guards each stairwell: its landing, or the cell before its gate."""
        return tuple(self.mouths.get(cell, cell) for cell in self.stairwells)

    @functools.cached_property
    def mouths(self) -> dict[Cell, Cell]:
        """The free cell from which each fenced landing is entered, opposite to its stairs."""
        pairs = zip(self.stairwells, self.stair_directions, strict=True)
        return {c: (c[0] - step[0], c[1] - step[1]) for c, step in pairs if step and self[c] in _FENCED}

    @functools.cached_property
    def stair_directions(self) -> tuple[Cell | None, ...]:
        """Direction of each stairwell's stairs: the step (row, column) from its landing into a wall, or None.

        Stairs are deeper than a wall and must not break into a room: the wall cell needs walls on both sides and only
        wall behind it; without one there is no direction. A wall opposite to a free cell is preferred, then an outer
        wall, then the order of `ACTIONS`. No two stairwells share a wall cell.
        """
        height, width = self.shape
        taken: set[Cell] = set()
        directions: list[Cell | None] = []
        for row, column in self.stairwells:
            best, best_rank = None, (-1, -1)
            for down, right in ACTIONS:
                there = (row + down, column + right)
                beside = ((there[0] + k * right, there[1] + k * down) for k in (-1, 0, 1))
                behind = (there[0] + down, there[1] + right)
                protrudes = 0 <= behind[0] < height and 0 <= behind[1] < width and not self.is_wall(behind)
                if there in taken or protrudes or not all(self.is_wall(cell) for cell in beside):
                    continue
                straight_on = (row - down, column - right) in self.free_neighbours((row, column))
                outer = there[0] in (0, height - 1) or there[1] in (0, width - 1)
                if (straight_on, outer) > best_rank:
                    best, best_rank = (down, right), (straight_on, outer)
            if best is not None:
                taken.add((row + best[0], column + best[1]))
            directions.append(best)
        return tuple(directions)

    def is_wall(self, cell: Cell) -> bool:
        """Return whether a cell is a wall of the plan."""
        height, width = self.shape
        return 0 <= cell[0] < height and 0 <= cell[1] < width and self[cell] == WALL

    def free_neighbours(self, cell: Cell) -> list[Cell]:
        """Return the free cells north, east, south and west of a cell, which is not on the border."""
        around = [(cell[0] + down, cell[1] + right) for down, right in ACTIONS]
        return [there for there in around if self[there] in WALKABLE]


def check_house(made: Any, plan: FloorPlan) -> None:
    """Raise CaregiverError unless a caregiver or a child was made for this house."""
    if not hasattr(made, "plan"):
        raise CaregiverError(
            f"{type(made).__name__} has no plan: its __init__ must call super().__init__ with the house, which keeps it"
        )
    if (made.plan.rows, made.plan.cell_size, made.plan.damage) != (plan.rows, plan.cell_size, plan.damage):
        other = " of other cells or damage" if made.plan.rows == plan.rows else ""
        raise CaregiverError(
            f"{type(made).__name__} must be made for house '{plan.name}', got one for '{made.plan.name}'{other}"
        )


def check_starts(plan: FloorPlan, children: int = 1) -> None:
    """Raise CaregiverError unless children and a robot can start in different cells."""
    cells, need = len(plan.starts), children + 1
    if not plan.landings and cells < need:
        raise CaregiverError(
            f"house '{plan.name}' must have at least {need} free cells, for children and robot, got {cells}"
        )


def house_names() -> tuple[str, ...]:
    """Return the names of the package's floor plans."""
    return tuple(sorted(f.name.removesuffix(".txt") for f in _houses_folder().iterdir() if f.name.endswith(".txt")))


def _houses_folder() -> Traversable:
    return importlib.resources.files("caregiver_mj.models") / "houses"


# -- Problems of a plan, which begins in line `first_line` of its text, from 1 ----------------------------


def _at(plan: FloorPlan, first_line: int, cell: Cell, problem: str) -> _Problem:
    row, column = cell
    line = str(row + first_line)
    first = max(0, column - _EXCERPT // 2)
    # Non-ASCII characters may be wide, or change the direction of text.
    shown = "".join(one if " " <= one <= "~" else "?" for one in plan.rows[row][first : first + _EXCERPT])
    excerpt = f"{line} | {shown}\n{' ' * len(line)} | {' ' * (column - first)}^"
    return f"floor plan '{plan.name}' line {line}, column {column + 1}: {problem}", excerpt


def _of_rows(plan: FloorPlan, first_line: int) -> Iterator[_Problem]:
    ((width, _),) = collections.Counter(map(len, plan.rows)).most_common(1)
    legend = ", ".join(f"{k} ({n})" for k, (n, _) in LEGEND.items())
    for r, row in enumerate(plan.rows):
        wrong = [c for c, kind in enumerate(row) if kind not in LEGEND]
        if wrong:
            problem = f"{row[wrong[0]]!r} is none of {legend}{_and_more(wrong)}"
            yield _at(plan, first_line, (r, wrong[0]), problem)
        elif len(row) != width:
            problem = f"the row has {len(row)} cells, but most have {width}"
            yield _at(plan, first_line, (r, min(len(row), width)), problem)


def _of_border(plan: FloorPlan, first_line: int) -> Iterator[_Problem]:
    border = np.ones(plan.shape, bool)
    border[1:-1, 1:-1] = False
    open_ = border & (plan.symbols != WALL)
    for row in np.flatnonzero(open_.any(axis=1)).tolist():
        wrong = np.flatnonzero(open_[row]).tolist()
        kind = plan[row, wrong[0]]
        problem = f"the border must be all wall (#), and here is a {LEGEND[kind][0]} ({kind}){_and_more(wrong)}"
        yield _at(plan, first_line, (row, wrong[0]), problem)
    if not plan.cells_of(FREE):
        yield _at(plan, first_line, (0, 0), "the plan has no free cell (.)")


def _and_more(wrong: list[int]) -> str:
    """Return the end of a message about the first of some wrong cells of a row."""
    return f", and {len(wrong) - 1} more in this line" if len(wrong) > 1 else ""


def _of_cells(plan: FloorPlan, first_line: int) -> Iterator[_Problem]:
    start, cut_off = plan.free_cells[0], np.flatnonzero(plan.graph.child_distances_from([0])[0] == UNREACHABLE).tolist()
    if cut_off:
        more = f", nor are {len(cut_off) - 1} more" if len(cut_off) > 1 else ""
        origin = f"line {start[0] + first_line}, column {start[1] + 1}"
        problem = f"this free cell is not connected to the one at {origin}{more}"
        yield _at(plan, first_line, plan.free_cells[cut_off[0]], problem)
    for cell in plan.cells_of(*LEGEND.keys() - {WALL, *WALKABLE}):
        if not plan.free_neighbours(cell):
            problem = f"this {LEGEND[plan[cell]][0]} ({plan[cell]}) cannot be reached: no free cell is beside it"
            yield _at(plan, first_line, cell, problem)
    height, width = plan.shape
    for cell, step in zip(plan.stairwells, plan.stair_directions, strict=True):
        if plan[cell] in _FENCED and (step is None or (cell[0] - step[0], cell[1] - step[1]) not in plan.cell_index):
            problem = (
                "has no way in: its stairs must go down into a wall opposite to a free cell, with wall on both sides "
                "of that wall and none but wall behind it"
            )
            yield _at(plan, first_line, cell, f"this {LEGEND[plan[cell]][0]} ({plan[cell]}) {problem}")
    everywhere = f"in lines {first_line} to {first_line + height - 1}, columns 1 to {width}"
    if not plan.bins:
        yield f"floor plan '{plan.name}' has no toy bin (B) {everywhere}: the child has nowhere to go", ""
    if plan.candle_tables and len(plan.candle_tables) == len(plan.tables):
        things = " or ".join(dict.fromkeys(hazard.kind.name for hazard in plan.hazards.at(Where.ON_TABLE)))
        problem = f"has no bare table ({TABLE.symbol}) {everywhere}: there is nowhere to take a {things}"
        yield f"floor plan '{plan.name}' {problem}", ""
