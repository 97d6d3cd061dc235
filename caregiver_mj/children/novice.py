"""The novice: an epsilon-greedy toddler on its way from toy bin to toy bin, and the expert it is compared to."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan

EPISODE_TIMESTEPS = 200  # novice timesteps an episode (paper, section V.B)

# Damage of a collision (paper, section V.B). Walls, toy bins and the caregiver do none.
STAIRWELL_DAMAGE = 5.0
CANDLE_DAMAGE = 4.0
TABLE_DAMAGE = 1.0
DAMAGE_THRESHOLD = 15.0  # the paper ends an interaction after this much (section V.E)


@dataclasses.dataclass(frozen=True)
class NoviceTape:
    """All the chance in a novice's episode, drawn beforehand.

    Because the draws do not depend on what happens, the same tape gives the same novice alone and with any
    caregiver, in the grid and in the house: common random numbers.

    Attributes:
        start: Uniform draws for the start cells of novice and caregiver, then the first bin: (3,).
        steps: For every timestep uniform draws that decide whether the move is random, which move it is,
            and which bin is next if one is reached: (timesteps, 3).
        caregiver_seed: Seed of this episode for a caregiver that draws lots.
    """

    start: np.ndarray
    steps: np.ndarray
    caregiver_seed: int = 0

    @classmethod
    def draw(cls, random: np.random.RandomState, timesteps: int = EPISODE_TIMESTEPS) -> NoviceTape:
        draws = random.random_sample((timesteps + 1, 3))
        return cls(draws[0], draws[1:], int(random.randint(2**31 - 1)))


def check_epsilon(epsilon: float) -> float:
    """Returns epsilon, or raises CaregiverError unless it lies in [0, 1]."""
    if not 0.0 <= epsilon <= 1.0:  # also refuses NaN
        raise CaregiverError(f"epsilon must lie in [0, 1], not {epsilon}")
    return float(epsilon)


class Novice:
    """The epsilon-greedy policy of the novice on a floor plan, for a batch of novices at once.

    With probability epsilon a move is uniformly random among the four; else it is drawn uniformly among the
    moves that begin a shortest collision-free path to the current bin. (The paper's text writes epsilon for
    the other share; its "75 % random" novice is epsilon = 0.75 here.)
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        self.plan = plan
        self.epsilon = check_epsilon(epsilon)
        self._greedy_count, self._greedy_actions = _shortest_path_actions(plan)

    def start_cell(self, draw: np.ndarray) -> np.ndarray:
        """Start cells (B,), uniform over the free cells, from uniform draws (B,)."""
        return pick(draw, len(self.plan.free_cells))

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        """Bins to go to (B,), uniform over all bins, from uniform draws (B,)."""
        return pick(draw, len(self.plan.bins))

    def act(self, cell: np.ndarray, goal: np.ndarray, draws: np.ndarray) -> np.ndarray:
        """Chooses the moves.

        Args:
            cell: Indices of the novices' free cells, (B,).
            goal: Indices of their current bins, (B,).
            draws: Uniform draws, (B, 2) or more: the first decides whether the move is random, the second which.

        Returns:
            Indices into `ACTIONS`, (B,).
        """
        at_random = draws[:, 0] < self.epsilon
        greedy = self._greedy_actions[cell, goal, pick(draws[:, 1], self._greedy_count[cell, goal])]
        return np.where(at_random, pick(draws[:, 1], len(ACTIONS)), greedy)


def expert_trajectories(
    plan: FloorPlan, random: np.random.Generator, timesteps: int = 1000
) -> list[list[tuple[int, int]]]:
    """Shortest collision-free routes from random cells to toy bins (paper, section V.C).

    Args:
        plan: The house.
        random: Source of the start cells, bins and choices among equally short routes.
        timesteps: Moves in all trajectories together; the last one is cut off there.

    Returns:
        Trajectories as lists of (free cell index, action index); the last action reaches into the bin.
    """
    if timesteps < 1:
        raise CaregiverError(f"experts need at least 1 timestep, not {timesteps}")
    expert = Novice(plan, epsilon=0.0)
    next_cell, target, index = plan.graph.moves
    trajectories: list[list[tuple[int, int]]] = []
    left = timesteps
    while left:
        cell, goal = int(random.integers(len(plan.free_cells))), int(random.integers(len(plan.bins)))
        trajectory: list[tuple[int, int]] = []
        arrived = False
        while left and not arrived:
            draws = np.array([[1.0, random.random()]])
            action = int(expert.act(np.array([cell]), np.array([goal]), draws)[0])
            trajectory.append((cell, action))
            arrived = target[cell, action] == Target.BIN and index[cell, action] == goal
            cell = int(next_cell[cell, action])
            left -= 1
        trajectories.append(trajectory)
    return trajectories


def pick(draw: np.ndarray, count: np.ndarray | int) -> np.ndarray:
    """Uniform choices out of `count` from uniform draws in [0, 1)."""
    return (draw * count).astype(int)


def _shortest_path_actions(plan: FloorPlan) -> tuple[np.ndarray, np.ndarray]:
    """The first moves of all shortest paths from every cell to every bin.

    Returns:
        How many there are, (free cells, bins), and which, (free cells, bins, 4), padded with zeros.
    """
    next_cell, target, index = plan.graph.moves
    distance = plan.graph.bin_distances()  # (free cells, bins)
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
