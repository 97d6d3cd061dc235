"""Houses by seed: rooms, corridors and doorways, and things in them as people have them.

The same request gives the same house on every machine. Every house has something a caregiver can protect a child
from, and the robot can drive to all that it needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csgraph

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import BIN, CANDLE, FREE, STAIRWELL, TABLE, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.furnishing import furnish
from caregiver_mj.plans.hazards import BATTERY, GATE, MUG
from caregiver_mj.plans.layout import Layout
from caregiver_mj.plans.request import Request
from caregiver_mj.plans.rooms import Shell, build_shell
from caregiver_mj.plans.yielding import yielding

_TRIES = (3, 60)  # at least and at most; in between they are the fewer, the larger the house
_TRIED_CELLS = 30_000  # within outer walls, in all tries together
_ROOM_SIDES = (3, 2, 1)  # cells that a room's shorter side has at least, in the first tries and in later ones
DRIVING = 0.34  # metres from the base's centre to anything while it drives: its radius of 0.27, and 0.07
STANDING = 0.32  # metres while it stands
TURNING = 0.52  # metres to walls and stairs while it turns with a candle in its hand
REACH = 0.70  # metres from the base's centre to a candle on a table


def generate(seed: int, size: tuple[int, int] | None = None, **wishes: Any) -> FloorPlan:
    """Make a house. What is not given is drawn from the seed.

    Args:
        seed: Where all chance comes from.
        size: Columns and rows, outer walls included.
        wishes: What else it shall have, such as `rooms=3`; see `Request`.

    Returns:
        The floor plan. `FloorPlan.load` gives it again by its name.

    Raises:
        FloorPlanError: There can be no such house, or none was found.
    """
    return design(Request(seed, size, **wishes))[0]


def design(request: Request) -> tuple[FloorPlan, Shell]:
    """Make a house; see `generate`.

    Returns:
        The floor plan, and its walls with their rooms and doorways.

    Raises:
        FloorPlanError: There can be no such house, or none was found.
    """
    request.check()
    (width, height), counts = request.settled()
    area = (width - 2) * (height - 2)
    tries = 0 if sum(counts.values()) > area else int(np.clip(_TRIED_CELLS // area, *_TRIES))
    rooms, *things = counts.values()
    for attempt in range(tries):
        random = np.random.RandomState([request.seed, attempt])
        smallest = _ROOM_SIDES[attempt * len(_ROOM_SIDES) // tries]
        shell = build_shell(random, (height, width), rooms, smallest)
        if shell is not None and (plan := furnished(random, shell, things, request.name)):
            return plan, shell
    *some, last = (f"{field} {count}" for field, count in counts.items())
    raise request.error(f"no way was found to fit {', '.join(some)} and {last} into {width} x {height} cells")


def furnished(random: np.random.RandomState, shell: Shell, counts: Sequence[int], name: str) -> FloorPlan | None:
    """Return the plan of a house into which things have been put, if it is valid and drivable.

    Args:
        random: Where the chance comes from.
        shell: The house without them.
        counts: How many stairwells, candles, bare tables and bins, and of what a home has besides: gates, mugs and
            batteries.
        name: What to call it.
    """
    stairwells, candles, tables, bins, gates, mugs, batteries = (*counts, 0, 0, 0)[:7]
    tables_with = {CANDLE: candles, MUG.symbol: mugs, TABLE: tables}
    symbols = furnish(
        random, shell, {STAIRWELL: stairwells + gates, BIN: bins}, tables_with, {BATTERY.symbol: batteries}
    )
    if symbols is None:
        return None
    try:
        plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), name)
        if gates:
            for cell in _gated(random, plan, gates):
                symbols[cell] = GATE.symbol
            plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), name)
    except FloorPlanError:
        return None
    if len(plan.mouths) < gates:
        return None
    return plan if is_drivable(plan) else None


def _gated(random: np.random.RandomState, plan: FloorPlan, gates: int) -> list[Cell]:
    """Draw some of the stairwells that have room for a gate: opposite to their stairs is a free cell, and bare."""
    ways = zip(plan.stairwells, plan.stair_directions, strict=True)
    possible = [(row, column) for (row, column), step in ways if step and plan[row - step[0], column - step[1]] == FREE]
    return [possible[i] for i in random.permutation(len(possible))[:gates].tolist()]


def is_drivable(plan: FloorPlan) -> bool:
    """Return whether the robot gets everywhere in a house: to every free cell, landing and table, and away again.

    Worked out from the shapes in `layout` alone, exactly, by the clearances that the robot's own navigation keeps.
    """
    layout, free = Layout(plan), len(plan.free_cells)
    legs = _legs(plan, layout.obstacles)
    on_floor = legs[(legs < free).all(axis=1)]  # landings are no way through
    graph = coo_array((np.ones(len(on_floor)), on_floor.T), shape=(free, free))
    if csgraph.connected_components(graph, directed=False)[0] > 1:
        return False
    to_landings = legs[(legs < free).any(axis=1)].max(axis=1, initial=0)
    if not np.isin(np.arange(free, len(plan.caregiver_cells)), to_landings).all():
        return False
    return set(_tables_within_reach(layout)) == set(range(len(plan.tables)))


def _tables_within_reach(layout: Layout) -> list[int]:
    """The tables at which the robot can work from some free cell beside them, and turn there with a candle."""
    plan = layout.plan
    beside = plan.graph.beside(plan.tables)
    stands = [(table, cell) for table, cells in enumerate(beside) for cell in cells if not yielding(plan).traps[cell]]
    if not stands:
        return []
    middles = np.array([plan.position(plan.tables[table]) for table, _ in stands])
    cells = np.array([plan.position(plan.caregiver_cells[cell]) for _, cell in stands])
    bases = middles + (cells - middles) * REACH / plan.cell_size
    fits = _clearance(bases, np.zeros(2), layout.obstacles) >= STANDING
    fits &= _clearance(bases, np.zeros(2), layout.high) >= TURNING
    return [table for (table, _), fit in zip(stands, fits, strict=True) if fit]


def _legs(plan: FloorPlan, obstacles: np.ndarray) -> np.ndarray:
    """Return the moves between neighbouring caregiver cells that the base has room for, (moves, 2)."""
    neighbours = enumerate(plan.graph.neighbours)
    pairs = [(cell, neighbour) for cell, around in neighbours for neighbour in around if cell < neighbour]
    legs = np.array(pairs, int).reshape(-1, 2)
    ends = np.array([plan.position(cell) for cell in plan.caregiver_cells])[legs]  # (moves, 2 ends, 2)
    halves = np.abs(ends[:, 1] - ends[:, 0]) / 2
    return legs[_clearance(ends.mean(axis=1), halves, obstacles) >= DRIVING]


def _clearance(centres: np.ndarray, halves: np.ndarray, obstacles: np.ndarray) -> np.ndarray:
    """Metres from straight ways along the axes, by middle and half extent (n, 2), to the nearest rectangle: (n,)."""
    nearest = np.full(len(centres), np.inf)
    for x, y, half_x, half_y in obstacles:
        gap = np.maximum(np.abs(centres - [x, y]) - halves - [half_x, half_y], 0)
        np.minimum(nearest, np.hypot(gap[:, 0], gap[:, 1]), out=nearest)
    return nearest
