"""A caregiver that childproofs the house beforehand, as parents do, instead of following the child."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array

from caregiver_mj.caregivers.baselines import GuardCaregiver
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.danger.exposure import expected_visits
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan

EPSILON = 0.5  # of the novice that is expected


class ChildproofCaregiver(GuardCaregiver):
    """Puts the candles on the tables into which a novice is least likely to bump, then guards the nearest stairwell."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        chosen = np.argsort(table_exposure(plan), kind="stable")[: len(plan.candle_tables)].tolist()
        # A candle that is on one of them already stays; the others take in turn what is left.
        left = iter([table for table in chosen if table not in plan.candle_tables])
        self._tables = np.array([table if table in chosen else next(left) for table in plan.candle_tables], int)

    def prepare(self, candle_table: np.ndarray) -> np.ndarray:
        return np.tile(self._tables, (len(candle_table), 1))


def table_exposure(plan: FloorPlan, epsilon: float = EPSILON, timesteps: int = EPISODE_TIMESTEPS) -> np.ndarray:
    """Expected bumps of a novice into each table in an episode, if nobody is in its way: exact, (tables,).

    The novice is a Markov chain on pairs of its cell and its bin. It starts in any of them with equal probability.
    """
    bins, states = len(plan.bins), len(plan.free_cells) * len(plan.bins)
    probability = Novice(plan, epsilon).action_probabilities()  # (cells, bins, actions)
    next_cell, target, index = plan.graph.moves
    reaches = ((target == Target.BIN) & (index == np.arange(bins)[:, None, None])).transpose(1, 0, 2)
    # A bin that has been reached is followed by any of them, else the next one is the same one.
    next_bin = np.where(reaches[..., None], 1.0 / bins, np.eye(bins)[:, None, :])
    chance = probability[..., None] * next_bin  # (cells, bins, actions, next bins)
    cell, goal, action, after = np.nonzero(chance)
    entries = chance[cell, goal, action, after], (cell * bins + goal, next_cell[cell, action] * bins + after)
    transition = coo_array(entries, shape=(states, states)).tocsr()
    visits = expected_visits(transition, np.full(states, 1.0 / states), timesteps).reshape(-1, bins)

    tries = (visits[..., None] * probability).sum(axis=1)  # (cells, actions)
    return tries[target == Target.TABLE] @ np.eye(len(plan.tables))[index[target == Target.TABLE]]
