"""The seeker: a child that wants to be where the caregiver is."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.adversary import Adversary
from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.novice import Novice
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


class Seeker(Novice):
    """Goes to the caregiver, as an `Adversary` does, but for a share epsilon of its moves, which are random.

    Without a caregiver it is a novice.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._adversary = Adversary(plan, epsilon)

    def act(self, sight: Sight, draws: np.ndarray) -> np.ndarray:
        seeks = (draws[:, 0] >= self.epsilon) & (sight.caregiver_cell != NOTHING)
        return np.where(seeks, self._adversary.act(sight, draws), super().act(sight, draws))
