"""What experts do: the trajectories from which a caregiver learns the action prior."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.novice import shortest_path_actions
from caregiver_mj.children.tape import pick
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan

EXPERT_TIMESTEPS = 1000  # moves in all trajectories together (paper, section V.C)


def expert_trajectories(
    plan: FloorPlan, random: np.random.Generator, timesteps: int = EXPERT_TIMESTEPS
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
