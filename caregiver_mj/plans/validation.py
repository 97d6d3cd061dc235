"""What makes a floor plan valid, and what to say where it is not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.symbols import BIN, CANDLE, LEGEND, STAIRWELL, TABLE, WALL

if TYPE_CHECKING:
    from caregiver_mj.plans.floor_plan import FloorPlan


def validate(plan: FloorPlan, first_line: int) -> None:
    """Raises FloorPlanError at the first thing that is wrong with a plan.

    Args:
        plan: What has been read.
        first_line: Line of the text in which the plan begins, counted from 1.
    """

    def fail(cell: Cell, problem: str) -> None:
        row, column = cell
        raise FloorPlanError(f"floor plan '{plan.name}' line {row + first_line}, column {column + 1}: {problem}")

    height, width = len(plan.rows), len(plan.rows[0])
    for r, row in enumerate(plan.rows):
        if not set(row) <= set(LEGEND):
            c, kind = next((c, kind) for c, kind in enumerate(row) if kind not in LEGEND)
            fail((r, c), f"{kind!r} is none of " + ", ".join(f"{k} ({n})" for k, n in LEGEND.items()))
        if len(row) != width:
            fail((r, min(len(row), width)), f"the row has {len(row)} cells, but the first one has {width}")
    border = np.ones(plan.shape, bool)
    border[1:-1, 1:-1] = False
    for cell in np.argwhere(border & (plan.symbols != WALL)).tolist():
        kind = plan[tuple(cell)]
        fail(cell, f"the border must be all wall (#), and here is a {LEGEND[kind]} ({kind})")

    if not plan.free_cells:
        fail((0, 0), "the plan has no free cell (.)")
    start = plan.free_cells[0]
    for cell in np.flatnonzero(~plan.graph.is_connected()).tolist():
        origin = f"line {start[0] + first_line}, column {start[1] + 1}"
        fail(plan.free_cells[cell], f"this free cell is not connected to the one at {origin}")
    for cell in plan.cells_of(STAIRWELL, CANDLE, TABLE, BIN):
        if not plan.free_neighbours(cell):
            fail(cell, f"this {LEGEND[plan[cell]]} ({plan[cell]}) cannot be reached: no free cell is beside it")
    everywhere = f"in lines {first_line} to {first_line + height - 1}, columns 1 to {width}"
    if not plan.bins:
        raise FloorPlanError(f"floor plan '{plan.name}' has no toy bin (B) {everywhere}: the child has nowhere to go")
    if plan.candle_tables and len(plan.candle_tables) == len(plan.tables):
        raise FloorPlanError(
            f"floor plan '{plan.name}' has no bare table (T) {everywhere}: there is nowhere to take a candle"
        )
