"""A caregiver whose targets somebody else chooses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.hazards import NOTHING


class CommandedCaregiver(Caregiver):
    """Protects the children from the hazards that it was told, as long as it can do something about them.

    Attributes:
        targets: Number of the hazard for each world, or NOTHING, (B,).
    """

    targets = np.array([NOTHING])

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.targets = np.full(batch, NOTHING)

    def choose(self, percept: Percept) -> np.ndarray:
        worth = self.worth_protecting(percept)
        worth = np.column_stack([worth, np.ones(len(worth), bool)])  # the last one is NOTHING
        return np.where(worth[np.arange(len(worth)), self.targets], self.targets, NOTHING)
