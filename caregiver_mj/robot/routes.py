"""Routes for the base from cell to cell of a floor plan, and cells in which it is in nobody's way."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Iterable
from typing import Any

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding
from caregiver_mj.robot.se2 import Vector


def _search(plan: FloorPlan) -> Callable[..., dict[int, int]]:
    """The plan's search. While children are far away, way after way has the same goal and the same cells closed."""
    return functools.lru_cache(maxsize=64)(plan.graph.breadth_first)


class Routes:
    """The cells of one house on which the base can stand, and the ways between them.

    Attributes:
        plan: The house's floor plan.
        centres: Where each of these cells is, metres.
    """

    def __init__(self, plan: FloorPlan, landings: bool = True):
        """Prepares routes.

        Args:
            plan: The house's floor plan.
            landings: Whether the base may stand on the landings of stairwells, too.
        """
        self.plan = plan
        cells = plan.caregiver_cells if landings else plan.free_cells
        self.centres: dict[Cell, Vector] = {cell: tuple(plan.position(cell).tolist()) for cell in cells}
        self._search = _search(plan)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_search"}  # what it remembers stays here

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _search=_search(state["plan"]))

    def nearest_cell(self, position: Vector) -> Cell:
        """The cell on which a base stands (the nearest one that it can stand on)."""
        cell = self.plan.cell_at(position)
        if cell in self.centres:
            return cell
        return min(self.centres, key=lambda c: math.dist(self.centres[c], position))

    def route(self, start: Cell, goal: Cell, closed: Collection[Cell] = ()) -> list[Cell] | None:
        """The cells of a shortest 4-connected route, ends included, or None. Landings are no thoroughfares."""
        if goal in closed:
            return None
        index, cells = self.plan.cell_index, self.plan.caregiver_cells
        next_cell = self._search(index[goal], self._indices({*closed, *self.plan.stairwells} - {start, goal}))
        here = index[start]
        if here not in next_cell:
            return None
        route = [start]
        while route[-1] != goal:
            here = next_cell[here]
            route.append(cells[here])
        return route

    def refuge(self, start: Cell, children: Iterable[Cell], closed: Collection[Cell]) -> Cell | None:
        """The nearest of the cells in which the robot is least in the children's way, without entering closed cells.

        Args:
            start: Where the robot is.
            children: Where each child is.
            closed: Cells not to be entered.

        Returns:
            The cell, or None if no child is in a cell in which children can be.
        """
        known = [self.plan.cell_index[child] for child in children if child in self.plan.free_cells]
        if not known:
            return None
        in_the_way = yielding(self.plan).in_the_way(known)
        # The nearest cells come first, and `min` takes the first of equals.
        landings = [cell for cell in self.plan.stairwells if cell not in self.centres]
        within_reach = self.plan.graph.breadth_first(self.plan.cell_index[start], self._indices({*closed, *landings}))
        return self.plan.caregiver_cells[min(within_reach, key=in_the_way.__getitem__)]

    def _indices(self, cells: Iterable[Cell]) -> frozenset[int]:
        """Indices of cells, save those on which nobody can stand."""
        return frozenset(self.plan.cell_index[cell] for cell in cells if cell in self.plan.cell_index)
