"""Other intervals of a ratio of means, to compare ours with; samples are (columns, n)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import stats

from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.experiments.studentised import CONFIDENCE, solve

Ends = tuple[np.ndarray, np.ndarray]
IN_USE = "studentised (in use)"

_RESAMPLES = 1999
_TAILS = np.array([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])


def studentised(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """The one in use, with the resamples that it always has."""
    found = of_ratio(ours.T, theirs.T)
    return found.low, found.high


def fieller(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """Fieller's interval, of normal theory."""
    t = np.full(len(ours), stats.t.ppf(_TAILS[1], ours.shape[1] - 1))
    return solve(ours, theirs, -t, t)


def percentile(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """Quantiles of resampled ratios."""
    again = _resampled(ours, theirs, random)
    low, high = (_quantile(again, np.full(len(ours), tail)) for tail in _TAILS)
    return low, high


def bca(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """Bias-corrected and accelerated ones (Efron 1987), as of `scipy.stats.bootstrap`."""
    again = _resampled(ours, theirs, random)
    ratio = ours.sum(axis=1, keepdims=True) / theirs.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = stats.norm.ppf(((again < ratio).mean(axis=1) + (again <= ratio).mean(axis=1)) / 2)
        without = (ours.sum(axis=1, keepdims=True) - ours) / (theirs.sum(axis=1, keepdims=True) - theirs)
        change = without.mean(axis=1, keepdims=True) - without
        acceleration = np.nan_to_num((change**3).sum(axis=1) / (6 * (change**2).sum(axis=1) ** 1.5))
        moved = (shift + stats.norm.ppf(tail) for tail in _TAILS)
        tails = [stats.norm.cdf(shift + z / (1 - acceleration * z)) for z in moved]
    low, high = (_quantile(again, np.nan_to_num(tail, nan=0.5)) for tail in tails)
    return low, high


METHODS: dict[str, Callable[[np.ndarray, np.ndarray, np.random.Generator], Ends]] = {
    IN_USE: studentised,
    "Fieller": fieller,
    "BCa": bca,
    "percentile": percentile,
}


def _resampled(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Ratios of resamples in order, (columns, resamples), the same for all; NaN, where there is none, last."""
    size = ours.shape[1]
    share = random.multinomial(size, np.full(size, 1 / size), size=_RESAMPLES).T / size
    y, x = ours @ share, theirs @ share
    return np.sort(np.divide(y, x, out=np.full_like(x, np.nan), where=x > 0), axis=1)


def _quantile(ordered: np.ndarray, tail: np.ndarray) -> np.ndarray:
    """Quantiles (columns,) of values in order, (columns, resamples), NaN last."""
    place = tail * ((~np.isnan(ordered)).sum(axis=1) - 1)
    first = np.floor(place).astype(int)[:, None]
    low, high = (np.take_along_axis(ordered, first + i, axis=1)[:, 0] for i in (0, 1))
    share = place - first[:, 0]
    return np.where(share > 0, low + share * (high - low), low)
