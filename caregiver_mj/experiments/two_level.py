"""Intervals over many houses: the house is the sampling unit, because claims are about unseen houses.

They resample houses, then episodes in each, and are studentised over houses. Percentiles of such resamples would count
the variation of the few episodes in a house twice. All houses have equal weight.

A sample is a sequence of arrays, one for each house, (episodes,) or (episodes, columns).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from caregiver_mj.experiments import intervals
from caregiver_mj.experiments.intervals import Estimate

Houses = Sequence[np.ndarray]

_BANK = 999  # resamples of the episodes of each house


def house_means(houses: Houses) -> np.ndarray:
    """Return the mean of each house, (houses,) or (houses, columns)."""
    return np.stack([np.mean(house, axis=0, dtype=float) for house in houses])


def of_mean(houses: Houses, least: float = -np.inf) -> Estimate[Any]:
    """Return the mean over houses; see `intervals.of_mean`."""

    def one(bank: np.ndarray) -> Estimate[float]:
        found = _interval(bank[0], np.ones(bank.shape[1]), _again(bank) - bank[0].mean())
        return found._replace(low=max(found.low, least))

    return _each(one, _bank(houses), houses)


def of_difference(ours: Houses, theirs: Houses) -> Estimate[Any]:
    """Return the mean over houses of ours less theirs; see `intervals.of_difference`."""
    return of_mean([np.asarray(y, float) - x for y, x in zip(ours, theirs, strict=True)])


def of_ratio(ours: Houses, theirs: Houses, least: float = 0.0) -> Estimate[Any]:
    """Return the mean over houses of ours, over that of theirs; see `intervals.of_ratio`."""

    def one(bank: np.ndarray) -> Estimate[float]:
        (y, again_y), (x, again_x) = ((part[0], _again(part)) for part in bank)
        ratio = y.sum() / x.sum() if x.sum() > 0 else np.nan
        return _not_below(least, _interval(y, x, again_y - ratio * again_x), ((y != 0) | (x != 0)).sum())

    return _each(one, np.stack([_bank(ours), _bank(theirs)], axis=1), ours)


def of_mean_ratio(ours: Houses, theirs: Houses) -> Estimate[Any]:
    """Return the mean ratio over the houses that have one, because theirs are not all zero.

    In houses with few events the ratio of a few episodes is biased upwards, and so is this mean; the ratio of means
    over houses (`of_ratio`) is not.
    """

    def one(bank: np.ndarray) -> Estimate[float]:
        (y, again_y), (x, again_x) = ((part[0], _again(part)) for part in bank)
        ratios = _ratios(y, x)[x > 0]
        if not len(ratios):
            return Estimate(np.nan, np.nan, np.nan)
        errors = _ratios(again_y, again_x) - ratios.mean()
        return _not_below(0.0, _interval(ratios, np.ones_like(ratios), errors), len(ratios))

    return _each(one, np.stack([_bank(ours), _bank(theirs)], axis=1), ours)


def _each(one: Callable[[np.ndarray], Estimate[float]], banks: np.ndarray, houses: Houses) -> Estimate[Any]:
    """Return an estimate of every column; numbers if the houses have no columns."""
    found = [one(bank) for bank in banks]
    return found[0] if np.ndim(houses[0]) == 1 else Estimate(*map(np.array, zip(*found, strict=True)))


def _bank(houses: Houses) -> np.ndarray:
    """Return the means of each house and of resamples of its episodes, (columns, 1 + resamples, houses).

    Houses with equally many episodes share their resamples, so that banks of paired samples are paired.
    """
    data = [np.asarray(house, float).reshape(len(house), -1) for house in houses]
    bank = np.empty((1 + _BANK, len(data), data[0].shape[1]))
    bank[0] = house_means(data)
    sizes = np.array([len(house) for house in data])
    for size in np.unique(sizes):
        alike = np.flatnonzero(sizes == size)
        episodes = np.concatenate([data[j] for j in alike], axis=1)  # (episodes, houses x columns)
        again = np.concatenate([part @ episodes for part in intervals.shares(size, _BANK)])
        bank[1:, alike] = again.reshape(_BANK, len(alike), -1)
    return np.ascontiguousarray(np.moveaxis(bank, 2, 0))


@functools.lru_cache(maxsize=2)
def _drawn(houses: int) -> np.ndarray:
    """Return the flat index into a bank for each house of each resample, (resamples, houses)."""
    random = np.random.default_rng(0)
    size = intervals.resamples(houses), houses
    house = random.integers(houses, size=size)
    drawn = random.integers(1, 1 + _BANK, size=size) * houses + house
    drawn.flags.writeable = False  # it belongs to the cache
    return drawn


def _again(bank: np.ndarray) -> np.ndarray:
    """Return the means of resampled houses, (resamples, houses), from a bank (1 + resamples, houses)."""
    return bank.ravel()[_drawn(bank.shape[1])]


def _ratios(above: np.ndarray, below: np.ndarray) -> np.ndarray:
    return np.divide(above, below, out=np.full_like(below, np.nan), where=below > 0)


def _interval(above: np.ndarray, below: np.ndarray, errors: np.ndarray) -> Estimate[float]:
    """Return the ratio of means over houses, of numerators and denominators (J,).

    The errors are of resamples, (resamples, J), NaN for a house to leave out.
    """
    if not below.sum() > 0:
        return Estimate(np.nan, np.nan, np.nan)
    ratio = float(above.sum() / below.sum())
    if len(below) < 2:
        return Estimate(ratio, -np.inf, np.inf)
    scale = ((above - ratio * below) ** 2).mean()
    if np.isnan(errors).any():
        counts = ~np.isnan(errors)
        count, errors = np.maximum(counts.sum(axis=1), 1), np.where(counts, errors, 0.0)
    else:
        count = len(errors.T)
    mean, square = errors.sum(axis=1) / count, np.einsum("ij,ij->i", errors, errors) / count
    rounding = intervals.EXACT * (above**2).mean()
    if scale <= rounding:  # equal houses, which say nothing of others if their episodes differ
        return Estimate(ratio, ratio, ratio) if square.max() <= rounding else Estimate(ratio, -np.inf, np.inf)
    t = intervals.pivots(mean[None], square[None], count, scale[None, None])
    low, high = intervals.solve(above[None], below[None], *intervals.quantiles(t))
    return Estimate(ratio, float(low[0]), float(high[0]))


def _not_below(least: float, estimate: Estimate[float], telling: int) -> Estimate[float]:
    """Bound an estimate from below; one at its bound has no upper end."""
    value, low, high = estimate
    if value == least or (low == high and telling < intervals.TELLING):
        return Estimate(value, least, np.inf)
    return Estimate(value, float(np.maximum(low, least)), high)
