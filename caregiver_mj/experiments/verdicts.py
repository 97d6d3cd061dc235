"""What a paired comparison says: one estimand, its interval, a p of the same estimand, and a verdict of both.

A verdict is only given where the number of pairs permits one: with five pairs that differ no two-sided p is below
2 / 2⁵ = .0625. Where many comparisons are told together, it is one of the p after Holm's correction.
"""

from __future__ import annotations

import enum

import numpy as np

from caregiver_mj.experiments.intervals import CONFIDENCE, Estimate, of_ratio

# What is little enough not to matter, as a share of the other caregiver's mean; stated before any comparison.
MARGINS = {
    "toys_reached": 0.03,  # a child kept safe shall still play
    "damage": 0.10,  # less than the paper's rule differs from house to house (it leaves .28 to .34 at epsilon 1)
}

_EXACT_PAIRS = 20  # with so many all 2^20 signs are tried
_MOST, _LEAST = 50_000, 2_000  # drawn signs of each pair: fewer of many pairs, whose p is clear anyway
_SIGNS = 10_000_000  # of all pairs together, between these
_BLOCK = 2_000_000  # signs at once
_TIE = 1e-9  # relative, for sums that differ by rounding alone
LEVEL = round(1 - CONFIDENCE, 12)  # of tests


class Verdict(enum.StrEnum):
    """What a comparison shows, at 5 %."""

    LESS = "less"
    MORE = "more"
    NOT_INFERIOR = "not inferior"
    INFERIOR = "inferior"
    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    NONE = "no verdict"


def verdict(p: float, low: float, high: float) -> Verdict:
    """Return the verdict on a mean difference with a p, NaN for none, and an interval: it needs both."""
    below, above = high < 0, low > 0
    return (Verdict.LESS if below else Verdict.MORE) if p <= LEVEL and (below or above) else Verdict.NONE


def enough(difference: np.ndarray) -> bool:
    """Return whether there are pairs enough, of those that differ, for a p of 5 %."""
    return bool(2.0 ** (1 - np.count_nonzero(difference)) <= LEVEL)


def holm(p: np.ndarray) -> np.ndarray:
    """Return the p of tests (n,) told together, after Holm's correction for their number (Scand. J. Statist. 6, 1979).

    The least is multiplied by n, the next by n - 1 and so on; none is less than one before it, or more than 1. With
    them, the chance to find anything where there is nothing is 5 % for all tests together. NaN, a test that could not
    show anything, stays NaN and does not count.
    """
    p = np.asarray(p, float)
    order = np.argsort(p)[: np.count_nonzero(~np.isnan(p))]  # NaN comes last
    corrected = np.full_like(p, np.nan)
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(p[order] * np.arange(len(order), 0, -1)))
    return corrected


def not_inferior(ours: np.ndarray, theirs: np.ndarray, margin: float, ratio: Estimate[float] | None = None) -> Verdict:
    """Test, one-sided at 2.5 %, by the interval of the ratio, whether ours are less by less than a margin.

    They are paired samples (n,), not negative, of which more is better; the margin is that share of the larger of the
    two means that does not matter. The ratio of means is given where it is known already with its interval, such as one
    over houses.
    """
    least = 1 - margin
    if not enough(_sides(ours, theirs, least)[0]):
        return Verdict.NONE
    _, low, high = ratio or of_ratio(ours, theirs)
    return Verdict.NOT_INFERIOR if low > least else Verdict.INFERIOR if high < least else Verdict.NONE


def equivalent(ours: np.ndarray, theirs: np.ndarray, margin: float, ratio: Estimate[float] | None = None) -> Verdict:
    """Test, twice one-sided at 2.5 %, by the interval of the ratio, whether neither is less by a margin.

    The arguments are as of `not_inferior`.
    """
    least = 1 - margin
    if not all(map(enough, _sides(ours, theirs, least))):
        return Verdict.NONE
    _, low, high = ratio or of_ratio(ours, theirs)
    if low > least and high * least < 1:
        return Verdict.EQUIVALENT
    return Verdict.DIFFERENT if high < least or low * least > 1 else Verdict.NONE


