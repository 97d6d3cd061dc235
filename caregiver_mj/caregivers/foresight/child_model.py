"""How the caregiver thinks that children move: as novices whose toy bin and epsilon it does not know."""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.children.novice import Novice
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

EPSILONS = (0.05, 0.25, 0.5, 0.75, 1.0)  # that a child is thought to have


@functools.lru_cache(maxsize=4)
def novice_chain(plan: FloorPlan) -> ChildChain:
    """Novices in a house. Its goals are the toy bins; its objects are first the stairwells, then the tables."""
    next_cell, target, index = plan.graph.moves
    goal_at = np.where(target == Target.BIN, index, NOTHING)
    greedy = Novice(plan, 0.0).action_probabilities()
    objects = len(plan.stairwells) + len(plan.tables)
    return ChildChain(greedy, np.array(EPSILONS), next_cell, goal_at, plan.graph.bumps, objects)
