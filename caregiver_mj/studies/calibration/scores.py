"""How well predictions did: reliability, Brier score and skill, calibration error, with houses as the unit of chance.

A prediction counts the same wherever it was made; intervals resample houses (`intervals.of_ratio`).
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd

from caregiver_mj.experiments.intervals import Estimate, of_ratio
from caregiver_mj.studies.calibration.children import MODELLED, TOGETHER
from caregiver_mj.studies.calibration.tally import BINS

EACH = ("stairwell", "candle", "table")  # kinds of questions about one object
_SUMS = ["count", "predicted", "happened", "square"]


@dataclasses.dataclass(frozen=True, eq=False)
class Scores:
    """Predictions of one kind, of one child.

    Attributes:
        count: How many there were in each house and bin, (houses, bins).
        predicted: Sum of what was predicted, likewise.
        happened: How often it happened, likewise.
        square: Sum of the squared differences, likewise.
    """

    count: np.ndarray
    predicted: np.ndarray
    happened: np.ndarray
    square: np.ndarray

    @classmethod
    def of(cls, rows: pd.DataFrame, family: str, horizon: int, kinds: tuple[str, ...] = EACH) -> Scores:
        """Picks them from tallies of several houses."""
        members = MODELLED if family == TOGETHER else (family,)
        some = rows[rows.family.isin(members) & (rows.horizon == horizon) & rows.kind.isin(kinds)]
        houses, place = rows.house.unique(), pd.Index(rows.house.unique())
        index = place.get_indexer(some.house), some.bin.to_numpy()
        found = np.zeros((len(_SUMS), len(houses), BINS))
        for sums, name in zip(found, _SUMS, strict=True):
            np.add.at(sums, index, some[name].to_numpy())
        return cls(*found)

    @property
    def base_rate(self) -> float:
        """Share of the predictions that came true."""
        return self._mean(self.happened.sum())

    @property
    def mean(self) -> float:
        """Mean of what was predicted."""
        return self._mean(self.predicted.sum())

    def bias(self) -> Estimate[float]:
        """What was predicted over what happened: above 1 it was too much."""
        return of_ratio(self.predicted.sum(axis=1), self.happened.sum(axis=1))

    @property
    def brier(self) -> float:
        """Mean squared difference (Brier score)."""
        return self._mean(self.square.sum())

    def skill(self) -> Estimate[float]:
        """1 - the Brier score over that of somebody who always says the base rate: 1 at best, 0 no better than that."""
        rate, happened = self.base_rate, self.happened.sum(axis=1)
        by_rate = self.count.sum(axis=1) * rate**2 + happened * (1 - 2 * rate)
        value, low, high = of_ratio(self.square.sum(axis=1), by_rate)
        return Estimate(1 - value, 1 - high, 1 - low)

    @property
    def calibration_error(self) -> float:
        """Mean distance of frequency and prediction, bin by bin (expected calibration error)."""
        return self._mean(np.abs((self.predicted - self.happened).sum(axis=0)).sum())

    def _mean(self, total: float) -> float:
        """A sum over all predictions as their mean; NaN where there are none."""
        count = self.count.sum()
        return float(total / count) if count else np.nan

    def reliability(self) -> tuple[np.ndarray, Estimate[np.ndarray]]:
        """Of every bin the mean of what was predicted, and the frequency with which it happened, (bins,) each."""
        count = self.count.sum(axis=0)
        predicted = np.divide(self.predicted.sum(axis=0), count, out=np.full(BINS, np.nan), where=count > 0)
        return predicted, of_ratio(self.happened, self.count)
