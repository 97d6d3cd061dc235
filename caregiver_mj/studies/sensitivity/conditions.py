"""What is varied in the grid."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.grid.world import CAREGIVER_ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights

WEIGHTS = ("1:1:1", "5:4:1", "20:4:1")  # of a fall down stairs, a bump into a candle's table and one into a bare table
OWN_WEIGHTS = str(DamageWeights())  # the paper's
ACTIONS = (1, 2, 3, 4)  # of the caregiver in a novice timestep


@dataclasses.dataclass(frozen=True)
class Condition:
    """A caregiver, and what it goes by.

    Attributes:
        caregiver: Its name.
        weights: What it takes a collision to cost.
        actions: How many actions it has in a novice timestep.
        reach: Its reading of P(reach), if it is `paper`.
    """

    caregiver: str
    weights: str = OWN_WEIGHTS
    actions: int = CAREGIVER_ACTIONS
    reach: str = "inverse"

    def make(self, plan: FloorPlan) -> Caregiver | None:
        """Makes the caregiver for a house."""
        if self.caregiver == "paper":
            return PaperCaregiver(plan, reach=self.reach)
        return make_caregiver(self.caregiver, plan)


NONE, NEAREST, PAPER, STILL = map(Condition, ("none", "nearest", "paper", "paper-still"))
LINEAR = Condition("paper", reach="linear")
WEIGHTED = {weights: Condition("paper", weights=weights) for weights in WEIGHTS}
SPEEDS = {actions: Condition("paper", actions=actions) for actions in ACTIONS}
# Each once. What `none` and `nearest` do does not depend on what a collision costs.
CONDITIONS = tuple(dict.fromkeys((NONE, NEAREST, PAPER, STILL, LINEAR, *WEIGHTED.values(), *SPEEDS.values())))


def costs(weights: str) -> np.ndarray:
    """Damage of a collision of each kind, in the order of `recording.ledger.KINDS`, (kinds,)."""
    return np.array(dataclasses.astuple(DamageWeights.parse(weights)))
