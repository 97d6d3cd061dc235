"""Metric geometry of a floor plan: where its walls, furniture and stairs lie on the ground, in metres.

The scene is built from these shapes and the robot plans its paths round them. A shape is a rectangle
``[x_centre, y_centre, half_x, half_y]``, parallel to the axes; many of them are an array (n, 4).

A wall of the plan fills a whole cell, one of the house is thin. Every cell is therefore split into 3 x 3 parts,
the middle one as wide as a wall, and only the parts that connect neighbouring walls are solid.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib.resources
from xml.etree import ElementTree

import numpy as np
from scipy import ndimage

from caregiver_mj.plans.cell_graph import ACTIONS, BIN, FREE, WALL, Cell
from caregiver_mj.plans.floor_plan import FloorPlan

WALL_THICKNESS = 0.25  # metres, as of a brick wall
WALL_HEIGHT = 0.90  # metres; cut low like a doll's house, so that cameras see in


def __getattr__(name: str) -> float:
    """Return sizes of the furniture in metres, read from its models when they are first asked for and not at import."""
    if name == "TABLE_HALF_SIZE":
        value = table().half_size
    elif name == "TABLE_HEIGHT":
        value = table().height
    elif name == "BIN_HALF_SIZE":
        value = toy_bin().half_size
    else:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    globals()[name] = value
    return value


def wall_thickness(plan: FloorPlan) -> float:
    """Return the thickness of a plan's walls in metres: at most a third of a cell."""
    return min(WALL_THICKNESS, plan.cell_size / 3)


def wall_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the solid parts of all walls, (n, 4), disjoint. Openings for stairs are left out."""
    return _rectangles(_solid(plan), *_part_edges(plan))


def table_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the footprints of all tables in the order of `plan.tables`, (n, 4)."""
    return _squares(plan, plan.tables, table().half_size)


def bin_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the footprints of all toy bins in the order of `plan.bins`, (n, 4)."""
    return _squares(plan, plan.bins, toy_bin().half_size)


def furniture_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the footprints of all tables, then all toy bins, (n, 4)."""
    return np.concatenate([table_rectangles(plan), bin_rectangles(plan)])


def stair_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the openings in which stairs go down, (n, 4); nothing on wheels may enter them."""
    return _squares(plan, _alcoves(plan), plan.cell_size / 2)


def obstacle_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return everything that a wheeled base must keep clear of, (n, 4): walls, furniture and stairs."""
    return np.concatenate([wall_rectangles(plan), furniture_rectangles(plan), stair_rectangles(plan)])


def floor_rectangles(plan: FloorPlan) -> np.ndarray:
    """Return the floor of the house, also under its walls and furniture, (n, 4), disjoint. Stairs are holes in it."""
    return _rectangles(~_outside(plan) & ~_at_alcove(plan), *_part_edges(plan))


def ground_rectangles(plan: FloorPlan, margin: float) -> np.ndarray:
    """Return the ground outside of the house as far as `margin` metres from the plan's border, (n, 4), disjoint."""
    x, y = (np.concatenate([[e[0]], e, [e[-1]]]) for e in _part_edges(plan))
    x[[0, -1]] += [-margin, margin]
    y[[0, -1]] += [margin, -margin]
    return _rectangles(np.pad(_outside(plan), 1, constant_values=True), x, y)


def stair_directions(plan: FloorPlan) -> tuple[Cell | None, ...]:
    """Return where the stairs of each stairwell go down: the step (row, column) from its landing into a wall.

    The wall cell must have walls to both sides and none but wall behind it, so that the stairs do not break into a
    room; being deeper than a wall is thick, they would stick out of its other face. A wall opposite to
    a free cell is preferred (one walks straight on), then an outer wall, then the order of `ACTIONS`. A stairwell
    without such a wall has None; no two have the same wall cell.
    """
    height, width = plan.shape
    taken: set[Cell] = set()
    directions: list[Cell | None] = []
    for row, column in plan.stairwells:
        best, best_rank = None, (-1, -1)
        for down, right in ACTIONS:
            there = (row + down, column + right)
            beside = ((there[0] + k * right, there[1] + k * down) for k in (-1, 0, 1))
            behind = (there[0] + down, there[1] + right)
            protrudes = 0 <= behind[0] < height and 0 <= behind[1] < width and not _is_wall(plan, behind)
            if there in taken or protrudes or not all(_is_wall(plan, cell) for cell in beside):
                continue
            straight_on = (row - down, column - right) in plan.free_neighbours((row, column))
            outer = there[0] in (0, height - 1) or there[1] in (0, width - 1)
            if (straight_on, outer) > best_rank:
                best, best_rank = (down, right), (straight_on, outer)
        if best is not None:
            taken.add((row + best[0], column + best[1]))
        directions.append(best)
    return tuple(directions)


