"""Caregivers that are told what to do: by a task that names its goal, or by a command."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.interventions.verb import RELOCATE, Intervention
from caregiver_mj.plans.hazards import NOTHING, Where


class InstructedCaregiver(Caregiver):
    """Does the one thing that it was told, instead of looking for danger. It serves one world at a time.

    Attributes:
        orders: What it was told.
    """

    takes_orders = True
    orders = Intervention()

    def choose(self, percept: Percept) -> np.ndarray:
        candle = self.plan.hazards.among(Where.ON_TABLE, self.orders.hazard)
        done = self.orders.verb == RELOCATE and percept.candle_table[0, candle] == self.orders.destination
        return np.array([NOTHING if done else self.orders.hazard])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return np.array([self.orders.destination])


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
