"""The bound of the caregiver with foresight: the same planner with nothing to find out."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import EPSILONS
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.told import ToldCaregiver, Truth


class KnowsGoalCaregiver(ForesightCaregiver, ToldCaregiver):
    """Is told the toy bin and the epsilon of each child, but not what will come by chance.

    An epsilon between two that it has plans for is believed to be either, so that it is right on an average.
    """

    def hear(self, truth: Truth) -> None:
        goals = np.arange(self.belief.probability.shape[2])
        at_goal = truth.goal[..., None] == goals  # (B, K, G)
        known = np.array(EPSILONS)
        epsilon = np.clip(truth.epsilon, known[0], known[-1])
        above = np.clip(np.searchsorted(known, epsilon), 1, len(known) - 1)
        share = (epsilon - known[above - 1]) / (known[above] - known[above - 1])
        each = np.eye(len(known))
        of_epsilon = (1 - share)[..., None] * each[above - 1] + share[..., None] * each[above]
        self.belief.probability = at_goal[..., None] * of_epsilon[:, :, None]