def doorways(plan: FloorPlan) -> tuple[tuple[Cell, Cell], ...]:
    """Return free cells that lead through a wall, each with the step (row, column) along which one passes it.

    Walls are on two opposite sides, none on the others. The cells of a narrow corridor are no doorways.
    """
    passages = {
        (cell, (down, right))
        for cell in plan.free_cells
        for down, right in ((1, 0), (0, 1))
        if all(_is_wall(plan, (cell[0] + k * right, cell[1] + k * down)) for k in (-1, 1))
        and not any(_is_wall(plan, (cell[0] + k * down, cell[1] + k * right)) for k in (-1, 1))
    }
    return tuple(
        sorted(
            (cell, (down, right))
            for cell, (down, right) in passages
            if not any(((cell[0] + k * down, cell[1] + k * right), (down, right)) in passages for k in (-1, 1))
        )
    )


def rooms(plan: FloorPlan) -> tuple[np.ndarray, ...]:
    """Return the rooms between walls and doorways, each a mask (rows, columns) of its cells, furnished or not."""
    inside = ~_wall_mask(plan)
    for cell, _ in doorways(plan):
        inside[cell] = False
    labels, count = ndimage.label(inside)
    return tuple(labels == i for i in range(1, count + 1))


def largest_rectangle(mask: np.ndarray) -> tuple[Cell, Cell]:
    """Return the first and the last cell of a largest rectangle within a mask (rows, columns) that has a true cell."""
    best_size, best = 0, ((0, 0), (0, 0))
    for top in range(len(mask)):
        columns = np.ones(mask.shape[1], bool)
        for bottom in range(top, len(mask)):
            columns &= mask[bottom]
            if not columns.any():
                break
            for start, end in _runs(columns):
                if (size := (end - start) * (bottom - top + 1)) > best_size:
                    best_size, best = size, ((top, start), (bottom, end - 1))
    return best


def wall_places(plan: FloorPlan) -> list[tuple[np.ndarray, float]]:
    """Return places for decorations: points (2,) at the foot of a wall, in metres, and the yaw that faces the room.

    Each has (cell - wall) / 2 of depth before the cell of the room begins, and is a cell wide. Walls to the south
    of a room have none, as the overview camera sees only their backs.
    """
    alcoves, no_place = _alcoves(plan), {cell for cell, _ in doorways(plan)}
    half_wall = wall_thickness(plan) / 2
    places = []
    for cell in sorted((*plan.cells_of(FREE, BIN), *plan.tables)):
        for down, right in ((-1, 0), (0, 1), (0, -1)):
            wall = (cell[0] + down, cell[1] + right)
            beside = [(wall[0] + k * right, wall[1] + k * down) for k in (-1, 0, 1)]
            if cell in no_place or any(not _is_wall(plan, w) or w in alcoves for w in beside):
                continue
            inwards = np.array([-right, down])  # x and y
            places.append((plan.position(wall) + half_wall * inwards, float(np.arctan2(inwards[1], inwards[0]))))
    return places


def _is_wall(plan: FloorPlan, cell: Cell) -> bool:
    height, width = plan.shape
    return 0 <= cell[0] < height and 0 <= cell[1] < width and plan[cell] == WALL


def _wall_mask(plan: FloorPlan) -> np.ndarray:
    """Mask (rows, columns) of the wall cells."""
    return np.array([list(row) for row in plan.rows]) == WALL


def _alcoves(plan: FloorPlan) -> tuple[Cell, ...]:
    """The wall cells in which stairs go down."""
    pairs = zip(plan.stairwells, stair_directions(plan), strict=True)
    return tuple((cell[0] + step[0], cell[1] + step[1]) for cell, step in pairs if step is not None)


def _at_alcove(plan: FloorPlan) -> np.ndarray:
    """Mask (3 rows, 3 columns) of the parts that belong to stairs."""
    mask = np.zeros(plan.shape, bool)
    for cell in _alcoves(plan):
        mask[cell] = True
    return mask.repeat(3, axis=0).repeat(3, axis=1)


