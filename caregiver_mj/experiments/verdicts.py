"""Verdicts on paired comparisons: from the interval and the p of one estimand.

A verdict needs enough pairs: with five that differ no two-sided p is below 2 / 2⁵ = .0625. Of many comparisons reported
together, the p is that after Holm's correction.
"""

from __future__ import annotations

import enum
import math

import numpy as np

from caregiver_mj.experiments.intervals import CONFIDENCE, Estimate

# Greatest irrelevant difference, as a share of the other caregiver's mean; stated before any comparison.
MARGINS = {
    "toys_reached": 0.03,  # a safe child should still play
    "damage": 0.10,  # the paper's rule varies more from house to house (it leaves .28 to .34 at epsilon 1)
}

_EXACT_PAIRS = 20  # up to this number all 2^20 signs are tried
_MOST, _LEAST = 50_000, 2_000  # draws of signs: fewer for many pairs, whose p is clear anyway
_PER_TEST = 5  # draws for each of several tests at once, over `LEVEL`: then the least p, corrected, is a fifth of it
_SIGNS = 10_000_000  # signs of all pairs together, within these bounds
_BLOCK = 2_000_000  # signs at once
_TIE = 1e-9  # relative; sums that differ by less are equal but for rounding
LEVEL = round(1 - CONFIDENCE, 12)  # significance level of tests


class Verdict(enum.StrEnum):
    """Verdict of a comparison, at the 5 % level."""

    LESS = "less"
    MORE = "more"
    NOT_INFERIOR = "not inferior"
    INFERIOR = "inferior"
    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    NONE = "no verdict"


def verdict(p: float, low: float, high: float) -> Verdict:
    """Return the verdict on a mean difference from its p, NaN for none, and its interval: both must agree."""
    below, above = high < 0, low > 0
    return (Verdict.LESS if below else Verdict.MORE) if p <= LEVEL and (below or above) else Verdict.NONE


def enough(difference: np.ndarray) -> bool:
    """Return whether enough pairs differ for a p of 5 %."""
    return bool(2.0 ** (1 - np.count_nonzero(difference)) <= LEVEL)


def holm(p: np.ndarray) -> np.ndarray:
    """Return the p of tests (n,) after Holm's correction for their number (Scand. J. Statist. 6, 1979).

    The least p is multiplied by n, the next by n - 1 and so on; none is less than the one before it, or more than 1.
    The chance of any false finding among all tests is then 5 %. NaN, a test without power, stays NaN, uncounted.
    """
    p = np.asarray(p, float)
    order = np.argsort(p)[: np.count_nonzero(~np.isnan(p))]  # NaN comes last
    corrected = np.full_like(p, np.nan)
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(p[order] * np.arange(len(order), 0, -1)))
    return corrected


def not_inferior(ours: np.ndarray, theirs: np.ndarray, margin: float, ratio: Estimate[float]) -> Verdict:
    """Test, one-sided at 2.5 %, by the interval of the ratio, whether ours are less by less than a margin.

    Args:
        ours: Sample (n,), not negative; more is better.
        theirs: Paired sample (n,).
        margin: Greatest irrelevant difference, as a share of the larger mean.
        ratio: Ratio of their means with its interval.
    """
    least = 1 - margin
    if not enough(_sides(ours, theirs, least)[0]):
        return Verdict.NONE
    return Verdict.NOT_INFERIOR if ratio.low > least else Verdict.INFERIOR if ratio.high < least else Verdict.NONE


def equivalent(ours: np.ndarray, theirs: np.ndarray, margin: float, ratio: Estimate[float]) -> Verdict:
    """Test, twice one-sided at 2.5 %, by the interval of the ratio, whether neither is less by a margin.

    The arguments are as of `not_inferior`.
    """
    least = 1 - margin
    if not all(map(enough, _sides(ours, theirs, least))):
        return Verdict.NONE
    _, low, high = ratio
    if low > least and high * least < 1:
        return Verdict.EQUIVALENT
    return Verdict.DIFFERENT if high < least or low * least > 1 else Verdict.NONE


