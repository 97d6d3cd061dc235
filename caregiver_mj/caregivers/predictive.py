"""The paper's rule with a prediction in it: what P(reach) is worth if it is one."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import child_chain
from caregiver_mj.caregivers.foresight.foresight import CHANGE
from caregiver_mj.caregivers.outlook import HORIZON, Outlook
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Assessment, Percept
from caregiver_mj.danger.belief import Belief
from caregiver_mj.plans.floor_plan import FloorPlan


class PaperPredictiveCaregiver(PaperCaregiver):
    """The rule, equation (2), in which P(reach) is the probability that the child soon runs into the hazard.

    That follows from where it is and from what its moves have told of its toy bin and its epsilon. P(safe), and with it
    what tells between several children, is the paper's.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0, *, horizon: int = HORIZON):
        """Looks ahead.

        Args:
            plan: The house.
            seed: As for the rule.
            horizon: In how many timesteps is soon.
        """
        self._horizon = horizon
        super().__init__(plan, seed)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.belief = Belief(child_chain(self.plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    def assess(self, percept: Percept) -> Assessment:
        return dataclasses.replace(super().assess(percept), outlook=self._outlook(percept))

    def reach(self, percept: Percept) -> np.ndarray:
        return self._outlook(percept).reach(self.plan, percept, self._horizon)

    def _outlook(self, percept: Percept) -> Outlook:
        return Outlook(child_chain(self.plan), percept.child_cell, self.belief.probability)
