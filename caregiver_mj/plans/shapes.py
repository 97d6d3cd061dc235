"""Houses of other shapes than homes, by seed: `hall-17`, `alcoves-17`, ..."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.chance import draw
from caregiver_mj.plans.drivable import is_drivable
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.furnishing import furnish
from caregiver_mj.plans.rooms import Room
from caregiver_mj.plans.shell import Shell
from caregiver_mj.plans.symbols import BIN, CANDLE, STAIRWELL, TABLE

_TRIES = 60
_Made = tuple[Shell, tuple[int, int, int, int]]  # and how many stairwells, candles, bare tables and bins to add


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
    top, bottom = depth + 2, depth + rows + 1
    rooms, things = [Room(top, 1, bottom, columns)], []
    kinds = random.permutation([CANDLE, TABLE, BIN, STAIRWELL, *random.permutation([CANDLE, TABLE, BIN])]).tolist()
    places = [(column, up) for column in range(2, columns, 2) for up in (0, 1)]
    for i, kind in zip(random.permutation(len(places)).tolist(), kinds, strict=False):
        column, up = places[i]
        first, end = (2, 1) if up else (bottom + 1, bottom + depth + 1)
        rooms.append(Room(first, column, first + depth - 1, column, True))
        things.append(((end, column), kind))
    return Shell((rows + 2 * depth + 4, columns + 2), tuple(rooms), (), tuple(things)), (0, 0, 0, 0)


def _open_plan(random: np.random.RandomState) -> _Made:
    """One big room."""
    rows, columns = 7 + draw(random, 3), 8 + draw(random, 4)
    room = Room(1, 1, rows, columns)
    return Shell((rows + 2, columns + 2), (room,), ()), (1 + draw(random, 2), 2, 3, 2)


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


def _stairs_only(random: np.random.RandomState) -> _Made:
    """About six stairwells and no candle."""
    shell, _ = _open_plan(random) if draw(random, 2) else _chain(random)
    return shell, (5 + draw(random, 3), 0, 1, 2)


def _many_tables(random: np.random.RandomState) -> _Made:
    """Many tables with candles, and one bare one."""
    return _open_plan(random)[0], (1, 5 + draw(random, 3), 1, 2)


_MAKERS: dict[str, Callable[[np.random.RandomState], _Made]] = {
    "hall": _hall,
    "alcoves": _alcoves,
    "open-plan": _open_plan,
    "chain": _chain,
    "stairs-only": _stairs_only,
    "many-tables": _many_tables,
}
SHAPES = tuple(_MAKERS)


def generate_shape(shape: str, seed: int) -> FloorPlan:
    """Return the house of a shape and a seed, valid and drivable.

    Raises:
        FloorPlanError: No such house was found.
    """
    for attempt in range(_TRIES):
        random = np.random.RandomState([SHAPES.index(shape), seed % 2**32, attempt])
        shell, counts = _MAKERS[shape](random)
        symbols = furnish(random, shell, dict(zip((STAIRWELL, CANDLE, TABLE, BIN), counts, strict=True)))
        if symbols is None:
            continue
        try:
            plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), f"{shape}-{seed}")
        except FloorPlanError:
            continue
        if is_drivable(plan):
            return plan
    raise FloorPlanError(f"floor plan '{shape}-{seed}' cannot be made: no way was found")
