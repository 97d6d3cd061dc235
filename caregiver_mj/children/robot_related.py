"""Children that react to the caregiver: they seek it, avoid it, or run into it."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, ChildPercept
from caregiver_mj.children.novice import Novice, shortest_path_actions
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


class Seeker(Novice):
    """Goes to the caregiver, except for a share epsilon of random moves; a novice without a caregiver."""

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._adversary = Adversary(plan, epsilon)

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        seeks = (draws[:, 0] >= self.epsilons(len(draws))) & (sight.caregiver_cell != NOTHING)
        return np.where(seeks, self._adversary.act(sight, draws), super().act(sight, draws))


class Avoider(Novice):
    """A novice that treats the caregiver's cell as closed.

    If that leaves no way to its bin, it takes the shortest way, and runs into the caregiver if that stays.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._round: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # by caregiver cell, as `shortest_path_actions`

    def ways(self, sight: ChildPercept) -> tuple[np.ndarray, np.ndarray]:
        count, actions = super().ways(sight)
        for cell in np.unique(sight.caregiver_cell).tolist():
            if 0 <= cell < len(self.plan.free_cells):  # a landing is on no way to a toy
                which = np.flatnonzero(sight.caregiver_cell == cell)
                if cell not in self._round:
                    self._round[cell] = self._ways_round(cell)
                counts, choices = self._round[cell]
                count[which] = counts[sight.cell[which], sight.goal[which]]
                actions[which] = choices[sight.cell[which], sight.goal[which]]
        return count, actions

    def _ways_round(self, cell: int) -> tuple[np.ndarray, np.ndarray]:
        graph, cells = self.plan.graph, len(self.plan.free_cells)
        landings = range(cells, len(self.plan.caregiver_cells))  # a child cannot cross them
        distance = graph.distances_from(graph.beside(self.plan.bins), [cell, *landings])[:, :cells].T.astype(int) + 1
        count, actions = shortest_path_actions(self.plan, distance)
        none = distance > UNREACHABLE
        count[none], actions[none] = self._greedy_count[none], self._greedy_actions[none]
        return count.astype(np.int8), actions.astype(np.int8)  # to save memory


class Adversary(Behaviour):
    """Takes the shortest way to the caregiver and runs into it; without a caregiver it goes north for ever."""

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._known: dict[int, np.ndarray] = {}  # results of `towards`, by goal

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        goals = np.unique(sight.caregiver_cell)
        for goal in goals[goals >= 0]:
            if int(goal) not in self._known:
                self._known[int(goal)] = self.towards(int(goal))
        none = np.zeros(len(self.plan.free_cells), int)
        pairs = zip(sight.cell.tolist(), sight.caregiver_cell.tolist(), strict=True)
        return np.array([self._known.get(goal, none)[cell] for cell, goal in pairs])

    def towards(self, goal: int) -> np.ndarray:
        """Return its move in every free cell for a caregiver's cell, (free cells,)."""
        plan = self.plan
        distance = plan.graph.distances_from([goal])[0].astype(float)
        distance[len(plan.free_cells) :] = np.inf  # it avoids stairs, ...
        distance[goal] = 0.0  # ... unless the robot is there
        distance = np.append(distance, np.inf)  # index -1: no cell
        return distance[plan.graph.around[: len(plan.free_cells)]].argmin(axis=1)
