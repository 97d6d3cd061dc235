"""Generated houses without furniture: rooms of varied sizes, sometimes along a corridor, and special shapes.

Rooms result from recursive splitting. A shape, such as `hall`, also has things at fixed places.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from caregiver_mj.plans.cell_graph import BIN, CANDLE, FREE, STAIRWELL, TABLE, WALL, Cell
from caregiver_mj.registry import summary

_CORRIDOR_SHARE = 60  # % of houses of more than three rooms have a corridor
_BEYOND_SHARE = 50  # % of those of more than four rooms have rooms beyond the corridor's end
_WIDE_CORRIDOR_SHARE = 70  # % of corridors are two cells wide; the others one
_SLIMMEST = 3  # preferred greatest ratio of a room's length to its width
_TWO_CELLS_SHARE = 35  # % of doorways in long walls are two cells wide
_WIDE_WALL = 4  # cells; least length of a wall for a doorway of two cells
_LOOP_SHARE = 15  # % of the walls that need no doorway have one
_DETOUR = 150  # extra cost of a doorway that leads neither to the corridor nor to the largest room (random cost: 100)

Thing = TypeVar("Thing")


def draw(random: np.random.RandomState, below: int) -> int:
    """Return a random integer below `below`, the same on every machine: integers of `RandomState` are guaranteed."""
    return int(random.randint(below, dtype=np.int64))


def pick(random: np.random.RandomState, things: Sequence[Thing], weights: Sequence[int]) -> Thing:
    """Return one of several things, drawn with integer weights."""
    totals = np.cumsum(weights)
    return things[int(np.searchsorted(totals, draw(random, int(totals[-1])), side="right"))]


@dataclasses.dataclass(frozen=True)
class Room:
    """A rectangle of cells between walls; its last row and column are included."""

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
        """Return `length` of its rows (axis 0) or columns (1), from its own number `first` on."""
        if axis == 0:
            return Room(self.top + first, self.left, self.top + first + length - 1, self.right, is_corridor)
        return Room(self.top, self.left + first, self.bottom, self.left + first + length - 1, is_corridor)


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


def build_shell(random: np.random.RandomState, shape: tuple[int, int], count: int, smallest: int) -> Shell | None:
    """Draw a house of a shape, outer walls included, with `count` rooms; None without enough space for them.

    Walls are one cell thick. The shorter side of a room has at least `smallest` cells; a corridor, which counts as a
    room, may be narrower.
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
    return Shell(shape, tuple(rooms), _doorways(random, shape, rooms))


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


# -- Special shapes ------------------------------------------------------------------------------------

Made = tuple[Shell, tuple[int, int, int, int]]  # with numbers of stairwells, candles, bare tables and bins to add


