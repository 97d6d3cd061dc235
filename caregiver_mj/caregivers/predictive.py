"""The paper's rule with a prediction in it: what P(reach) is worth if it is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.foresight import CHANGE
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.passage import first_passage
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

HORIZON = 15  # timesteps: in as many the caregiver gets anywhere in most houses, and has moved a candle


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
        chain = novice_chain(plan)
        cells, goals, epsilons = chain.shape
        self._passage = first_passage(chain, horizon).reshape(cells, goals * epsilons, -1)
        super().__init__(plan, seed)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.belief = Belief(novice_chain(self.plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self.belief.watch(percept.previous_cell, percept.previous_action)

    def reach(self, percept: Percept) -> np.ndarray:
        belief = self.belief.probability.reshape(*percept.child_cell.shape, -1)
        reach = np.einsum("bkg,bkgo->bko", belief, self._passage[percept.child_cell])  # stairwells, then tables
        stairwells, tables = self.plan.hazards.split(reach)
        table = percept.candle_table[:, None]
        candles = np.take_along_axis(tables, np.where(table == NOTHING, 0, table), axis=2) if tables.size else tables
        candles = np.where(table == NOTHING, 0.0, candles)
        if percept.candle_cell is not None:  # of one on the floor the prediction knows nothing
            on_floor = percept.candle_cell != NOTHING
            near = self.plan.hazards.split(1.0 / self.hazard_distances(percept))[1]
            candles = np.where(on_floor[:, None], near, candles)
        return self.plan.hazards.join(stairwells, candles)
