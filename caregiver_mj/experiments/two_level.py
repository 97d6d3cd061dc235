"""Intervals over many houses: the house is the unit of chance, for what is claimed is claimed of houses yet unseen.

They resample houses, then episodes in each of them. They are studentised over houses, in the sample and in its
resamples alike, so that the chance of the few episodes in a house is not counted twice, as it is in percentiles of
such resamples. Every house counts the same, whatever happens in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.studentised import CONFIDENCE, pivots, quantiles, resamples, shares, solve

_BANK = 999  # resamples of the episodes of each house, to draw from


class OverHouses(NamedTuple):
    """A caregiver against another one over J houses.

    Attributes:
        ours: The caregiver's mean in each house, (J,).
        theirs: The other one's, likewise.
        ratios: Their ratios, NaN where nothing happens with the other one.
        mean_ratio: The mean of those ratios that there are. In a house with little damage the ratio of a few episodes
            is too high on average, and so is this.
        ratio_of_means: The ratio of the means over houses, which does not suffer from that.
        mean_difference: The mean of the differences.
    """

    ours: np.ndarray
    theirs: np.ndarray
    ratios: np.ndarray
    mean_ratio: Estimate
    ratio_of_means: Estimate
    mean_difference: Estimate


def over_houses(ours: Sequence[np.ndarray], theirs: Sequence[np.ndarray], confidence: float = CONFIDENCE) -> OverHouses:
    """Sets a caregiver against another one.

    Args:
        ours: For each house a sample (episodes,) that is not negative; houses may have different numbers of them.
        theirs: Samples paired with those.
        confidence: How often the intervals shall cover the truth.
    """
    bank = np.stack([_bank(y, x) for y, x in zip(ours, theirs, strict=True)])  # (J, 1 + resamples, 2)
    y, x = bank[:, 0].T
    random = np.random.default_rng(0)
    size = resamples(len(bank)), len(bank)
    drawn = bank[random.integers(len(bank), size=size), random.integers(1, bank.shape[1], size=size)]
    again_y, again_x = drawn[..., 0], drawn[..., 1]  # (resamples, J)

    ratios, known = _ratios(y, x), x > 0
    centre = ratios[known].mean() if known.any() else np.nan
    mean_ratio = _interval(ratios[known], np.ones(known.sum()), _ratios(again_y, again_x) - centre, confidence)
    ratio = y.sum() / x.sum() if known.any() else np.nan
    ratio_of_means = _interval(y, x, again_y - ratio * again_x, confidence)
    difference = _interval(y - x, np.ones_like(x), again_y - again_x - (y - x).mean(), confidence)
    return OverHouses(y, x, ratios, _not_negative(mean_ratio), _not_negative(ratio_of_means), difference)


def _bank(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Mean of both samples of a house, then of resamples of them, (1 + resamples, 2)."""
    pair = np.stack([ours, theirs], axis=1).astype(float)
    return np.concatenate([pair.mean(axis=0)[None], *(part @ pair for part in shares(len(pair), _BANK))])


def _ratios(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    return np.divide(above, below, out=np.full_like(below, np.nan), where=below > 0)


def _interval(above: np.ndarray, below: np.ndarray, errors: np.ndarray, confidence: float) -> Estimate:
    """The ratio of means over houses.

    Args:
        above: Numerators (J,).
        below: Denominators (J,).
        errors: Those of resamples, (resamples, J), NaN for a house that does not count.
        confidence: Of the interval.
    """
    if not below.any():
        return Estimate(np.nan, np.nan, np.nan)
    ratio = float(above.sum() / below.sum())
    if len(below) < 2:
        return Estimate(ratio, -np.inf, np.inf)
    scale = ((above - ratio * below) ** 2).mean()
    counts = ~np.isnan(errors)
    count, errors = counts.sum(axis=1), np.where(counts, errors, 0.0)
    mean, square = (part.sum(axis=1) / np.maximum(count, 1) for part in (errors, errors**2))
    t = pivots(mean[None], square[None], np.maximum(count, 1), scale[None, None])
    low, high = solve(above[None], below[None], *quantiles(t, confidence))
    return Estimate(ratio, float(low[0]), float(high[0]))


def _not_negative(estimate: Estimate) -> Estimate:
    """The same of a quantity that is not negative; if it is zero everywhere, there is no telling how large it is."""
    high = np.inf if estimate.value == 0 else estimate.high
    return estimate._replace(low=float(np.maximum(estimate.low, 0.0)), high=high)
