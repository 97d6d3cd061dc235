"""Whether the robot can do its work in a house: drive to every place that it needs with room to spare.

Worked out from the shapes in `layout` alone, exactly, by the clearances that the robot's own navigation keeps.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csgraph

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

DRIVING = 0.34  # metres from the base's centre to anything while it drives: its radius of 0.27, and 0.07
STANDING = 0.32  # metres while it stands
TURNING = 0.52  # metres to walls and stairs while it turns with a candle in its hand
REACH = 0.70  # metres from the base's centre to a candle on a table


def is_drivable(plan: FloorPlan) -> bool:
    """Whether the robot gets everywhere in a house: to every free cell, landing and table, and away again."""
    legs = _legs(plan)
    free = len(plan.free_cells)
    on_floor = legs[(legs < free).all(axis=1)]  # landings are no way through
    if _parts(on_floor, free).max() > 0:
        return False
    landings = legs[(legs < free).sum(axis=1) == 1].max(axis=1, initial=0)
    if not np.isin(np.arange(free, len(plan.caregiver_cells)), landings).all():
        return False
    return all(stands.any() for stands in _stands(plan))


def _stands(plan: FloorPlan) -> list[np.ndarray]:
    """For each table whether the robot can work at it from each of the free cells beside it: bool (cells,)."""
    tall = np.concatenate([layout.wall_rectangles(plan), layout.stair_rectangles(plan)])
    everything, traps = layout.obstacle_rectangles(plan), yielding(plan).traps
    found = []
    for table, beside in zip(plan.tables, plan.graph.beside(plan.tables), strict=True):
        cells = np.array([plan.position(plan.caregiver_cells[cell]) for cell in beside])
        middle = plan.position(table)
        bases = middle + (cells - middle) * REACH / plan.cell_size
        nothing = np.zeros((len(bases), 2))
        has_room = _clearance(bases, nothing, everything) >= STANDING
        can_turn = _clearance(bases, nothing, tall) >= TURNING
        found.append(has_room & can_turn & ~traps[beside])
    return found


def _legs(plan: FloorPlan) -> np.ndarray:
    """Moves between neighbouring caregiver cells that the base has room for, (moves, 2)."""
    pairs = [
        (cell, neighbour)
        for cell, neighbours in enumerate(plan.graph.neighbours)
        for neighbour in neighbours
        if cell < neighbour
    ]
    legs = np.array(pairs, int).reshape(-1, 2)
    ends = np.array([plan.position(cell) for cell in plan.caregiver_cells])[legs]  # (moves, 2 ends, 2)
    clearance = _clearance(ends.mean(axis=1), np.abs(ends[:, 1] - ends[:, 0]) / 2, layout.obstacle_rectangles(plan))
    return legs[clearance >= DRIVING]


def _parts(edges: np.ndarray, count: int) -> np.ndarray:
    """Numbers what is connected by edges (n, 2): (count,)."""
    return csgraph.connected_components(coo_array((np.ones(len(edges)), edges.T), shape=(count, count)), directed=False)[1]


def _clearance(centres: np.ndarray, halves: np.ndarray, obstacles: np.ndarray) -> np.ndarray:
    """Distance of straight ways along the axes (n, 2), given by their middle and half lengths, to rectangles: (n,)."""
    nearest = np.full(len(centres), np.inf)
    for x, y, half_x, half_y in obstacles:
        gap = np.abs(centres - [x, y]) - halves - [half_x, half_y]
        np.minimum(nearest, np.hypot(*gap.clip(min=0).T), out=nearest)
    return nearest
