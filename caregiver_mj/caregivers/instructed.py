"""A caregiver that is told what to do: by a task that names its goal."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.interventions.intervention import RELOCATE, Intervention
from caregiver_mj.plans.hazards import NOTHING


class InstructedCaregiver(Caregiver):
    """Does the one thing that it was told, instead of looking for danger. It serves one world at a time.

    Attributes:
        orders: What it was told.
    """

    takes_orders = True
    orders = Intervention()

    def choose(self, percept: Percept) -> np.ndarray:
        candle = self.plan.hazards.candle(self.orders.hazard)
        done = self.orders.verb == RELOCATE and percept.candle_table[0, candle] == self.orders.destination
        return np.array([NOTHING if done else self.orders.hazard])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return np.array([self.orders.destination])
