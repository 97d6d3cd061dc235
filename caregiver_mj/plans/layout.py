"""Metric geometry of a floor plan: the footprints of its walls, furniture and stairs.

The scene consists of these shapes, and the robot plans its paths round them. A shape is an axis-parallel rectangle
``[x_centre, y_centre, half_x, half_y]`` in metres; several are an array (n, 4).

A wall of the plan fills a whole cell, but the house's walls are thin. Every cell is therefore split into 3 x 3 parts,
the middle one as wide as a wall; only the parts that connect neighbouring walls are solid.
"""

from __future__ import annotations

import functools
import importlib.resources
import itertools
import math
from collections.abc import Collection
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from caregiver_mj.plans.cell_graph import WALL, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import HazardKind, Where

WALL_THICKNESS = 0.25  # m; a brick wall
GATE_OPEN, GATE_SHUT = math.radians(78.0), math.radians(1.0)  # rad; initial angle of gates, greatest angle if latched
WALL_HEIGHT = 0.90  # m; low, so that cameras see into the house
CEILING = 2.4  # m above the floor; height of ceiling cameras
_IN_SIGHT: tuple[Cell, ...] = (-1, 0), (0, 1), (0, -1)  # steps into walls whose faces the overview camera sees


def _find(model: str, tag: str, name: str) -> ElementTree.Element:
    (found,) = _model(model).findall(f".//worldbody//{tag}[@name='{name}']")
    return found


@functools.cache
def _model(name: str) -> ElementTree.Element:
    file = importlib.resources.files("caregiver_mj.models") / f"{name}.xml"
    return ElementTree.fromstring(file.read_text(encoding="utf-8"))


def _numbers(element: ElementTree.Element, attribute: str) -> tuple[float, ...]:
    return tuple(float(number) for number in element.attrib[attribute].split())


def _size(model: str, geom: str, number: int = 0) -> float:
    return _numbers(_find(model, "geom", geom), "size")[number]


TABLE_HALF_SIZE = _size("table", "top")
TABLE_HEIGHT = 2 * _size("table", "top", 2)
TABLE_MARGIN = 0.03  # m; error of a table's place on the robot's map
BIN_HALF_SIZE = _size("toy_bin", "box")
CANDLE_RADIUS = _size("candle", "wax")
THING_RADIUS = _size("battery", "side_0")
CHILD_RADIUS = _size("toddler", "body")


class Thing(NamedTuple):
    """Dimensions of a thing to carry, m."""

    radius: float  # radius of the upright cylinder to grip
    height: float  # height of its top above its foot
    width: float  # radius of its widest upright cylinder
    grip: float  # height of the grip above its foot


@functools.cache
def thing(kind: HazardKind) -> Thing:
    """Return the dimensions of a kind of thing on tables, from its model."""
    cylinders = _model(kind.model).findall("./worldbody/body/geom[@type='cylinder']")
    sizes = [_numbers(geom, "size") for geom in cylinders if geom.get("class") != "visual"]
    (radius, half_height), (_, _, middle) = sizes[0], _numbers(cylinders[0], "pos")
    return Thing(radius, middle + half_height, max(size[0] for size in sizes), kind.grip)


def things(plan: FloorPlan) -> tuple[Thing, ...]:
    """Return the dimensions of all things on a plan's tables, in the order of `plan.candle_tables`."""
    return tuple(thing(hazard.kind) for hazard in plan.hazards.at(Where.ON_TABLE))


class Gate(NamedTuple):
    """A gate, in the frame of its landing's centre: x towards the stairs, y to the left, m."""

    hinge: tuple[float, float]  # (x, y); the closed panel extends from there towards -y
    length: float  # of the panel, from the hinge
    height: float  # of its top above the floor


@functools.cache
def gate() -> Gate:
    """Return the gate of `models/gate.xml`."""
    panel = _find("gate", "body", "panel")
    x, y, _ = _numbers(panel, "pos")
    (board,) = panel.findall("./geom[@name='panel']")
    (_, middle, up), (_, half_length, half_height) = _numbers(board, "pos"), _numbers(board, "size")
    return Gate((x, y), half_length - middle, up + half_height)


