"""Where a caregiver is in a child's way, and where a child could shut it in: what to know in order to yield."""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan


@functools.lru_cache(maxsize=16)
def yielding(plan: FloorPlan) -> Yielding:
    """What there is to know of a floor plan; made once."""
    return Yielding(plan)


class Yielding:
    """The ways of a child to its toy bins, seen by somebody who could stand in them."""

    def __init__(self, plan: FloorPlan):
        self._plan = plan

    def routes_over(self, child_cell: int) -> np.ndarray:
        """How much a caregiver would be in a child's way in each cell.

        Args:
            child_cell: Index of the child's free cell.

        Returns:
            The number of toy bins to which a shortest path of the child leads over the cell, (caregiver cells,).
        """
        routes = np.zeros(len(self._plan.caregiver_cells), int)  # none leads over a landing
        distance = self._plan.graph.child_distances_from([child_cell])[0]
        routes[: len(distance)] = self._on_shortest_path(child_cell, distance).sum(axis=1)
        return routes

    def _on_shortest_path(self, child_cell: int, distance: np.ndarray) -> np.ndarray:
        """Whether a free cell is on some shortest path from the child to a toy bin: bool (free cells, bins)."""
        to_bins = self._plan.graph.bin_distances
        return distance[:, None] + to_bins == to_bins[child_cell]

    @functools.cached_property
    def traps(self) -> np.ndarray:
        """Whether a child can shut the caregiver in where every cell bars its way: bool (caregiver cells,).

        Such as at the end of a passage that leads to a toy bin: neither can then go on.
        """
        plan = self._plan
        traps = np.zeros(len(plan.caregiver_cells), bool)
        for child_cell in range(len(plan.free_cells)):
            part = plan.graph.parts(child_cell)
            if part.max() > 1:  # more than the child's cell and the rest
                # A cell bars the way if it is the only one so far away on the shortest paths to some bin.
                far = plan.graph.child_distances_from([child_cell])[0]
                on_path = self._on_shortest_path(child_cell, far)
                alternatives = np.zeros((far.max() + 1, len(plan.bins)), int)
                np.add.at(alternatives, far, on_path)
                bars = np.zeros(len(traps), bool)
                bars[: len(far)] = (on_path & (alternatives[far] == 1)).any(axis=1)
                has_refuge = np.zeros(part.max() + 1, bool)
                has_refuge[part[~bars]] = True
                has_refuge[part[child_cell]] = True
                traps |= ~has_refuge[part]
        return traps
