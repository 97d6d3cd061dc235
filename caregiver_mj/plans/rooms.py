"""Rooms of generated houses: recursive splitting into rooms of varied sizes, sometimes along a corridor."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.plans.cell_graph import FREE, WALL, Cell
from caregiver_mj.plans.request import draw, pick

_CORRIDOR_SHARE = 60  # percent of houses of more than three rooms with a corridor
_BEYOND_SHARE = 50  # percent of those of more than four rooms with rooms beyond the corridor's end
_WIDE_CORRIDOR_SHARE = 70  # percent of corridors of two cells; the others have one
_SLIMMEST = 3  # times that a room is as long as wide at most, where that can be helped
_TWO_CELLS_SHARE = 35  # percent of doorways of two cells, in walls that are long enough
_WIDE_WALL = 4  # cells of wall between two rooms in which there may be a doorway of two
_LOOP_SHARE = 15  # percent of the walls without a needed doorway that have one all the same
_DETOUR = 150  # how much worse a doorway is that leads neither to the corridor nor to the largest room (chance: 100)


@dataclasses.dataclass(frozen=True)
class Room:
    """The cells between walls, a rectangle; first and last row and column are part of it."""

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
        """Cells."""
        return self.sides[0] * self.sides[1]

    @property
    def inside(self) -> tuple[slice, slice]:
        """The room's part of an array (rows, columns)."""
        return slice(self.top, self.bottom + 1), slice(self.left, self.right + 1)

    def part(self, axis: int, first: int, length: int, is_corridor: bool = False) -> Room:
        """Return some of its rows (axis 0) or columns (1), from the first on, counted from the room's own first."""
        if axis == 0:
            return Room(self.top + first, self.left, self.top + first + length - 1, self.right, is_corridor)
        return Room(self.top, self.left + first, self.bottom, self.left + first + length - 1, is_corridor)


def split(random: np.random.RandomState, shape: tuple[int, int], count: int, smallest: int) -> list[Room] | None:
    """Divide a house into so many rooms, a corridor included, with walls of one cell between them; None without space.

    The shorter side of a room has at least `smallest` cells; that of a corridor may have less.
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
    """Split a room by a wall across its longer side (of two that are about as long, either)."""
    rows, columns = room.sides
    axis = int(columns > rows)
    if abs(rows - columns) <= 1 and min(rows, columns) > 2 * smallest:
        axis = draw(random, 2)
    length, across = room.sides[axis], room.sides[1 - axis]
    least = min(max(smallest, across // _SLIMMEST), (length - 1) // 2)
    wall = least + draw(random, length - 2 * least)
    return [room.part(axis, 0, wall), room.part(axis, wall + 1, length - wall - 1)]


def _with_corridor(random: np.random.RandomState, house: Room, rooms: int, smallest: int) -> list[Room] | None:
    """Lay a corridor along a house, with rooms to both sides, or to one if the house is narrow; None without space."""
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
    rooms: tuple[Room, ...]  # the rooms; corridors are some of them
    doorways: tuple[tuple[Cell, ...], ...]  # for each doorway its cells, one or two
    things: tuple[tuple[Cell, str], ...] = ()  # what stands at fixed places already: cells and their characters

    def symbols(self) -> np.ndarray:
        """Return its floor plan, characters (rows, columns)."""
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
    """Draw the walls of a house of a shape, outer walls included; None if there is no space for so many rooms.

    The shorter side of a room has at least `smallest` cells; a corridor is one of the rooms.
    """
    found = split(random, shape, rooms, smallest)
    return None if found is None else Shell(shape, tuple(found), _doorways(random, shape, found))


def _doorways(random: np.random.RandomState, shape: tuple[int, int], rooms: list[Room]) -> tuple[tuple[Cell, ...], ...]:
    """Open walls so that there is a way to every room, most of them from the corridor or the largest room."""
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
    """Cells of a straight wall, next to one of its ends or anywhere."""
    width = 1 + (len(wall) >= _WIDE_WALL and draw(random, 100) < _TWO_CELLS_SHARE)
    last = len(wall) - width
    first = pick(random, [0, last, draw(random, last + 1)], [1, 1, 2])
    return tuple(wall[first : first + width])


def _walls_between(shape: tuple[int, int], rooms: list[Room]) -> dict[tuple[int, int], list[Cell]]:
    """For each pair of rooms with a common wall the cells of it that have one room before and the other behind."""
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
