"""All ways in which candles, which are all alike, can stand on tables."""

from __future__ import annotations

import itertools

import numpy as np

from caregiver_mj.plans.hazards import NOTHING


class Layouts:
    """Which tables bear a candle: one layout for every choice of as many of them as there are candles.

    Attributes:
        tables: Indices of the tables that bear one, (layouts, candles).
        after: The layout after a candle has been moved from one table to another, (layouts, tables, tables), or
            NOTHING if there is no candle on the first table, or one on the second.
    """

    def __init__(self, tables: int, candles: int):
        chosen = list(itertools.combinations(range(tables), candles))
        self.tables = np.array(chosen, int).reshape(len(chosen), candles)
        bits = np.int64(1) << np.arange(tables)
        bears = self.bears = np.zeros((len(self.tables), tables), bool)
        bears[np.arange(len(bears))[:, None], self.tables] = True
        masks = bears @ bits
        self._order = np.argsort(masks)
        self._masks = masks[self._order]
        moved = masks[:, None, None] - bits[:, None] + bits
        valid = bears[:, :, None] & ~bears[:, None, :]
        self.after = np.where(valid, self._find(np.where(valid, moved, masks[:, None, None])), NOTHING)

    def __len__(self) -> int:
        return len(self.tables)

    def _find(self, masks: np.ndarray) -> np.ndarray:
        return self._order[np.searchsorted(self._masks, masks)]

    def of(self, candle_table: np.ndarray) -> np.ndarray:
        """The layouts in which every candle stands on a table of its own, by these, (B, candles): (B,)."""
        return self._find((np.int64(1) << candle_table).sum(axis=1))
