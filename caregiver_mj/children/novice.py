"""The novice, an epsilon-greedy toddler that goes from toy bin to toy bin, and the expert, which never strays."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, ChildPercept
from caregiver_mj.children.random_stream import pick
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan

EXPERT_TIMESTEPS = 1000  # total moves of the trajectories (paper, section V.C)


class Novice(Behaviour):
    """The paper's novice.

    With probability epsilon a move is uniformly random among the four; else uniformly random among those that begin a
    shortest collision-free path to the current bin. (The paper's text calls the other share epsilon; its "75 % random"
    novice is epsilon = 0.75 here.)
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._greedy_count, self._greedy_actions = shortest_path_actions(plan)

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        at_random = draws[:, 0] < self.epsilons(len(draws))
        count, actions = self.ways(sight)
        greedy = actions[np.arange(len(count)), pick(draws[:, 1], count)]
        return np.where(at_random, pick(draws[:, 1], len(ACTIONS)), greedy)

    def ways(self, sight: ChildPercept) -> tuple[np.ndarray, np.ndarray]:
        """Return the number of greedy moves, (B,), and these, (B, 4), padded."""
        return self._greedy_count[sight.cell, sight.goal], self._greedy_actions[sight.cell, sight.goal]

    def action_probabilities(self) -> np.ndarray:
        """Return the probability of each move, (free cells, bins, 4); the last dimension sums to 1."""
        cells, bins = self._greedy_count.shape
        greedy = np.zeros((cells, bins, len(ACTIONS)))
        for number in range(len(ACTIONS)):
            cell, goal = np.nonzero(self._greedy_count > number)
            greedy[cell, goal, self._greedy_actions[cell, goal, number]] = 1.0 / self._greedy_count[cell, goal]
        return self.epsilon / len(ACTIONS) + (1.0 - self.epsilon) * greedy


class Expert(Novice):
    """A novice without random moves: the paper's expert (section V.C)."""

    def __init__(self, plan: FloorPlan, epsilon: float = 0.0):
        super().__init__(plan, epsilon)
        self.epsilon = 0.0


def shortest_path_actions(plan: FloorPlan, distance: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the first moves of all shortest paths from every cell to every bin.

    Args:
        plan: The house.
        distance: Distance to every bin, (free cells, bins); `CellGraph.bin_distances` by default.

    Returns:
        The number of such moves, (free cells, bins), and the moves, (free cells, bins, 4), padded with zeros.
    """
    next_cell, target, index = plan.graph.moves
    distance = plan.graph.bin_distances if distance is None else distance
    bins = np.arange(len(plan.bins))
    count = np.zeros(distance.shape, int)
    actions = np.zeros((*distance.shape, len(ACTIONS)), int)
    for action in range(len(ACTIONS)):
        closer = (target[:, action] == Target.FREE)[:, None] & (distance[next_cell[:, action]] < distance)
        reaches = (target[:, action] == Target.BIN)[:, None] & (index[:, action, None] == bins)
        cells, goals = np.nonzero(closer | reaches)
        actions[cells, goals, count[cells, goals]] = action
        count[cells, goals] += 1
    return count, actions


def expert_trajectories(
    plan: FloorPlan, random: np.random.Generator, timesteps: int = EXPERT_TIMESTEPS
) -> list[list[tuple[int, int]]]:
    """Return shortest collision-free routes from random cells to random toy bins (paper, section V.C).

    Routes are lists of (free cell index, action index); the last action reaches into the bin. The last route is cut off
    at `timesteps` moves in total.
    """
    if timesteps < 0:
        raise CaregiverError(f"timesteps of experts must be at least 0, got {timesteps}")
    count, actions = shortest_path_actions(plan)
    next_cell, target, index = plan.graph.moves
    trajectories: list[list[tuple[int, int]]] = []
    left = timesteps
    while left:
        cell, goal = int(random.integers(len(plan.free_cells))), int(random.integers(len(plan.bins)))
        trajectory: list[tuple[int, int]] = []
        arrived = False
        while left and not arrived:
            choice = int(pick(np.float64(random.random()), count[cell, goal]))
            action = int(actions[cell, goal, choice])
            trajectory.append((cell, action))
            arrived = target[cell, action] == Target.BIN and index[cell, action] == goal
            cell = int(next_cell[cell, action])
            left -= 1
        trajectories.append(trajectory)
    return trajectories
