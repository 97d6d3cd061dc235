"""Rooms of generated houses: recursive splitting into rooms of varied sizes, sometimes along a corridor."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.plans.chance import draw, pick

_CORRIDOR_SHARE = 60  # percent of houses of more than three rooms with a corridor
_BEYOND_SHARE = 50  # percent of those of more than four rooms with rooms beyond the corridor's end
_WIDE_CORRIDOR_SHARE = 70  # percent of corridors of two cells; the others have one
_SLIMMEST = 3  # times that a room is as long as wide at most, where that can be helped


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
        """A part of it.

        Args:
            axis: 0 for some of its rows, 1 for some of its columns.
            first: The first of them, counted from the room's own first.
            length: How many.
            is_corridor: Whether that is a corridor.
        """
        if axis == 0:
            return Room(self.top + first, self.left, self.top + first + length - 1, self.right, is_corridor)
        return Room(self.top, self.left + first, self.bottom, self.left + first + length - 1, is_corridor)


def split(random: np.random.RandomState, shape: tuple[int, int], count: int, smallest: int) -> list[Room] | None:
    """Divides a house into rooms with walls of one cell between them.

    Args:
        random: Where the chance comes from.
        shape: Rows and columns, outer walls included.
        count: How many rooms there shall be, a corridor included.
        smallest: Cells that the shorter side of a room has at least; that of a corridor may be less.

    Returns:
        The rooms, or None if there is no space for so many.
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
    """Splits a room by a wall across its longer side (of two that are about as long, either)."""
    rows, columns = room.sides
    axis = int(columns > rows)
    if abs(rows - columns) <= 1 and min(rows, columns) > 2 * smallest:
        axis = draw(random, 2)
    length, across = room.sides[axis], room.sides[1 - axis]
    least = min(max(smallest, across // _SLIMMEST), (length - 1) // 2)
    wall = least + draw(random, length - 2 * least)
    return [room.part(axis, 0, wall), room.part(axis, wall + 1, length - wall - 1)]


def _with_corridor(random: np.random.RandomState, house: Room, rooms: int, smallest: int) -> list[Room] | None:
    """Lays a corridor along a house, with rooms to both sides, or to one if the house is narrow; None without space."""
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
