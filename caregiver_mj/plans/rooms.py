"""Rooms of generated houses: recursive splitting into rooms of varied sizes, sometimes along a corridor."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.plans.cell_graph import FREE, WALL, Cell
from caregiver_mj.plans.request import draw, pick

_CORRIDOR_SHARE = 60  # % of houses of more than three rooms have a corridor
_BEYOND_SHARE = 50  # % of those of more than four rooms have rooms beyond the corridor's end
_WIDE_CORRIDOR_SHARE = 70  # % of corridors are two cells wide; the others one
_SLIMMEST = 3  # preferred greatest ratio of a room's length to its width
_TWO_CELLS_SHARE = 35  # % of doorways in long walls are two cells wide
_WIDE_WALL = 4  # cells; least length of a wall for a doorway of two cells
_LOOP_SHARE = 15  # % of the walls that need no doorway have one
_DETOUR = 150  # extra cost of a doorway that leads neither to the corridor nor to the largest room (random cost: 100)


@dataclasses.dataclass(frozen=True)
class Room:
    """A rectangle of cells between walls, including its last row and column."""

    top: int
    left: int
    bottom: int
    right: int
    is_corridor: bool = False

    @property
    def sides(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top + 1, self.right - self.left + 1

    @property
    def area(self) -> int:
        """Number of cells."""
        return self.sides[0] * self.sides[1]

    @property
    def inside(self) -> tuple[slice, slice]:
        """Slices of an array (rows, columns)."""
        return slice(self.top, self.bottom + 1), slice(self.left, self.right + 1)

    def part(self, axis: int, first: int, length: int, is_corridor: bool = False) -> Room:
        """Return `length` of its rows (axis 0) or columns (1), from number `first` of its own."""
        if axis == 0:
            return Room(self.top + first, self.left, self.top + first + length - 1, self.right, is_corridor)
        return Room(self.top, self.left + first, self.bottom, self.left + first + length - 1, is_corridor)


def split(random: np.random.RandomState, shape: tuple[int, int], count: int, smallest: int) -> list[Room] | None:
    """Divide a house into `count` rooms, a corridor included, with walls of one cell; None without enough space.

    The shorter side of a room has at least `smallest` cells; a corridor may be narrower.
    """
    rooms = [Room(1, 1, shape[0] - 2, shape[1] - 2)]
    if count > 3 and draw(random, 100) < _CORRIDOR_SHARE:
        rooms = _with_corridor(random, rooms[0], count, smallest) or rooms
    while len(rooms) < count:
        large = [room for room in rooms if not room.is_corridor and max(room.sides) > 2 * smallest]
        if not large:
            return None
        room = pick(random, large, [room.area * max(room.sides) ** 2 for room in large])
        rooms.remove(room)
        rooms += _halves(random, room, smallest)
    return rooms


def _halves(random: np.random.RandomState, room: Room, smallest: int) -> list[Room]:
    """Split a room by a wall across its longer side; either side if they are about equal."""
    rows, columns = room.sides
    axis = int(columns > rows)
    if abs(rows - columns) <= 1 and min(rows, columns) > 2 * smallest:
        axis = draw(random, 2)
    length, across = room.sides[axis], room.sides[1 - axis]
    least = min(max(smallest, across // _SLIMMEST), (length - 1) // 2)
    wall = least + draw(random, length - 2 * least)
    return [room.part(axis, 0, wall), room.part(axis, wall + 1, length - wall - 1)]


def _with_corridor(random: np.random.RandomState, house: Room, rooms: int, smallest: int) -> list[Room] | None:
    """Lay a corridor along a house, with rooms on both sides, or on one in a narrow house; None without space."""
    axis = int(house.sides[0] > house.sides[1])  # across the corridor
    beyond = []
    if rooms > 4 and house.sides[1 - axis] > 4 * smallest and draw(random, 100) < _BEYOND_SHARE:
        length = house.sides[1 - axis]
        wall = smallest + draw(random, length // 2 - smallest)
        parts = [house.part(1 - axis, 0, wall), house.part(1 - axis, wall + 1, length - wall - 1)]
        if draw(random, 2):
            parts = [house.part(1 - axis, length - wall, wall), house.part(1 - axis, 0, length - wall - 1)]
        beyond, house = parts[:1], parts[1]
    across, width = house.sides[axis], 1 + (draw(random, 100) < _WIDE_CORRIDOR_SHARE)
    spare = across - 2 * smallest - 2 - width
    if spare >= 0:
        first = smallest + 1 + draw(random, spare + 1)
        sides = [house.part(axis, 0, first - 1), house.part(axis, first + width + 1, across - first - width - 1)]
    elif across > smallest + width:
        first = draw(random, 2) * (across - width)
        sides = [house.part(axis, 0 if first else width + 1, across - width - 1)]
    else:
        return None
    return [*beyond, house.part(axis, first, width, is_corridor=True), *sides]


@dataclasses.dataclass(frozen=True)
class Shell:
    """A house without furniture."""

    shape: tuple[int, int]  # rows and columns, outer walls included
    rooms: tuple[Room, ...]  # including corridors
    doorways: tuple[tuple[Cell, ...], ...]  # one or two cells of each doorway
    things: tuple[tuple[Cell, str], ...] = ()  # things at fixed places: cells and characters

    def symbols(self) -> np.ndarray:
        """Return its floor plan as characters, (rows, columns)."""
        grid = np.full(self.shape, WALL)
        for room in self.rooms:
            grid[room.inside] = FREE
        for cell in self.doorway_cells:
            grid[cell] = FREE
        for cell, kind in self.things:
            grid[cell] = kind
        return grid

    @property
    def doorway_cells(self) -> list[Cell]:
        """The cells of all doorways."""
        return [cell for doorway in self.doorways for cell in doorway]


def build_shell(random: np.random.RandomState, shape: tuple[int, int], rooms: int, smallest: int) -> Shell | None:
    """Draw the walls of a house of a shape, outer walls included; None without space for the rooms.

    The shorter side of a room has at least `smallest` cells; a corridor counts as a room.
    """
    found = split(random, shape, rooms, smallest)
    return None if found is None else Shell(shape, tuple(found), _doorways(random, shape, found))


def _doorways(random: np.random.RandomState, shape: tuple[int, int], rooms: list[Room]) -> tuple[tuple[Cell, ...], ...]:
    """Open doorways to every room, most of them from the corridor or the largest room."""
    walls = _walls_between(shape, rooms)
    hub = max(range(len(rooms)), key=lambda i: (rooms[i].is_corridor, rooms[i].area))
    costs = {pair: draw(random, 100) + _DETOUR * (hub not in pair) for pair in sorted(walls)}
    part = list(range(len(rooms)))  # rooms with the same number are connected
    doorways = []
    for pair in sorted(costs, key=lambda pair: (costs[pair], pair)):
        one, other = part[pair[0]], part[pair[1]]
        if one != other or draw(random, 100) < _LOOP_SHARE:
            doorways.append(_doorway(random, walls[pair]))
            part = [one if number == other else number for number in part]
    return tuple(doorways)


def _doorway(random: np.random.RandomState, wall: list[Cell]) -> tuple[Cell, ...]:
    """Draw the cells of a doorway in a straight wall, at one of its ends or anywhere."""
    width = 1 + (len(wall) >= _WIDE_WALL and draw(random, 100) < _TWO_CELLS_SHARE)
    last = len(wall) - width
    first = pick(random, [0, last, draw(random, last + 1)], [1, 1, 2])
    return tuple(wall[first : first + width])


def _walls_between(shape: tuple[int, int], rooms: list[Room]) -> dict[tuple[int, int], list[Cell]]:
    """Return the cells of the common wall of each pair of rooms, with one room on either side."""
    owner = np.full(shape, -1)
    for i, room in enumerate(rooms):
        owner[room.inside] = i
    walls: dict[tuple[int, int], list[Cell]] = {}
    for row, column in np.argwhere(owner[1:-1, 1:-1] < 0) + 1:
        for down, right in ((1, 0), (0, 1)):
            one, other = sorted([int(owner[row - down, column - right]), int(owner[row + down, column + right])])
            if one >= 0:
                walls.setdefault((one, other), []).append((int(row), int(column)))
    return walls
