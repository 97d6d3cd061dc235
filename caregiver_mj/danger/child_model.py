"""The caregiver's model of children: several kinds, with unknown goal and epsilon."""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.children.novice import Novice
from caregiver_mj.children.variants import Adversary
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

EPSILONS = (0.05, 0.25, 0.5, 0.75, 1.0)  # hypotheses: the paper's five novices
OTHERS = (0, 2)  # indices of the other kinds' epsilons; at greater ones kinds are indistinguishable
# Probability per timestep that a child becomes another one. On 34 houses of train-100 and shapes-train-100 .002 left
# 0.2 % less damage, standard error 0.7 %: no significant difference.
CHANGE = 0.005
PRIOR = {"novice": 0.85, "explorer": 0.05, "hazard": 0.05, "caregiver": 0.05}  # probability of each kind


@functools.lru_cache(maxsize=4)
def child_chain(plan: FloorPlan) -> ChildChain:
    """Return the model of the children in a house. Its objects are the stairwells, then the tables.

    Its goals are the toy bins for a novice; the toy bins for an explorer, which knows their places but not the house;
    the nearest hazard; and the caregiver.
    """
    next_cell, target, index = plan.graph.moves
    bins = len(plan.bins)
    novice = Novice(plan, 0.0).action_probabilities()
    explorer = 0.3 * novice + 0.7 * _as_the_crow_flies(plan)  # an explorer learns obstacles
    hazard = _to_nearest_hazard(plan)[:, None]
    alone = novice.mean(axis=1, keepdims=True)  # a follower without a caregiver
    own = [bins, bins, 1, 1]  # goals of each kind
    of_goal = np.repeat(np.array(list(PRIOR.values())) / own, own)
    epsilons = np.zeros((len(of_goal), len(EPSILONS)), bool)
    epsilons[:bins], epsilons[bins:, OTHERS] = True, True
    kind = np.repeat(np.arange(len(own)), own)
    next_goal = (kind[:, None] == kind) / np.array(own)[kind]
    next_goal[-2] = 0.5 * next_goal[0] + 0.5 * next_goal[-2]  # after a hazard it may go on to a bin
    reaches = np.where(target == Target.BIN, index, NOTHING)[..., None] == np.arange(bins)
    bumps = plan.graph.bumps[..., None] >= 0
    return ChildChain(
        greedy=np.concatenate([novice, explorer, hazard, alone], axis=1),
        epsilons=np.array(EPSILONS),
        next_cell=next_cell,
        ends=np.concatenate([reaches, reaches, bumps, np.zeros_like(bumps)], axis=2),
        object_at=plan.graph.bumps,
        objects=len(plan.stairwells) + len(plan.tables),
        bin_of=np.array([*range(bins), *range(bins), NOTHING, NOTHING]),
        next_goal=next_goal,
        prior=of_goal[:, None] * epsilons / epsilons.sum(axis=1, keepdims=True),
        follows=functools.partial(_follow, Adversary(plan, 0.0)),
    )


def _follow(child: Adversary, caregiver_cell: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Return `ChildChain.follows` of a child that goes to the caregiver."""
    return np.eye(len(ACTIONS))[child.towards(caregiver_cell, cell)]


def _as_the_crow_flies(plan: FloorPlan) -> np.ndarray:
    """Return the probability of every move if all cells seem free, (cells, bins, moves)."""
    here, bins, step = np.array(plan.free_cells), np.array(plan.bins), np.array(ACTIONS)
    far = np.abs(bins - here[:, None]).sum(axis=2)  # (cells, bins)
    then = np.abs(bins[None, :, None] - (here[:, None, None] + step)).sum(axis=3)
    closer = then < far[..., None]
    return closer / closer.sum(axis=2, keepdims=True)


def _to_nearest_hazard(plan: FloorPlan) -> np.ndarray:
    """Return the probability of every move towards the nearest stairwell or table, (cells, moves)."""
    next_cell, _, _ = plan.graph.moves
    far = np.concatenate([plan.graph.stairwell_distances, plan.graph.table_distances], axis=1).astype(float)
    if not far.size:
        return np.full(next_cell.shape, 1.0 / next_cell.shape[1])
    nearest = far.min(axis=1)
    there = np.where(plan.graph.bumps >= 0, 0.0, nearest[next_cell])
    closer = there < nearest[:, None]
    return closer / closer.sum(axis=1, keepdims=True)
