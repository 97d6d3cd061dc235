"""The studentised bootstrap of a ratio of means, turned into an interval as Fieller's theorem does.

For samples y over x, and a ratio R that may be the true one, the errors e = y - R x have mean zero, so

    t(R) = sqrt(n) mean(e) / sd(e)

is a pivot: its distribution hardly depends on anything unknown, and nothing is divided by a mean that may be close to
zero. Resampling units with replacement says how t is distributed around the ratio of the sample; the interval is all R
with a t(R) between two quantiles of that (Hwang, Biometrika 82, 1995). Swapping y and x gives the reciprocal interval,
other units give the same in other units. With x = 1 it is the bootstrap-t interval of a mean (Efron and Tibshirani, An
Introduction to the Bootstrap, 1993, section 12.5).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

CONFIDENCE = 0.95

_MOST, _LEAST = 9_999, 999  # resamples
_BLOCK = 2_000_000  # numbers at once, 16 MB
_FLAT = 1e-12  # a square that is one of rounding errors, relative


def resamples(size: int) -> int:
    """How many resamples a sample gets: fewer of a large one, whose interval is narrow anyway.

    One more of them is a multiple of 40, so that the 2.5 % quantiles are resamples.
    """
    return int(np.clip(_BLOCK // size, _LEAST + 1, _MOST + 1)) // 40 * 40 - 1


def shares(size: int, count: int | None = None) -> Iterator[np.ndarray]:
    """The same resamples of so many units at every call: blocks of the share of each unit in each, (some, size)."""
    count = resamples(size) if count is None else count
    if count * size <= _BLOCK:
        yield _few_shares(size, count)
        return
    random = np.random.default_rng(0)
    rows = max(1, _BLOCK // size)
    for first in range(0, count, rows):
        yield _draw_shares(random, size, min(rows, count - first))


@functools.lru_cache(maxsize=8)
def _few_shares(size: int, count: int) -> np.ndarray:
    drawn = _draw_shares(np.random.default_rng(0), size, count)
    drawn.flags.writeable = False  # it belongs to the cache
    return drawn


def _draw_shares(random: np.random.Generator, size: int, count: int) -> np.ndarray:
    drawn = random.integers(size, size=(count, size)) + size * np.arange(count)[:, None]
    return np.bincount(drawn.ravel(), minlength=count * size).reshape(count, size) / size


def pivots(mean: np.ndarray, square: np.ndarray, size: int | np.ndarray, scale: np.ndarray) -> np.ndarray:
    """t of resampled errors.

    Args:
        mean: Mean errors of resamples, (columns, resamples).
        square: Their mean squares, likewise.
        size: Units in each.
        scale: Mean squared errors of the samples themselves, (columns, 1).

    Returns:
        t, (columns, resamples); infinite where the errors are all the same, NaN where they are all zero: such a
        resample tells nothing.
    """
    variance = square - mean**2
    flat = variance <= _FLAT * scale
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sqrt(size - 1) * mean / np.sqrt(np.where(flat, 0.0, variance))
    if flat.any():
        t[flat & (np.abs(mean) <= np.sqrt(_FLAT * scale))] = np.nan
    return t


def quantiles(t: np.ndarray, confidence: float = CONFIDENCE) -> tuple[np.ndarray, np.ndarray]:
    """The two between which t lies with a confidence, (columns,) each; those that tell nothing lie beyond both."""
    count = t.shape[-1]
    tail = max(1, round((count + 1) * (1 - confidence) / 2))
    if np.isnan(t).any():
        low = np.partition(np.where(np.isnan(t), -np.inf, t), tail - 1)[..., tail - 1]
        return low, np.partition(np.where(np.isnan(t), np.inf, t), count - tail)[..., count - tail]
    ordered = np.partition(t, (tail - 1, count - tail))
    return ordered[..., tail - 1], ordered[..., count - tail]


def solve(above: np.ndarray, below: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ratios R with low <= t(R) <= high.

    Args:
        above: Samples of the numerator, (columns, n).
        below: Samples of the denominator, likewise.
        low: Lower quantile of t, (columns,).
        high: Upper one, likewise.

    Returns:
        Lower and upper ends, (columns,); infinite where the samples give none. Where the denominator may be zero, so
        that arbitrarily large and negative ratios are possible alike, the lower end is that of ratios from zero on.
    """
    size = above.shape[-1]
    x, y = below.mean(-1), above.mean(-1)
    xx, yy = below.var(-1) / (size - 1), above.var(-1) / (size - 1)  # squared standard errors
    xy = ((above - y[:, None]) * (below - x[:, None])).mean(-1) / (size - 1)

    def roots(t: np.ndarray) -> tuple[np.ndarray, ...]:
        # (y - R x)² = t² (yy - 2 R xy + R² xx), that is a R² - 2 b R + c = 0, in two forms; t > 0 left of y / x
        a, b, c = x**2 - t**2 * xx, x * y - t**2 * xy, y**2 - t**2 * yy
        half = np.sign(t) * np.sqrt(np.maximum(b**2 - a * c, 0.0))
        return a > _FLAT * x**2, c > _FLAT * y**2, (b - half) / a, c / (b + half)

    with np.errstate(divide="ignore", invalid="ignore"):
        below_sure, above_sure, left, left_too = roots(high)
        left = np.where(below_sure, left, np.where(above_sure & (high > 0), left_too, -np.inf))
        below_sure, _, right, _ = roots(low)
        right = np.where(below_sure, right, np.inf)
    return np.where(np.isfinite(high), left, -np.inf), np.where(np.isfinite(low), right, np.inf)
