"""Children that go wherever the caregiver is: what it stands beside they stand beside."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import CHANGE, child_chain
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.danger.belief import Belief
from caregiver_mj.plans.floor_plan import FloorPlan

SURE = 0.9  # probability from which on a child is taken to follow


class Followers:
    """Finds out who follows, by the kinds of children that there may be."""

    def __init__(self, plan: FloorPlan, batch: int, children: int):
        self._belief = Belief(child_chain(plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        """Take in the children's last moves."""
        self._belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    @property
    def there(self) -> np.ndarray:
        """Whether some child follows the caregiver and hardly ever strays, bool (B,)."""
        return np.any(self._belief.probability[..., -1, 0] > SURE, axis=1)
