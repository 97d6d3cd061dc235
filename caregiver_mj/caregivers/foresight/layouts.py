"""In which ways candles can stand on tables, as far as the caregiver thinks ahead of them."""

from __future__ import annotations

import abc
import itertools

import numpy as np

from caregiver_mj.plans.hazards import NOTHING


class Layouts(abc.ABC):
    """Layouts between which candles can be carried. Candles are all alike.

    Attributes:
        bears: Which tables bear a candle, bool (layouts, tables).
        after: The layout after a candle has been moved from one table to another, (layouts, tables, tables), or
            NOTHING where that is not thought of.
    """

    bears: np.ndarray
    after: np.ndarray

    def __len__(self) -> int:
        return len(self.bears)

    @abc.abstractmethod
    def now(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        """The layouts in which the house is now, the best of which counts: (W, at least one).

        Args:
            tables: The table of each candle, (W, candles).
            bare: The tables without one, (W, bare tables).
        """

    @abc.abstractmethod
    def later(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        """The layout after each candle has been moved to each bare table, (W, candles, bare tables)."""


class AllLayouts(Layouts):
    """Every choice of as many tables as there are candles: nothing is left out."""

    def __init__(self, tables: int, candles: int):
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

    def now(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        return self._find((np.int64(1) << tables).sum(axis=1))[:, None]

    def later(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        return self.after[self.now(tables, bare)[..., None], tables[:, :, None], bare[:, None, :]]


class PairLayouts(Layouts):
    """One candle that stands on the one or on the other of two tables, for every two of them.

    A house is in as many of these as it has candles and bare tables. To think of one pair at a time is to expect that
    no other candle will be touched later on: it sees less than there is to gain, and never more.
    """

    def __init__(self, tables: int):
        source, target = np.nonzero(~np.eye(tables, dtype=bool))
        self._number = np.full((tables, tables), NOTHING)  # of the layout with the candle on the first one
        self._number[source, target] = np.arange(len(source))
        self.bears = source[:, None] == np.arange(tables)
        self.after = np.full((len(source), tables, tables), NOTHING)
        self.after[np.arange(len(source)), source, target] = self._number[target, source]

    def now(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        return self._number[tables[:, :, None], bare[:, None, :]].reshape(len(tables), -1)

    def later(self, tables: np.ndarray, bare: np.ndarray) -> np.ndarray:
        return self._number[bare[:, None, :], tables[:, :, None]]
