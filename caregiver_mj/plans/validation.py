"""What makes a floor plan valid, and what to say where it is not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.symbols import BIN, CANDLE, LEGEND, STAIRWELL, TABLE, WALL

if TYPE_CHECKING:
    from caregiver_mj.plans.floor_plan import FloorPlan


def validate(plan: FloorPlan, first_line: int) -> None:
    """Raises FloorPlanError, with all that is wrong with a plan, if anything is.

    Args:
        plan: What has been read.
        first_line: Line of the text in which the plan begins, counted from 1.
    """
    # One after the other: what is asked next would be in vain, or follow from what is wrong already.
    for problems in (_of_rows, _of_border, _of_cells):
        if found := list(problems(plan, first_line)):
            raise FloorPlanError(*found)


def _at(plan: FloorPlan, first_line: int, cell: Cell, problem: str) -> str:
    row, column = cell
    return f"floor plan '{plan.name}' line {row + first_line}, column {column + 1}: {problem}"


def _of_rows(plan: FloorPlan, first_line: int) -> Iterator[str]:
    width = len(plan.rows[0])
    legend = ", ".join(f"{k} ({n})" for k, n in LEGEND.items())
    for r, row in enumerate(plan.rows):
        for c, kind in enumerate(row):
            if kind not in LEGEND:
                yield _at(plan, first_line, (r, c), f"{kind!r} is none of {legend}")
        if len(row) != width:
            problem = f"the row has {len(row)} cells, but the first one has {width}"
            yield _at(plan, first_line, (r, min(len(row), width)), problem)


def _of_border(plan: FloorPlan, first_line: int) -> Iterator[str]:
    border = np.ones(plan.shape, bool)
    border[1:-1, 1:-1] = False
    for row, column in np.argwhere(border & (plan.symbols != WALL)).tolist():
        kind = plan[row, column]
        problem = f"the border must be all wall (#), and here is a {LEGEND[kind]} ({kind})"
        yield _at(plan, first_line, (row, column), problem)
    if not plan.free_cells:
        yield _at(plan, first_line, (0, 0), "the plan has no free cell (.)")


def _of_cells(plan: FloorPlan, first_line: int) -> Iterator[str]:
    start = plan.free_cells[0]
    origin = f"line {start[0] + first_line}, column {start[1] + 1}"
    for index in np.flatnonzero(~plan.graph.is_connected()).tolist():
        problem = f"this free cell is not connected to the one at {origin}"
        yield _at(plan, first_line, plan.free_cells[index], problem)
    for cell in plan.cells_of(STAIRWELL, CANDLE, TABLE, BIN):
        if not plan.free_neighbours(cell):
            problem = f"this {LEGEND[plan[cell]]} ({plan[cell]}) cannot be reached: no free cell is beside it"
            yield _at(plan, first_line, cell, problem)
    height, width = plan.shape
    everywhere = f"in lines {first_line} to {first_line + height - 1}, columns 1 to {width}"
    if not plan.bins:
        yield f"floor plan '{plan.name}' has no toy bin (B) {everywhere}: the child has nowhere to go"
    if plan.candle_tables and len(plan.candle_tables) == len(plan.tables):
        yield f"floor plan '{plan.name}' has no bare table (T) {everywhere}: there is nowhere to take a candle"
