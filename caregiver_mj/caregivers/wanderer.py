"""A caregiver that does something useful, whatever it is, and finishes it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.baselines import RandomCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.plans.hazards import NOTHING


class WandererCaregiver(RandomCaregiver):
    """Draws a hazard as `RandomCaregiver` does, but not another one before the first is done with.

    That is the case once it stands in the stairwell, once the candle has come to stand on another table, or once the
    hazard is not worth protecting the children from any more.
    """

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self._target = np.full(batch, NOTHING)
        self._table = np.full(batch, NOTHING)  # on which the candle was when it was drawn

    def choose(self, percept: Percept) -> np.ndarray:
        drawn, goes_on = super().choose(percept), self._goes_on(percept)
        self._target = np.where(goes_on, self._target, drawn)
        self._table = np.where(goes_on, self._table, self._table_of(drawn, percept))
        return self._target

    def _goes_on(self, percept: Percept) -> np.ndarray:
        """Whether there is still something to do about the hazard, (B,)."""
        hazards, target = self.plan.hazards, self._target
        if len(hazards) == 0:
            return np.zeros(len(target), bool)
        worlds, candle, table = np.arange(len(target)), hazards.candle(target), self._table_of(target, percept)
        landing = len(self.plan.free_cells) + hazards.stairwell(target)
        there = hazards.is_stairwell(target) & (percept.caregiver_cell == landing)
        moved = (candle != NOTHING) & (table != NOTHING) & (table != self._table)
        held = (candle != NOTHING) & (candle == percept.holding)  # which is not worth it, as it is safe already
        worth = self.worth_protecting(percept)[worlds, target] | held
        return (target != NOTHING) & worth & ~there & ~moved

    def _table_of(self, hazard: np.ndarray, percept: Percept) -> np.ndarray:
        """The tables on which hazards are, (B,); NOTHING for stairwells, and for candles that are on none."""
        candle = self.plan.hazards.candle(hazard)
        if percept.candle_table.shape[1] == 0:
            return np.full(len(hazard), NOTHING)
        return np.where(candle == NOTHING, NOTHING, percept.candle_table[np.arange(len(hazard)), candle])