def margin_p(ours: np.ndarray, theirs: np.ndarray, margin: float, *, both: bool = False, tests: int = 1) -> float:
    """Return the p of ours being at the margin: two-sided, by sign flips; NaN if no p could be small enough.

    The arguments are as of `not_inferior`. With `both`, as for `equivalent`, it also tests theirs against ours, and
    returns the larger p. `tests` is as of `sign_flip_p`.
    """
    sides = _sides(ours, theirs, 1 - margin)[: 1 + both]
    return float(sign_flip_p(np.stack(sides, axis=1), tests).max()) if all(map(enough, sides)) else np.nan


def _sides(ours: np.ndarray, theirs: np.ndarray, least: float) -> list[np.ndarray]:
    """Return ours less the share `least` of theirs, and the reverse."""
    return [np.asarray(ours, float) - least * theirs, np.asarray(theirs, float) - least * ours]


def sign_flip_p(difference: np.ndarray, tests: int = 1) -> np.ndarray:
    """Return the two-sided p of a mean of zero for each column, (columns,), by flipping the signs of the differences.

    The absolute sum is compared with that under other signs: all of them for at most 20 differences other than zero,
    else random ones with a fixed seed: more if the p is later corrected for a number of `tests`. The differences are of
    pairs in several measures, (n, columns).
    """
    columns = np.asarray(difference, float)
    p = np.ones(columns.shape[1])
    many = np.count_nonzero(columns, axis=0) > _EXACT_PAIRS
    for i in np.flatnonzero(~many):
        p[i] = _p_of_all_signs(columns[columns[:, i] != 0, i])
    if many.any():
        p[many] = _p_of_drawn_signs(columns[:, many], tests)
    return p


def sign_flip_p_more(difference: np.ndarray, tests: int = 1) -> np.ndarray:
    """Return the one-sided p of a mean not above zero for each column, (columns,), by the same flips.

    Sums under flipped signs are symmetric, so it is half the two-sided p. It is 1 where the mean is not above zero.
    """
    columns = np.asarray(difference, float)
    more = columns.sum(axis=0) > _TIE * np.abs(columns).sum(axis=0)
    p = np.ones(columns.shape[1])
    p[more] = sign_flip_p(columns[:, more], tests) / 2
    return p


def least_p_more(difference: np.ndarray, tests: int = 1) -> np.ndarray:
    """Return the least possible `sign_flip_p_more`, given the number of pairs that differ, (columns,)."""
    differing = np.count_nonzero(difference, axis=0)
    drawn = 1 / (2 * _flips(len(difference), tests))
    return np.where(differing > _EXACT_PAIRS, drawn, 0.5 ** np.minimum(differing, _EXACT_PAIRS))


def _flips(pairs: int, tests: int) -> int:
    least = max(_LEAST, math.ceil(_PER_TEST * tests / LEVEL))
    return int(np.clip(_SIGNS // pairs, least, max(_MOST, least)))


def _p_of_all_signs(difference: np.ndarray) -> float:
    if not len(difference):
        return 1.0
    sums = np.zeros(1)
    for one in np.abs(difference[1:]):  # the first sign is fixed, by symmetry
        sums = np.concatenate([sums + one, sums - one])
    return float((np.abs(sums + np.abs(difference[0])) >= _least_sum(difference)).mean())


def _p_of_drawn_signs(columns: np.ndarray, tests: int) -> np.ndarray:
    pairs, sizes, least = len(columns), np.abs(columns), _least_sum(columns)
    flips = _flips(pairs, tests) - 1
    random = np.random.default_rng(0)
    rows = max(1, _BLOCK // pairs)
    hits = np.zeros(columns.shape[1])
    for first in range(0, flips, rows):
        shape = min(rows, flips - first), pairs
        bits = np.frombuffer(random.bytes(-(-shape[0] * pairs // 8)), np.uint8)
        signs = np.unpackbits(bits, count=shape[0] * pairs).reshape(shape).astype(float)
        hits += (np.abs(2 * (signs @ sizes) - sizes.sum(axis=0)) >= least).sum(axis=0)
    return (1 + hits) / (1 + flips)


def _least_sum(difference: np.ndarray) -> np.ndarray:
    """Return the threshold for sums that are as far from zero as the observed one, but for rounding."""
    return np.abs(difference.sum(axis=0)) - _TIE * np.abs(difference).sum(axis=0)
