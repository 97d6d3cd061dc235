"""The adversary: a child that heads for the robot, whatever is in between."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, Sight
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan


class Adversary(Behaviour):
    """Takes the first move of a shortest way to the cell in which the caregiver stands, and into it.

    Without a caregiver it goes north for ever.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._known: dict[int, np.ndarray] = {}  # by goal, what `towards` says

    def act(self, sight: Sight, draws: np.ndarray) -> np.ndarray:
        goals = np.unique(sight.caregiver_cell)
        for goal in goals[goals >= 0]:
            if int(goal) not in self._known:
                self._known[int(goal)] = self.towards(int(goal))
        none = np.zeros(len(self.plan.free_cells), int)
        pairs = zip(sight.cell.tolist(), sight.caregiver_cell.tolist(), strict=True)
        return np.array([self._known.get(goal, none)[cell] for cell, goal in pairs])

    def towards(self, goal: int) -> np.ndarray:
        """Return the move that it makes in every free cell if the caregiver is in a cell, (free cells,)."""
        plan = self.plan
        distance = plan.graph.distances_from([goal])[0].astype(float)
        distance[len(plan.free_cells) :] = np.inf  # it knows stairs, ...
        distance[goal] = 0.0  # ... but goes there too if the robot does
        distance = np.append(distance, np.inf)  # what index -1 means: no cell
        ahead = [
            [plan.cell_index.get((row + down, column + right), -1) for down, right in ACTIONS]
            for row, column in plan.free_cells
        ]
        return distance[np.array(ahead)].argmin(axis=1)
