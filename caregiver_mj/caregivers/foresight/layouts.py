"""In which ways candles can stand on tables."""

from __future__ import annotations

import itertools
import math

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


def count_stands(plan: FloorPlan) -> int:
    """How many layouts there are with a post of the caregiver, or with a table that bears a candle in it."""
    tables, candles = len(plan.tables), len(plan.candle_tables)
    return math.comb(tables, candles) * (max(1, len(plan.stairwells)) + candles)


class AllLayouts:
    """Every choice of as many tables as there are candles. Candles are all alike.

    Attributes:
        candles: How many candles there are.
        bears: Which tables bear a candle, bool (layouts, tables).
        after: The layout after a candle has been moved from one table to another, (layouts, tables, tables), or
            NOTHING where there is no candle on the first one, or one on the other.
    """

    def __init__(self, tables: int, candles: int):
        self.candles = candles
        chosen = list(itertools.combinations(range(tables), candles))
        self.bears = np.zeros((len(chosen), tables), bool)
        self.bears[np.arange(len(chosen))[:, None], np.array(chosen, int).reshape(len(chosen), candles)] = True
        bits = np.int64(1) << np.arange(tables)
        masks = self.bears @ bits
        self._order = np.argsort(masks)
        self._masks = masks[self._order]
        moved = masks[:, None, None] - bits[:, None] + bits
        valid = self.bears[:, :, None] & ~self.bears[:, None, :]
        self.after = np.where(valid, self._find(np.where(valid, moved, masks[:, None, None])), NOTHING)

    def _find(self, masks: np.ndarray) -> np.ndarray:
        return self._order[np.searchsorted(self._masks, masks)]

    def __len__(self) -> int:
        return len(self.bears)

    def now(self, tables: np.ndarray) -> np.ndarray:
        """The layout in which the house is now, (...), by the table of each candle, (..., candles)."""
        return self._find((np.int64(1) << tables).sum(axis=-1))
