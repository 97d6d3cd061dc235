"""A planner that is told what the caregiver with foresight has to find out: the child's toy bin and epsilon."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import EPSILONS
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.told import ToldCaregiver, Truth


class KnowsGoalCaregiver(ForesightCaregiver, ToldCaregiver):
    """Is told the toy bin and the epsilon of each child, but not what will come by chance, nor of which kind it is.

    It is no bound: its planner is the same, with the same approximations. An epsilon between two that it has plans for
    is believed to be either, so that it is right on an average.
    """

    def hear(self, truth: Truth) -> None:
        goals = self.belief.probability.shape[2]
        bins = len(self.plan.bins)
        at_goal = truth.goal[..., None] == np.arange(goals)  # (B, K, G): as a novice
        known = np.array(EPSILONS)
        epsilon = np.clip(truth.epsilon, known[0], known[-1])
        above = np.clip(np.searchsorted(known, epsilon), 1, len(known) - 1)
        share = (epsilon - known[above - 1]) / (known[above] - known[above - 1])
        each = np.eye(len(known))
        of_epsilon = (1 - share)[..., None] * each[above - 1] + share[..., None] * each[above]
        novice = self.belief.probability[:, :, :bins].sum(axis=(2, 3), keepdims=True)
        told = novice * at_goal[..., None] * of_epsilon[:, :, None]
        self.belief.probability = np.where(np.arange(goals)[:, None] < bins, told, self.belief.probability)
