"""Confidence intervals of a mean, of a difference of means and of a ratio of means, for 20 to 2000 episodes.

All are studentised bootstrap intervals; docs/coverage.md shows how often they cover the truth.
Samples are paired: unit i of one belongs to unit i of the other. A unit is an episode; for houses see `two_level`.
The resamples have a fixed seed, so equal samples have equal intervals.

The interval of a ratio of means follows Fieller's theorem. If R is the true ratio of samples y over x, the errors
e = y - R x have mean zero, so

    t(R) = sqrt(n) mean(e) / sd(e)

is a pivot: its distribution hardly depends on unknown parameters, and it divides by no mean that may be close to zero.
Resampling units with replacement estimates the distribution of t; the interval is all R with t(R) between two of its
quantiles (Hwang, Biometrika 82, 1995). Swapping y and x gives the reciprocal interval. With x = 1 it is the bootstrap-t
interval of a mean (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, section 12.5).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

TELLING = 4  # units other than zero; with fewer, more than 2.5 % of resamples (e^-3) miss them all, and bound nothing
EXACT = 1e-24  # relative square of a rounding error
TOO_FEW = "too few episodes for an interval"  # shown for a sample that bounds nothing
_BLOCK = 2_000_000  # numbers at once, 16 MB
Value = TypeVar("Value")  # a number for one sample, an array (columns,) for several
CONFIDENCE = 0.95
_MOST, _LEAST = 9_999, 999  # resamples
_FLAT = 1e-12  # relative; a smaller square consists of rounding errors


class Estimate(NamedTuple, Generic[Value]):
    """An estimate and the ends of its interval; numbers for one sample, arrays (columns,) for several."""

    value: Value  #: the estimate, NaN where there is none
    low: Value  #: lower end, -inf (of a ratio: 0) where the sample bounds nothing; NaN where there is no estimate
    high: Value  #: upper end, inf where the sample bounds nothing

    def column(self, i: int) -> Estimate[float]:
        """Return the estimate of one of several."""
        return Estimate(*(float(np.asarray(part)[i]) for part in self))


def of_mean(data: np.ndarray, least: float = -np.inf) -> Estimate[Any]:
    """Return the mean of a sample (n,), or of several, (n, columns), with its interval.

    The interval of equal units has no width. No unit, and so no mean, can be below `least`.
    """
    columns = _columns(data)
    low, high = _bounds(columns, np.ones_like(columns))
    return _shaped(columns.mean(axis=1), np.maximum(low, least), high, np.ndim(data))


def of_difference(ours: np.ndarray, theirs: np.ndarray) -> Estimate[Any]:
    """Return the mean of ours less theirs, over paired samples (n,) or (n, columns)."""
    return of_mean(np.asarray(ours, float) - theirs)


def of_ratio(ours: np.ndarray, theirs: np.ndarray, least: float = 0.0) -> Estimate[Any]:
    """Return the mean of ours over that of theirs, such as damage left, over paired samples (n,) or (n, columns).

    Without a mean of theirs above zero there is no ratio. If ours are all zero, the ratio is 0 and has no upper bound.
    If all pairs have the same ratio, and at least four have one, the interval has no width.

    Args:
        ours: The numerators.
        theirs: The denominators.
        least: Lower bound of all numbers, and so of the ratio: 0, or -inf.

    Raises:
        ValueError: A number is less.
    """
    above, below = _columns(ours), _columns(theirs)
    if (smallest := min(above.min(initial=least), below.min(initial=least))) < least:
        raise ValueError(f"quantities of a ratio of means must be at least {least:g}, got {smallest}")
    x, y = below.mean(axis=1), above.mean(axis=1)
    value = np.divide(y, x, out=np.full_like(x, np.nan), where=x > 0)
    low, high = _bounds(above, below)
    telling = ((above != 0) | (below != 0)).sum(axis=1)
    nothing = (low == high) & ((y == 0) | (telling < TELLING))
    low, high = np.where(nothing, -np.inf, low), np.where(nothing, np.inf, high)
    none = np.isnan(value)
    low, high = np.where(none, np.nan, np.maximum(low, least)), np.where(none, np.nan, high)
    return _shaped(value, low, high, np.ndim(ours))


def signed(number: float) -> str:
    """Return a difference as text, two digits behind the point and no minus before a zero."""
    return f"{round(number, 2) + 0.0:+.2f}"


def in_words(low: float | None, high: float | None, form: Callable[[float], str] = signed) -> str:
    """Return an interval as text; an end is None where the episodes do not bound it."""
    if bounds_nothing(low, high):
        return TOO_FEW
    return " to ".join("no bound" if end is None else form(end) for end in (low, high))


def bounds_nothing(low: float | None, high: float | None) -> bool:
    """Return whether an interval has no end but the lower bound of ratios, zero."""
    return high is None and not low


def _bounds(above: np.ndarray, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the intervals of ratios of means; samples are (columns, n)."""
    size = above.shape[1]
    x, y = below.mean(axis=1), above.mean(axis=1)
    if size < 2:
        unknown = np.full_like(x, np.inf)
        return -unknown, unknown
    ratio = np.divide(y, x, out=np.zeros_like(x), where=x > 0)
    errors = above - ratio[:, None] * below
    scale = (errors**2).mean(axis=1)
    same = scale <= EXACT * (above**2).mean(axis=1)
    low, high = np.empty((2, *x.shape))
    width = max(1, _BLOCK // resamples(size))  # columns at once
    for first in range(0, len(x), width):
        some = slice(first, first + width)
        e = errors[some]
        t = [pivots(e @ part.T, e**2 @ part.T, size, scale[some, None]) for part in shares(size)]
        limits = quantiles(np.concatenate(t, axis=1))
        low[some], high[some] = solve(above[some], below[some], *limits)
    return np.where(same, ratio, low), np.where(same, ratio, high)


def _columns(data: np.ndarray) -> np.ndarray:
    """Return samples as (columns, n)."""
    data = np.asarray(data, float)
    return data[None] if data.ndim == 1 else np.ascontiguousarray(data.T)


def _shaped(value: np.ndarray, low: np.ndarray, high: np.ndarray, dimensions: int) -> Estimate[Any]:
    """Return an estimate, of numbers for a single sample."""
    if dimensions > 1:
        return Estimate(value, low, high)
    return Estimate(float(value[0]), float(low[0]), float(high[0]))


def resamples(size: int) -> int:
    """Return the number of resamples of a sample: fewer for a large one, whose interval is narrow anyway.

    It is one less than a multiple of 40, so that the 2.5 % quantiles are resamples.
    """
    return int(np.clip(_BLOCK // size, _LEAST + 1, _MOST + 1)) // 40 * 40 - 1


def shares(size: int, count: int | None = None) -> Iterator[np.ndarray]:
    """Yield the resamples of `size` units, the same at every call: blocks of each unit's share, (some, size)."""
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
    """Return t of resampled errors, (columns, resamples), by their means and mean squares, of the same shape.

    There are `size` units in each; `scale`, (columns, 1), are the mean squared errors of the samples themselves. It is
    infinite for equal errors, and NaN for zero errors: such a resample bounds nothing.
    """
    variance = square - mean**2
    flat = variance <= _FLAT * scale
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sqrt(size - 1) * mean / np.sqrt(np.where(flat, 0.0, variance))
    if flat.any():
        t[flat & (np.abs(mean) <= np.sqrt(_FLAT * scale))] = np.nan
    return t


def quantiles(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends between which t lies with `CONFIDENCE`, (columns,) each; NaN counts as beyond both."""
    count = t.shape[-1]
    tail = max(1, round((count + 1) * (1 - CONFIDENCE) / 2))
    if np.isnan(t).any():
        low = np.partition(np.where(np.isnan(t), -np.inf, t), tail - 1)[..., tail - 1]
        return low, np.partition(np.where(np.isnan(t), np.inf, t), count - tail)[..., count - tail]
    ordered = np.partition(t, (tail - 1, count - tail))
    return ordered[..., tail - 1], ordered[..., count - tail]


def solve(above: np.ndarray, below: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the ratios R with low <= t(R) <= high, by two quantiles of t, (columns,) all.

    The samples of numerator and denominator are (columns, n). Ends are infinite where the quantiles give none. If the
    denominator may be zero, large and negative ratios are possible. The lower end then bounds the ratios from zero on,
    unless the sample's ratio is negative.
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
        left = np.where(below_sure, left, np.where(above_sure & (high > 0) & (y > 0), left_too, -np.inf))
        below_sure, _, right, _ = roots(low)
        right = np.where(below_sure, right, np.inf)
    return np.where(np.isfinite(high), left, -np.inf), np.where(np.isfinite(low), right, np.inf)
