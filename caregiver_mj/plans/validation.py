"""What makes a floor plan valid, and what to say where it is not."""

from __future__ import annotations

import collections
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
    ((width, _),) = collections.Counter(map(len, plan.rows)).most_common(1)
    legend = ", ".join(f"{k} ({n})" for k, n in LEGEND.items())
    for r, row in enumerate(plan.rows):
        wrong = [c for c, kind in enumerate(row) if kind not in LEGEND]
        if wrong:
            problem = f"{row[wrong[0]]!r} is none of {legend}{_and_more(wrong)}"
            yield _at(plan, first_line, (r, wrong[0]), problem)
        elif len(row) != width:
            problem = f"the row has {len(row)} cells, but most have {width}"
            yield _at(plan, first_line, (r, min(len(row), width)), problem)


def _of_border(plan: FloorPlan, first_line: int) -> Iterator[str]:
    border = np.ones(plan.shape, bool)
    border[1:-1, 1:-1] = False
    open_ = border & (plan.symbols != WALL)
    for row in np.flatnonzero(open_.any(axis=1)).tolist():
        wrong = np.flatnonzero(open_[row]).tolist()
        kind = plan[row, wrong[0]]
        problem = f"the border must be all wall (#), and here is a {LEGEND[kind]} ({kind}){_and_more(wrong)}"
        yield _at(plan, first_line, (row, wrong[0]), problem)
    if not plan.free_cells:
        yield _at(plan, first_line, (0, 0), "the plan has no free cell (.)")


def _and_more(wrong: list[int]) -> str:
    """What to add to what is wrong with the first of some cells of a row."""
    return f", and {len(wrong) - 1} more in this line" if len(wrong) > 1 else ""


def _of_cells(plan: FloorPlan, first_line: int) -> Iterator[str]:
    start, cut_off = plan.free_cells[0], np.flatnonzero(~plan.graph.is_connected()).tolist()
    if cut_off:
        more = f", nor are {len(cut_off) - 1} more" if len(cut_off) > 1 else ""
        origin = f"line {start[0] + first_line}, column {start[1] + 1}"
        problem = f"this free cell is not connected to the one at {origin}{more}"
        yield _at(plan, first_line, plan.free_cells[cut_off[0]], problem)
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
