"""The avoider: a child that plans its way round the caregiver."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.novice import Novice, shortest_path_actions
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan


class Avoider(Novice):
    """A novice to whose eyes the cell in which the caregiver stands is closed.

    Where that leaves no way to its bin it takes the shortest one there is, and runs into the caregiver if that stays.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._round: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # by caregiver cell, as `shortest_path_actions`

    def ways(self, sight: Sight) -> tuple[np.ndarray, np.ndarray]:
        count, actions = super().ways(sight)
        for cell in np.unique(sight.caregiver_cell).tolist():
            if 0 <= cell < len(self.plan.free_cells):  # on a landing it is in no way to a toy
                which = np.flatnonzero(sight.caregiver_cell == cell)
                if cell not in self._round:
                    self._round[cell] = self._ways_round(cell)
                counts, choices = self._round[cell]
                count[which] = counts[sight.cell[which], sight.goal[which]]
                actions[which] = choices[sight.cell[which], sight.goal[which]]
        return count, actions

    def _ways_round(self, cell: int) -> tuple[np.ndarray, np.ndarray]:
        graph, cells = self.plan.graph, len(self.plan.free_cells)
        landings = range(cells, len(self.plan.caregiver_cells))  # no way through for a child
        distance = graph.distances_from(graph.beside(self.plan.bins), [cell, *landings])[:, :cells].T.astype(int) + 1
        count, actions = shortest_path_actions(self.plan, distance)
        none = distance > UNREACHABLE
        count[none], actions[none] = self._greedy_count[none], self._greedy_actions[none]
        return count.astype(np.int8), actions.astype(np.int8)  # there may be many of them
