"""The paper's rule with something left out, to see what that is worth."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept


class StairsCaregiver(PaperCaregiver):
    """The rule on stairwells only: it never touches a candle."""

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        hazards = self.plan.hazards
        return super().worth_protecting(percept) & hazards.is_stairwell(np.arange(len(hazards)))


class CandlesCaregiver(PaperCaregiver):
    """The rule on candles only: it never blocks a stairwell."""

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        hazards = self.plan.hazards
        return super().worth_protecting(percept) & hazards.is_candle(np.arange(len(hazards)))


class PaperStillCaregiver(PaperCaregiver):
    """The rule without making room: where a child bars its way, or there is nothing to do, it stays where it is.

    The paper says nothing about how its caregiver yields to the child. That it does is ours, and this is without it.
    """

    yields = False