def _hall(random: np.random.RandomState) -> Made:
    """Stairs at both ends of a hall one cell wide, and things in niches along it."""
    length = 16 + draw(random, 12)
    things = [((2, 1), STAIRWELL), ((2, length), STAIRWELL)]
    kinds = [CANDLE, TABLE, BIN, *random.permutation([CANDLE, TABLE, BIN, STAIRWELL]).tolist()]
    columns = 3 + random.permutation((length - 4) // 2)[: len(kinds)] * 2
    for column, kind in zip(columns.tolist(), kinds, strict=False):
        things.append(((1 + 2 * draw(random, 2), column), kind))
    return Shell((5, length + 2), (Room(2, 1, 2, length, True),), (), tuple(things)), (0, 0, 0, 0)


def _alcoves(random: np.random.RandomState) -> Made:
    """A room with dead ends one cell wide, and a thing at the end of each."""
    rows, columns = 3 + draw(random, 3), 9 + draw(random, 5)
    depth = 1 + draw(random, 2)
    kinds = random.permutation([CANDLE, TABLE, BIN, STAIRWELL, *random.permutation([CANDLE, TABLE, BIN])]).tolist()
    return _with_dead_ends(random, Room(depth + 2, 1, depth + rows + 1, columns), kinds, depth, lambda: depth)


def _with_dead_ends(
    random: np.random.RandomState, room: Room, kinds: list[str], longest: int, length: Callable[[], int]
) -> Made:
    """A room with dead ends of some lengths to the north and south, and one thing at the end of each."""
    rooms, things = [room], []
    places = [(column, up) for column in range(2, room.right, 2) for up in (0, 1)]
    for i, kind in zip(random.permutation(len(places)).tolist(), kinds, strict=False):
        (column, up), cells = places[i], length()
        first, end = (room.top - cells, room.top - cells - 1) if up else (room.bottom + 1, room.bottom + cells + 1)
        rooms.append(Room(first, column, first + cells - 1, column, True))
        things.append(((end, column), kind))
    return Shell((room.bottom + longest + 3, room.right + 2), tuple(rooms), (), tuple(things)), (0, 0, 0, 0)


def _open_plan(random: np.random.RandomState) -> Made:
    """One big room with islands of furniture, blocks of two or three tables."""
    rows, columns = 8 + draw(random, 2), 9 + draw(random, 3)
    things = []
    for i, (row, column) in enumerate([(3, 3), (3, columns - 3), (rows - 2, 3 + draw(random, columns - 6))]):
        for j in range(2 + draw(random, 2) if i == 2 else 2):
            cell = (row, column - 1 + j) if i == 2 else (row + j, column)
            things.append((cell, CANDLE if i < 2 and j == 0 else TABLE))
    shell = Shell((rows + 2, columns + 2), (Room(1, 1, rows, columns),), (), tuple(things))
    return shell, (1 + draw(random, 2), 0, 0, 2)


def _chain(random: np.random.RandomState) -> Made:
    """Rooms behind rooms, each the only way to the next."""
    rows, rooms, doors, left = 3 + draw(random, 2), [], [], 1
    for i in range(4 + draw(random, 2)):
        if i:
            doors.append(((1 + draw(random, rows), left - 1),))
        width = 3 + draw(random, 2)
        rooms.append(Room(1, left, rows, left + width - 1))
        left += width + 1
    return Shell((rows + 2, left), tuple(rooms), tuple(doors)), (2, 2, 2, 2)


def _room(random: np.random.RandomState) -> Shell:
    """One big room, empty."""
    rows, columns = 7 + draw(random, 3), 8 + draw(random, 4)
    return Shell((rows + 2, columns + 2), (Room(1, 1, rows, columns),), ())


def _stairs_only(random: np.random.RandomState) -> Made:
    """About six stairwells and no candle."""
    shell = _room(random) if draw(random, 2) else _chain(random)[0]
    return shell, (5 + draw(random, 3), 0, 1, 2)


def _many_tables(random: np.random.RandomState) -> Made:
    """Many tables with candles, and one bare one."""
    return _room(random), (1, 5 + draw(random, 3), 1, 2)


def _dead_ends(random: np.random.RandomState) -> Made:
    """Corridors that leave a wider one and end blind, and a thing at the end of each."""
    columns, longest = 9 + 2 * draw(random, 3), 3 + draw(random, 2)
    kinds = random.permutation([CANDLE, TABLE, BIN, STAIRWELL, CANDLE, STAIRWELL]).tolist()
    corridor = Room(longest + 2, 1, longest + 3, columns, True)
    return _with_dead_ends(random, corridor, kinds, longest, lambda: 2 + draw(random, longest - 1))


def _loops(random: np.random.RandomState) -> Made:
    """Two rings of corridor with a side in common, and things in niches around them."""
    rows, left, right = 7 + draw(random, 3), 4 + draw(random, 3), 4 + draw(random, 3)
    top, bottom, middle, last = 2, rows, 2 + left, 2 + left + right
    rooms = [Room(row, 2, row, last, True) for row in (top, bottom)]
    rooms += [Room(top, column, bottom, column, True) for column in (2, middle, last)]
    niches = [(row, column) for row in (1, bottom + 1) for column in range(3, last, 2)]
    niches += [(row, column) for column in (1, last + 1) for row in range(3, bottom, 2)]
    kinds = [CANDLE, TABLE, BIN, STAIRWELL, *random.permutation([CANDLE, TABLE, BIN, STAIRWELL]).tolist()]
    things = [(niches[i], kind) for i, kind in zip(random.permutation(len(niches)).tolist(), kinds, strict=False)]
    return Shell((bottom + 3, last + 3), tuple(rooms), (), tuple(things)), (0, 0, 0, 0)


def _far_bins(random: np.random.RandomState) -> Made:
    """A long house with a bin at either end."""
    rows, columns = 3 + draw(random, 2), 16 + draw(random, 7)
    ends = ((1 + draw(random, rows), 1), (1 + draw(random, rows), columns))
    wall = columns // 2 + draw(random, 3)
    rooms = (Room(1, 1, rows, wall - 1), Room(1, wall + 1, rows, columns))
    doorway = ((1 + draw(random, rows), wall),)
    shell = Shell((rows + 2, columns + 2), rooms, (doorway,), tuple((end, BIN) for end in ends))
    return shell, (1 + draw(random, 2), 2, 2, 0)


MAKERS: dict[str, Callable[[np.random.RandomState], Made]] = {
    "hall": _hall,
    "alcoves": _alcoves,
    "open-plan": _open_plan,
    "chain": _chain,
    "stairs-only": _stairs_only,
    "many-tables": _many_tables,
    "dead-ends": _dead_ends,
    "loops": _loops,
    "far-bins": _far_bins,
}
SHAPES = {shape: summary(make) for shape, make in MAKERS.items()}  # descriptions by name