def gate_frames(plan: FloorPlan) -> list[tuple[float, float, float]]:
    """Return the frames of the landings behind gates, as of `Gate`: x and y, m, and the yaw of the way down, rad."""
    pairs = ((plan.position(cell).tolist(), cell, mouth) for cell, mouth in plan.mouths.items())
    return [(x, y, math.atan2(mouth[0] - cell[0], cell[1] - mouth[1])) for (x, y), cell, mouth in pairs]


class Stretch(NamedTuple):
    """A straight stretch of an outer wall, seen from a room."""

    room: int  # number of the room
    outwards: Cell  # the step (row, column) from the room into the wall
    cells: tuple[Cell, ...]  # the wall's cells, side by side

    def split(self, length: int, random: np.random.Generator) -> tuple[Stretch, Stretch, Stretch]:
        """Return the parts before, in and after a random stretch of `length` cells."""
        begin = int(random.integers(len(self.cells) - length + 1))
        ends = 0, begin, begin + length, len(self.cells)
        before, taken, after = (self._replace(cells=self.cells[i:k]) for i, k in itertools.pairwise(ends))
        return before, taken, after


class Layout:
    """The shapes of a house, computed on first use; the arrays must not be changed."""

    def __init__(self, plan: FloorPlan):
        self.plan = plan
        self.wall_thickness = min(WALL_THICKNESS, plan.cell_size / 3)  # m
        self._wall = plan.symbols == WALL

    @functools.cached_property
    def walls(self) -> np.ndarray:
        """The solid parts of all walls, without openings for stairs, (n, 4), disjoint."""
        return _rectangles(self._solid, *self._part_edges)

    @functools.cached_property
    def tables(self) -> np.ndarray:
        """The footprints of all tables in the order of `plan.tables`, (n, 4)."""
        return self._squares(self.plan.tables, TABLE_HALF_SIZE)

    @functools.cached_property
    def bins(self) -> np.ndarray:
        """The footprints of all toy bins in the order of `plan.bins`, (n, 4)."""
        return self._squares(self.plan.bins, BIN_HALF_SIZE)

    @functools.cached_property
    def stairs(self) -> np.ndarray:
        """The openings of stairs, (n, 4), which wheels must not enter."""
        return self._squares(self._alcoves, self.plan.cell_size / 2)

    @property
    def high(self) -> np.ndarray:
        """Obstacles at the height of a carried candle, (n, 4): walls, and the panels beside stairs."""
        return np.concatenate([self.walls, self.stairs])

    @property
    def obstacles(self) -> np.ndarray:
        """Obstacles of a wheeled base, (n, 4): walls, furniture, stairs and fences."""
        return np.concatenate([self.walls, self.tables, self.bins, self.stairs, self.fenced])

    @functools.cached_property
    def fenced(self) -> np.ndarray:
        """The landings between fences, gates included, in the order of `plan.mouths`, (n, 4)."""
        return self._squares(tuple(self.plan.mouths), self.plan.cell_size / 2)

    @property
    def floor(self) -> np.ndarray:
        """The floor of the house, also under walls and furniture, without stairs, (n, 4), disjoint."""
        return _rectangles(~self._outside & ~self._at_alcove, *self._part_edges)

    def ground(self, margin: float) -> np.ndarray:
        """Return the ground outside the house, up to `margin` metres from the plan's border, (n, 4), disjoint."""
        x, y = (np.concatenate([[e[0]], e, [e[-1]]]) for e in self._part_edges)
        x[[0, -1]] += [-margin, margin]
        y[[0, -1]] += [margin, -margin]
        return _rectangles(np.pad(self._outside, 1, constant_values=True), x, y)

    @functools.cached_property
    def doorways(self) -> tuple[tuple[Cell, Cell], ...]:
        """Free cells that lead through a wall, each with the step (row, column) along which it is passed.

        They have walls on two opposite sides only. The cells of a narrow corridor are no doorways.
        """

        def around(cell: Cell, down: int, right: int) -> list[Cell]:
            return [(cell[0] + k * down, cell[1] + k * right) for k in (-1, 1)]

        passages = {
            (cell, (down, right))
            for cell in self.plan.free_cells
            for down, right in ((1, 0), (0, 1))
            if all(map(self.plan.is_wall, around(cell, right, down)))
            and not any(map(self.plan.is_wall, around(cell, down, right)))
        }
        alone = (
            (cell, step) for cell, step in passages if not any((near, step) in passages for near in around(cell, *step))
        )
        return tuple(sorted(alone))

    @functools.cached_property
    def rooms(self) -> tuple[np.ndarray, ...]:
        """The rooms between walls and doorways, each a mask (rows, columns) of its cells."""
        inside = ~self._wall
        for cell, _ in self.doorways:
            inside[cell] = False
        part, count = _parts(inside)
        return tuple(part == i for i in range(1, count + 1))

    def wall_places(self) -> list[tuple[np.ndarray, float]]:
        """Return places for decorations: points (2,), m, at the foot of a wall, and the yaw that faces the room.

        Each is a cell wide and (cell - wall) / 2 deep. Walls to the south of a room have none: the overview camera sees
        only their backs.
        """
        plan, places = self.plan, []
        cells = {*plan.free_cells, *plan.bins, *plan.tables} - {cell for cell, _ in self.doorways}
        for cell, outwards in itertools.product(sorted(cells), _IN_SIGHT):
            wall = (cell[0] + outwards[0], cell[1] + outwards[1])
            if self._is_straight(wall, outwards):
                places.append(self._at_face(plan.position(wall), outwards))
        return places

    @functools.cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The stretches of outer walls, except to the south, without stairs and ends of walls."""
        found: list[Stretch] = []
        for (number, room), (down, right) in itertools.product(enumerate(self.rooms), _IN_SIGHT):
            cells = [(row + down, column + right) for row, column in np.argwhere(room).tolist()]
            outer = [cell for cell in cells if self._is_outer(cell, (down, right))]
            previous: Cell | None = None
            for cell in sorted(outer, key=lambda cell: cell if down else cell[::-1]):
                if previous != (cell[0] - abs(right), cell[1] - abs(down)):
                    found.append(Stretch(number, (down, right), ()))
                found[-1] = found[-1]._replace(cells=(*found[-1].cells, cell))
                previous = cell
        return tuple(found)

    def _is_outer(self, wall: Cell, outwards: Cell) -> bool:
        """Return whether a cell is straight wall with only the outside behind it."""
        parts = self._outside[3 * wall[0] : 3 * wall[0] + 3, 3 * wall[1] : 3 * wall[1] + 3]
        edge = parts[0] if outwards[0] else parts[:, 1 + outwards[1]]
        return self._is_straight(wall, outwards) and bool(edge.all())

    def _is_straight(self, wall: Cell, outwards: Cell) -> bool:
        """Return whether a cell is wall without stairs, and those on both sides of it are, too."""
        down, right = outwards
        beside = ((wall[0] + k * right, wall[1] + k * down) for k in (0, -1, 1))  # most are not even wall
        return all(self.plan.is_wall(cell) and cell not in self._alcoves for cell in beside)

    def face(self, stretch: Stretch) -> tuple[np.ndarray, float]:
        """Return the middle of a stretch at the foot of the wall's face, (2,), m, and the yaw that faces the room."""
        middle = np.mean([self.plan.position(cell) for cell in stretch.cells], axis=0)
        return self._at_face(middle, stretch.outwards)

    def _at_face(self, middle: np.ndarray, outwards: Cell) -> tuple[np.ndarray, float]:
        inwards = np.array([-outwards[1], outwards[0]])  # x and y
        return middle + self.wall_thickness / 2 * inwards, float(np.arctan2(*inwards[::-1]))

    def walls_without(self, cells: Collection[Cell]) -> np.ndarray:
        """Return `walls` without those in some cells, (n, 4)."""
        solid = self._solid.copy()
        for row, column in cells:
            solid[3 * row : 3 * row + 3, 3 * column : 3 * column + 3] = False
        return _rectangles(solid, *self._part_edges)

    def corners(self) -> list[tuple[np.ndarray, float]]:
        """Return the corners of the rooms: points (2,) at the foot of both walls, m, and the yaw between them.

        Nobody enters the square of (cell - wall) / 2 before one.
        """
        plan, found = self.plan, []
        taken = {cell for cell, _ in self.doorways} | set(plan.stairwells)
        reach = plan.cell_size - self.wall_thickness / 2
        for cell in sorted(set(plan.free_cells) - taken):
            for down, right in itertools.product((-1, 1), repeat=2):
                walls = [(cell[0] + down, cell[1]), (cell[0], cell[1] + right), (cell[0] + down, cell[1] + right)]
                if all(plan.is_wall(wall) and wall not in self._alcoves for wall in walls):
                    inwards = np.array([-right, down])
                    found.append((plan.position(cell) - reach * inwards, float(np.arctan2(*inwards[::-1]))))
        return found

    def room_floor(self, room: int) -> np.ndarray:
        """Return the floor of a room up to its walls, (n, 4), disjoint."""
        near = np.pad(self.rooms[room].repeat(3, axis=0).repeat(3, axis=1), 1)
        height, width = near.shape
        wider = np.any([near[i : height - 2 + i, k : width - 2 + k] for i in range(3) for k in range(3)], axis=0)
        return _rectangles(wider & ~self._solid & ~self._at_alcove, *self._part_edges)

    @functools.cached_property
    def _alcoves(self) -> tuple[Cell, ...]:
        """The wall cells of stairs."""
        pairs = zip(self.plan.stairwells, self.plan.stair_directions, strict=True)
        return tuple((cell[0] + step[0], cell[1] + step[1]) for cell, step in pairs if step is not None)

    @functools.cached_property
    def _at_alcove(self) -> np.ndarray:
        """Mask of the parts of stairs, (3 rows, 3 columns)."""
        mask = np.zeros(self.plan.shape, bool)
        for cell in self._alcoves:
            mask[cell] = True
        return mask.repeat(3, axis=0).repeat(3, axis=1)

    @functools.cached_property
    def _solid(self) -> np.ndarray:
        """Mask of the solid parts, (3 rows, 3 columns).

        A part at an edge of its cell is solid if the neighbour there is a wall, one in a corner if all three neighbours
        are. For neighbours stairs count as wall, so that walls reach up to them.
        """
        height, width = self._wall.shape
        padded = np.pad(self._wall, 1)

        def neighbour(down: int, right: int) -> np.ndarray:
            return padded[1 + down : 1 + down + height, 1 + right : 1 + right + width]

        solid = np.zeros((3 * height, 3 * width), bool)
        for down, right in itertools.product((-1, 0, 1), repeat=2):
            around = self._wall & neighbour(down, 0) & neighbour(0, right) & neighbour(down, right)
            solid[1 + down :: 3, 1 + right :: 3] = around
        return solid & ~self._at_alcove

    @functools.cached_property
    def _outside(self) -> np.ndarray:
        """Mask of the parts outside the house's walls, (3 rows, 3 columns)."""
        part, _ = _parts(np.pad(~self._solid & ~self._at_alcove, 1, constant_values=True))
        return (part == part[0, 0])[1:-1, 1:-1]

    @functools.cached_property
    def _part_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Borders between the parts of cells: x (3 columns + 1,) ascending, y (3 rows + 1,) descending, m."""
        half_wall, half_cell = self.wall_thickness / 2, self.plan.cell_size / 2

        def edges(count: int) -> np.ndarray:
            centres = (np.arange(count) - (count - 1) / 2) * self.plan.cell_size
            return np.append(centres[:, None] + [-half_cell, -half_wall, half_wall], count * half_cell)

        height, width = self.plan.shape
        return edges(width), -edges(height)

    def _squares(self, cells: tuple[Cell, ...], half_size: float) -> np.ndarray:
        """Return squares in the middle of cells, (n, 4)."""
        return np.array([[*self.plan.position(cell), half_size, half_size] for cell in cells]).reshape(-1, 4)


def _parts(mask: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the number of each cell's connected part of a mask, from 1 (0 outside), and the number of parts."""
    from scipy import ndimage  # imported here because it is slow

    return ndimage.label(mask)


def largest_rectangle(mask: np.ndarray) -> tuple[Cell, Cell]:
    """Return the first and the last cell of a largest rectangle within a mask (rows, columns) with a true cell."""
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


def _rectangles(mask: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return few disjoint rectangles (n, 4) that cover a mask: runs along rows, merged across rows.

    `x`, (columns + 1,), and `y`, (rows + 1,), are the borders of its columns and rows.
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
    """Return the first and end index of every run of true values."""
    padded = np.zeros(len(parts) + 2, bool)  # several times as fast as `np.pad`
    padded[1:-1] = parts
    change = np.flatnonzero(padded[1:] != padded[:-1]).tolist()
    return list(zip(change[::2], change[1::2], strict=True))
