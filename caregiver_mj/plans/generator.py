"""Houses by seed: rooms, corridors and doorways, and things in them as people have them.

The same request gives the same house on every machine. Every house has something a caregiver can protect a child
from, and the robot can drive to all that it needs.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.plans.drivable import is_drivable
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.furnishing import furnish
from caregiver_mj.plans.request import Request
from caregiver_mj.plans.shell import Shell, build_shell
from caregiver_mj.plans.symbols import BIN, CANDLE, STAIRWELL, TABLE

_TRIES = (3, 60)  # at least and at most; in between they are the fewer, the larger the house
_TRIED_CELLS = 30_000  # within outer walls, in all tries together
_ROOM_SIDES = (3, 2, 1)  # cells that a room's shorter side has at least, in the first tries and in later ones


def generate(
    seed: int,
    size: tuple[int, int] | None = None,
    rooms: int | None = None,
    stairwells: int | None = None,
    candles: int | None = None,
    tables: int | None = None,
    bins: int | None = None,
) -> FloorPlan:
    """Makes a house. What is not given is drawn from the seed.

    Args:
        seed: Where all chance comes from.
        size: Columns and rows, outer walls included.
        rooms: How many rooms, a corridor included.
        stairwells: How many stairwells.
        candles: How many tables with a candle.
        tables: How many bare tables.
        bins: How many toy bins.

    Returns:
        The floor plan. `FloorPlan.load` gives it again by its name.

    Raises:
        FloorPlanError: There can be no such house, or none was found.
    """
    return design(Request(seed, size, rooms, stairwells, candles, tables, bins))[0]


def design(request: Request) -> tuple[FloorPlan, Shell]:
    """Makes a house; see `generate`.

    Returns:
        The floor plan, and its walls with their rooms and doorways.

    Raises:
        FloorPlanError: There can be no such house, or none was found.
    """
    request.check()
    full = request.settled()
    width, height = full.size
    area = (width - 2) * (height - 2)
    counts = {STAIRWELL: full.stairwells, CANDLE: full.candles, TABLE: full.tables, BIN: full.bins}
    tries = 0 if sum(counts.values()) + full.rooms > area else int(np.clip(_TRIED_CELLS // area, *_TRIES))
    for attempt in range(tries):
        random = np.random.RandomState([request.seed, attempt])
        smallest = _ROOM_SIDES[attempt * len(_ROOM_SIDES) // tries]
        shell = build_shell(random, (height, width), full.rooms, smallest)
        symbols = None if shell is None else furnish(random, shell, counts)
        if shell is not None and symbols is not None:
            plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), request.name)
            if is_drivable(plan):
                return plan, shell
    *some, last = (f"{field} {getattr(full, field)}" for field in ("rooms", "stairwells", "candles", "tables", "bins"))
    raise request.error(f"no way was found to fit {', '.join(some)} and {last} into {width} x {height} cells")
