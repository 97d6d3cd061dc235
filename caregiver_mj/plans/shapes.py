"""Generated houses of special shapes: `hall-17`, `alcoves-17`, ..."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import BIN, CANDLE, STAIRWELL, TABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import furnished
from caregiver_mj.plans.request import SEEDS, draw
from caregiver_mj.plans.rooms import Room, Shell
from caregiver_mj.registry import summary

_TRIES = 60
_Made = tuple[Shell, tuple[int, int, int, int]]  # with numbers of stairwells, candles, bare tables and bins to add


def _hall(random: np.random.RandomState) -> _Made:
    """Stairs at both ends of a hall one cell wide, and things in niches along it."""
    length = 16 + draw(random, 12)
    things = [((2, 1), STAIRWELL), ((2, length), STAIRWELL)]
    kinds = [CANDLE, TABLE, BIN, *random.permutation([CANDLE, TABLE, BIN, STAIRWELL]).tolist()]
    columns = 3 + random.permutation((length - 4) // 2)[: len(kinds)] * 2
    for column, kind in zip(columns.tolist(), kinds, strict=False):
        things.append(((1 + 2 * draw(random, 2), column), kind))
    return Shell((5, length + 2), (Room(2, 1, 2, length, True),), (), tuple(things)), (0, 0, 0, 0)


def _alcoves(random: np.random.RandomState) -> _Made:
    """A room with dead ends one cell wide, and a thing at the end of each."""
    rows, columns = 3 + draw(random, 3), 9 + draw(random, 5)
    depth = 1 + draw(random, 2)
    kinds = random.permutation([CANDLE, TABLE, BIN, STAIRWELL, *random.permutation([CANDLE, TABLE, BIN])]).tolist()
    return _with_dead_ends(random, Room(depth + 2, 1, depth + rows + 1, columns), kinds, depth, lambda: depth)


def _with_dead_ends(
    random: np.random.RandomState, room: Room, kinds: list[str], longest: int, length: Callable[[], int]
) -> _Made:
    """A room with dead ends to the north and to the south, of some lengths, and one thing at the end of each."""
    rooms, things = [room], []
    places = [(column, up) for column in range(2, room.right, 2) for up in (0, 1)]
    for i, kind in zip(random.permutation(len(places)).tolist(), kinds, strict=False):
        (column, up), cells = places[i], length()
        first, end = (room.top - cells, room.top - cells - 1) if up else (room.bottom + 1, room.bottom + cells + 1)
        rooms.append(Room(first, column, first + cells - 1, column, True))
        things.append(((end, column), kind))
    return Shell((room.bottom + longest + 3, room.right + 2), tuple(rooms), (), tuple(things)), (0, 0, 0, 0)


def _open_plan(random: np.random.RandomState) -> _Made:
    """One big room with islands of furniture, blocks of two or three tables."""
    rows, columns = 8 + draw(random, 2), 9 + draw(random, 3)
    things = []
    for i, (row, column) in enumerate([(3, 3), (3, columns - 3), (rows - 2, 3 + draw(random, columns - 6))]):
        for j in range(2 + draw(random, 2) if i == 2 else 2):
            cell = (row, column - 1 + j) if i == 2 else (row + j, column)
            things.append((cell, CANDLE if i < 2 and j == 0 else TABLE))
    shell = Shell((rows + 2, columns + 2), (Room(1, 1, rows, columns),), (), tuple(things))
    return shell, (1 + draw(random, 2), 0, 0, 2)


def _chain(random: np.random.RandomState) -> _Made:
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


def _stairs_only(random: np.random.RandomState) -> _Made:
    """About six stairwells and no candle."""
    shell = _room(random) if draw(random, 2) else _chain(random)[0]
    return shell, (5 + draw(random, 3), 0, 1, 2)


def _many_tables(random: np.random.RandomState) -> _Made:
    """Many tables with candles, and one bare one."""
    return _room(random), (1, 5 + draw(random, 3), 1, 2)


def _dead_ends(random: np.random.RandomState) -> _Made:
    """Corridors that leave a wider one and end blind, and a thing at the end of each."""
    columns, longest = 9 + 2 * draw(random, 3), 3 + draw(random, 2)
    kinds = random.permutation([CANDLE, TABLE, BIN, STAIRWELL, CANDLE, STAIRWELL]).tolist()
    corridor = Room(longest + 2, 1, longest + 3, columns, True)
    return _with_dead_ends(random, corridor, kinds, longest, lambda: 2 + draw(random, longest - 1))


def _loops(random: np.random.RandomState) -> _Made:
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


def _far_bins(random: np.random.RandomState) -> _Made:
    """A long house with a bin at either end."""
    rows, columns = 3 + draw(random, 2), 16 + draw(random, 7)
    ends = ((1 + draw(random, rows), 1), (1 + draw(random, rows), columns))
    wall = columns // 2 + draw(random, 3)
    rooms = (Room(1, 1, rows, wall - 1), Room(1, wall + 1, rows, columns))
    doorway = ((1 + draw(random, rows), wall),)
    shell = Shell((rows + 2, columns + 2), rooms, (doorway,), tuple((end, BIN) for end in ends))
    return shell, (1 + draw(random, 2), 2, 2, 0)


_MAKERS: dict[str, Callable[[np.random.RandomState], _Made]] = {
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
SHAPES = {shape: summary(make) for shape, make in _MAKERS.items()}  # descriptions by name


def generate_shape(shape: str, seed: int) -> FloorPlan:
    """Return the house of a shape and a seed, valid and drivable.

    Raises:
        FloorPlanError: The shape or the seed is invalid, or no valid house was found.
    """
    if shape not in SHAPES:
        raise FloorPlanError(f"the shape must be one of {', '.join(SHAPES)}, got '{shape}'")
    if not 0 <= seed < SEEDS:
        raise FloorPlanError(
            f"floor plan '{shape}-{seed}' cannot be made: the seed must be an integer from 0 to {SEEDS - 1}, got {seed}"
        )
    for attempt in range(_TRIES):
        random = np.random.RandomState([[*SHAPES].index(shape), seed, attempt])
        shell, counts = _MAKERS[shape](random)
        if plan := furnished(random, shell, counts, f"{shape}-{seed}"):
            return plan
    raise FloorPlanError(f"floor plan '{shape}-{seed}' cannot be made: no way was found")
