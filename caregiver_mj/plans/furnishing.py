"""Furniture and stairwells of generated houses, where people have them, and nowhere in the way."""

from __future__ import annotations

import enum

import numpy as np
from scipy import ndimage

from caregiver_mj.plans.cell_graph import BIN, FREE, STAIRWELL, TABLE, WALL, Cell
from caregiver_mj.plans.request import draw, pick
from caregiver_mj.plans.rooms import Room, Shell

# What lies round a cell, from north, clockwise.
_RING: tuple[Cell, ...] = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
_NEAR_DOORWAY = 3  # cells from a doorway within which one passes on the way to it
_SPACIOUS = 4  # cells that the shorter side of a room has at least, to have a table in its middle


class Place(enum.Enum):
    """Where in a room something stands."""

    CORNER = enum.auto()
    WALL = enum.auto()
    OPEN = enum.auto()
    WAY = enum.auto()  # where one passes to a doorway, but not before it


# Where people have what, in percent; what finds no such place left takes the next best, in this order.
_HABITS = {
    STAIRWELL: {Place.WALL: 48, Place.CORNER: 30, Place.WAY: 17, Place.OPEN: 5},
    BIN: {Place.CORNER: 65, Place.WALL: 35, Place.OPEN: 0},
    TABLE: {Place.WALL: 60, Place.OPEN: 25, Place.CORNER: 15},
}


def furnish(
    random: np.random.RandomState,
    shell: Shell,
    fixtures: dict[str, int],
    tables: dict[str, int],
    on_floor: dict[str, int],
) -> np.ndarray | None:
    """Put things into a house such that none of them divides a room, and a free cell remains beside each thing.

    Args:
        random: Where the chance comes from.
        shell: The house without them.
        fixtures: How many stairwells and bins there shall be, by their characters.
        tables: How many tables of each kind.
        on_floor: How many of each kind of small thing on the floor, where it does not lie in the way either.

    Returns:
        Characters (rows, columns), or None if no place was found for something.
    """
    house = _Furnished(shell)
    of_tables = random.permutation(_each(tables)).tolist()
    for kind in [*_each(fixtures), *of_tables, *_each(on_floor)]:
        cell = house.find(random, kind)
        if cell is None:
            return None
        house.grid[cell] = kind
    return house.grid


def _each(counts: dict[str, int]) -> list[str]:
    return [kind for kind, count in counts.items() for _ in range(count)]


class _Furnished:
    def __init__(self, shell: Shell):
        self.grid = shell.symbols()
        self._rooms = shell.rooms
        wall = np.pad(self.grid == WALL, 1)
        north, _, east, _, south, _, west, _ = _ring(wall)
        self._walls = north.astype(int) + east + south + west
        self._is_corner = (north | south) & (east | west)
        self._outer = np.zeros(shell.shape, bool)  # stairs need a wall with nothing behind it
        self._outer[[1, -2], :] = self._outer[:, [1, -2]] = True
        self._corridor, self._spacious = np.zeros((2, *shell.shape), bool)
        for room in shell.rooms:
            self._corridor[room.inside] = room.is_corridor
            self._spacious[room.inside] = min(room.sides) >= _SPACIOUS
        doorway = np.zeros(shell.shape, bool)
        for cell in shell.doorway_cells:
            doorway[cell] = True
        self._no_place = ndimage.binary_dilation(doorway)  # in doorways and before them
        self._near_doorway = ndimage.binary_dilation(doorway, iterations=_NEAR_DOORWAY, mask=~(self.grid == WALL))

    def find(self, random: np.random.RandomState, kind: str) -> Cell | None:
        """Draw a cell for a thing, None if there is none."""
        possible = self._possible(kind)
        habits = _HABITS.get(kind, _HABITS[TABLE])
        first = pick(random, list(habits), list(habits.values()))
        spaced = ~ndimage.binary_dilation(~np.isin(self.grid, (FREE, WALL)), np.ones((3, 3)))
        for free in (possible & spaced, possible):
            for place in (first, *habits):
                if (cells := free & self._where(place, kind)).any():
                    return self._draw_cell(random, cells)
        return None

    def _possible(self, kind: str) -> np.ndarray:
        """Where a thing leaves a way everywhere, and everything a free cell beside it: bool (rows, columns)."""
        free = self.grid == FREE
        ring = _ring(np.pad(free, 1))
        sides, corners = ring[0::2], ring[1::2]
        links = sum(sides[i] & corners[i] & sides[(i + 1) % 4] for i in range(4))
        # The free cells on its sides are connected round its corners.
        possible = free & ((sum(sides) - links == 1) | (links == 4)) & ~self._no_place
        thing = ~free & (self.grid != WALL)
        lonely = thing & (sum(sides) == 1)
        for beside in _ring(np.pad(lonely, 1))[0::2]:
            possible &= ~beside
        return possible & (~self._corridor if kind != STAIRWELL else True)

    def _where(self, place: Place, kind: str) -> np.ndarray:
        """All cells of a kind of place, free or not: bool (rows, columns)."""
        if place is Place.CORNER:
            return self._is_corner & (self._outer if kind == STAIRWELL else True)
        if place is Place.WALL:
            return (self._walls == 1) & (self._outer if kind == STAIRWELL else True)
        if place is Place.OPEN:
            around = _ring(np.pad(self.grid == FREE, 1))
            return self._spacious & np.logical_and.reduce(around)
        return self._near_doorway

    def _draw_cell(self, random: np.random.RandomState, cells: np.ndarray) -> Cell:
        """Draw a room, the emptier the rather, and one of the cells in it."""
        rooms = [room for room in self._rooms if cells[room.inside].any()]
        weights = [1 + 1000 * room.area // (1 + self._things(room)) ** 2 for room in rooms]
        room = pick(random, rooms, weights)
        found = np.argwhere(cells[room.inside])
        row, column = found[draw(random, len(found))].tolist()
        return room.top + row, room.left + column

    def _things(self, room: Room) -> int:
        return int((self.grid[room.inside] != FREE).sum())


def _ring(padded: np.ndarray) -> list[np.ndarray]:
    """What lies round each cell, from north clockwise: eight arrays (rows, columns), from one padded by 1."""
    height, width = padded.shape[0] - 2, padded.shape[1] - 2
    return [padded[1 + down : 1 + down + height, 1 + right : 1 + right + width] for down, right in _RING]