def margin_p(ours: np.ndarray, theirs: np.ndarray, margin: float, *, both: bool = False) -> float:
    """Return the p of ours being at the margin: two-sided, by sign flips; NaN where no p could be small enough.

    The arguments are as of `not_inferior`. With `both`, theirs are to be told from that share of ours, too, as for
    `equivalent`; the p is the larger one.
    """
    sides = _sides(ours, theirs, 1 - margin)[: 1 + both]
    return max(float(sign_flip_p(side)) for side in sides) if all(map(enough, sides)) else np.nan


def _sides(ours: np.ndarray, theirs: np.ndarray, least: float) -> list[np.ndarray]:
    """Ours less that share of theirs, and the other way round."""
    return [np.asarray(ours, float) - least * theirs, np.asarray(theirs, float) - least * ours]


def sign_flip_p(difference: np.ndarray) -> np.ndarray | float:
    """Return the two-sided p of a mean of zero, if each of the differences could as well have the other sign.

    The square of their sum is compared with that under other signs: all of them for 20 differences that are not zero
    or fewer, else many drawn ones, which are the same every time. Student's t would order the signs alike. They are of
    pairs, (n,), or of several kinds for the same pairs, (n, columns).
    """
    columns = np.asarray(difference, float)
    return float(_p_of_columns(columns[:, None])[0]) if columns.ndim == 1 else _p_of_columns(columns)


def sign_flip_p_more(difference: np.ndarray) -> np.ndarray:
    """Return the one-sided p of a mean not above zero, by the same flips; of several kinds (n, columns), (columns,).

    Sums under flipped signs are as often above zero as below, so it is half of the two-sided p. It is 1 where the mean
    is not above zero.
    """
    columns = np.asarray(difference, float)
    more = columns.sum(axis=0) > _TIE * np.abs(columns).sum(axis=0)
    p = np.ones(columns.shape[1])
    p[more] = _p_of_columns(columns[:, more]) / 2
    return p


def least_p_more(difference: np.ndarray) -> np.ndarray:
    """Return the least that `sign_flip_p_more` can be with so many pairs that differ, (columns,)."""
    differing = np.count_nonzero(difference, axis=0)
    drawn = 1 / (2 * _flips(len(difference)))
    return np.where(differing > _EXACT_PAIRS, drawn, 0.5 ** np.minimum(differing, _EXACT_PAIRS))


def _flips(pairs: int) -> int:
    return int(np.clip(_SIGNS // pairs, _LEAST, _MOST))


def _p_of_columns(columns: np.ndarray) -> np.ndarray:
    """The same of several kinds of differences, (n, columns)."""
    p = np.ones(columns.shape[1])
    many = np.count_nonzero(columns, axis=0) > _EXACT_PAIRS
    for i in np.flatnonzero(~many):
        p[i] = _p_of_all_signs(columns[columns[:, i] != 0, i])
    if many.any():
        p[many] = _p_of_drawn_signs(columns[:, many])
    return p


def _p_of_all_signs(difference: np.ndarray) -> float:
    if not len(difference):
        return 1.0
    sums = np.zeros(1)
    for one in np.abs(difference[1:]):  # the first sign stays; its mirror image is as far from zero
        sums = np.concatenate([sums + one, sums - one])
    return float((np.abs(sums + np.abs(difference[0])) >= _least_sum(difference)).mean())


def _p_of_drawn_signs(columns: np.ndarray) -> np.ndarray:
    pairs, sizes, least = len(columns), np.abs(columns), _least_sum(columns)
    flips = _flips(pairs) - 1
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
    """What sums must reach to be as far from zero as the one that came out, but for rounding."""
    return np.abs(difference.sum(axis=0)) - _TIE * np.abs(difference).sum(axis=0)
