"""Generated houses without furniture: their rooms, and the doorways between them."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.chance import draw, pick
from caregiver_mj.plans.rooms import Room, split
from caregiver_mj.plans.symbols import FREE, WALL

_TWO_CELLS_SHARE = 35  # percent of doorways of two cells, in walls that are long enough
_WIDE_WALL = 4  # cells of wall between two rooms in which there may be a doorway of two
_LOOP_SHARE = 15  # percent of the walls without a needed doorway that have one all the same
_DETOUR = 150  # how much worse a doorway is that leads neither to the corridor nor to the largest room (chance: 100)


@dataclasses.dataclass(frozen=True)
class Shell:
    """A house without furniture.

    Attributes:
        shape: Rows and columns, outer walls included.
        rooms: The rooms; corridors are some of them.
        doorways: For each doorway its cells, one or two.
        things: What stands at fixed places already: cells and their characters.
    """

    shape: tuple[int, int]
    rooms: tuple[Room, ...]
    doorways: tuple[tuple[Cell, ...], ...]
    things: tuple[tuple[Cell, str], ...] = ()

    def symbols(self) -> np.ndarray:
        """Its floor plan, characters (rows, columns)."""
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
    """Draws the walls of a house.

    Args:
        random: Where the chance comes from.
        shape: Rows and columns, outer walls included.
        rooms: How many rooms there shall be, a corridor included.
        smallest: Cells that the shorter side of a room has at least.

    Returns:
        The walls, or None if there is no space for so many rooms.
    """
    found = split(random, shape, rooms, smallest)
    return None if found is None else Shell(shape, tuple(found), _doorways(random, shape, found))


def _doorways(random: np.random.RandomState, shape: tuple[int, int], rooms: list[Room]) -> tuple[tuple[Cell, ...], ...]:
    """Opens walls so that there is a way to every room, most of them from the corridor or the largest room."""
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