def _solid(plan: FloorPlan) -> np.ndarray:
    """Mask (3 rows, 3 columns) of the parts that are solid wall.

    A part at an edge of its cell is solid if the neighbour there is wall too, a part in a corner if all three
    neighbours there are. Neighbours of stairs treat them as wall, so that their walls reach up to them.
    """
    wall = _wall_mask(plan)
    height, width = wall.shape
    padded = np.pad(wall, 1)

    def neighbour(down: int, right: int) -> np.ndarray:
        return padded[1 + down : 1 + down + height, 1 + right : 1 + right + width]

    solid = np.zeros((3 * height, 3 * width), bool)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            solid[1 + down :: 3, 1 + right :: 3] = (
                wall & neighbour(down, 0) & neighbour(0, right) & neighbour(down, right)
            )
    return solid & ~_at_alcove(plan)


def _outside(plan: FloorPlan) -> np.ndarray:
    """Mask (3 rows, 3 columns) of the parts of the plan that lie outside of the house's walls."""
    passable = np.pad(~_solid(plan) & ~_at_alcove(plan), 1, constant_values=True)
    labels, _ = ndimage.label(passable)
    return (labels == labels[0, 0])[1:-1, 1:-1]


def _part_edges(plan: FloorPlan) -> tuple[np.ndarray, np.ndarray]:
    """Borders between the parts of cells: x (3 columns + 1,) ascending, y (3 rows + 1,) descending, in metres."""
    half_wall = wall_thickness(plan) / 2

    def edges(count: int) -> np.ndarray:
        centres = (np.arange(count) - (count - 1) / 2) * plan.cell_size
        parts = centres[:, None] + [-plan.cell_size / 2, -half_wall, half_wall]
        return np.append(parts, count * plan.cell_size / 2)

    height, width = plan.shape
    return edges(width), -edges(height)


def _rectangles(mask: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Covers the true parts of a mask with few disjoint rectangles: runs along rows, alike ones of rows merged.

    Args:
        mask: Parts to cover, (rows, columns).
        x: Borders of the columns, (columns + 1,).
        y: Borders of the rows, (rows + 1,).

    Returns:
        Rectangles (n, 4).
    """
    found = []
    growing: dict[tuple[int, int], int] = {}  # (first column, end column) -> first row
    for row, parts in enumerate(np.pad(mask, ((0, 1), (0, 0)))):
        runs = _runs(parts)
        for run in [run for run in growing if run not in runs]:
            found.append((x[run[0]], x[run[1]], y[growing.pop(run)], y[row]))
        for run in runs:
            growing.setdefault(run, row)
    x0, x1, y0, y1 = np.array(found).reshape(-1, 4).T
    return np.stack([(x0 + x1) / 2, (y0 + y1) / 2, np.abs(x1 - x0) / 2, np.abs(y1 - y0) / 2], axis=1)


def _runs(parts: np.ndarray) -> list[tuple[int, int]]:
    """First and end index of every run of true values."""
    change = np.diff(np.pad(parts, 1).astype(np.int8))
    return list(zip(np.flatnonzero(change == 1).tolist(), np.flatnonzero(change == -1).tolist(), strict=True))


def _squares(plan: FloorPlan, cells: tuple[Cell, ...], half_size: float) -> np.ndarray:
    """Squares in the middle of cells, (n, 4)."""
    return np.array([[*plan.position(cell), half_size, half_size] for cell in cells]).reshape(-1, 4)


@dataclasses.dataclass(frozen=True)
class Candle:
    """A candle that stands upright.

    Attributes:
        radius: Metres.
        height: Metres.
    """

    radius: float
    height: float


@dataclasses.dataclass(frozen=True)
class Box:
    """A piece of furniture that stands on the floor, square and solid.

    Attributes:
        half_size: Half the length of its sides, metres.
        height: Metres.
    """

    half_size: float
    height: float


@functools.cache
def candle() -> Candle:
    """Return the candle of `models/candle.xml`."""
    radius, half_height = _size("candle", "wax")
    return Candle(radius, 2 * half_height)


@functools.cache
def table() -> Box:
    """Return the table of `models/table.xml`."""
    return _box("table", "top")


@functools.cache
def toy_bin() -> Box:
    """Return the toy bin of `models/toy_bin.xml`."""
    return _box("toy_bin", "box")


@functools.cache
def toddler_radius() -> float:
    """Return the radius of the toddler of `models/toddler.xml`, metres."""
    return _size("toddler", "body")[0]


def _box(model: str, geom: str) -> Box:
    half_size, _, half_height = _size(model, geom)
    return Box(half_size, 2 * half_height)


def _size(model: str, geom: str) -> tuple[float, ...]:
    """What a geom of a model says of its size, metres; what it means depends on its type."""
    file = importlib.resources.files("caregiver_mj.models") / f"{model}.xml"
    (found,) = ElementTree.fromstring(file.read_text(encoding="utf-8")).findall(f".//worldbody//geom[@name='{geom}']")
    return tuple(float(number) for number in found.attrib["size"].split())
