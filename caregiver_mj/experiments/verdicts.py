"""What a paired comparison says: one estimand, its interval, a p of the same estimand, and a verdict of both.

A verdict is only given where the number of pairs permits one: with five pairs that differ no two-sided p is below
2 / 2⁵ = .0625.
"""

from __future__ import annotations

import enum
from typing import NamedTuple

import numpy as np

from caregiver_mj.experiments.intervals import Estimate, of_difference, of_ratio
from caregiver_mj.experiments.studentised import CONFIDENCE

# What is little enough not to matter, as a share of the other caregiver's mean; stated before any comparison.
MARGINS = {
    "toys_reached": 0.03,  # a child kept safe shall still play
    "damage": 0.10,  # less than the paper's rule differs from house to house (it leaves .28 to .34 at epsilon 1)
}

_EXACT_PAIRS = 20  # with so many all 2^20 signs are tried
_FLIPS = 99_999
_BLOCK = 2_000_000  # signs at once
_TIE = 1e-9  # relative, for sums that differ by rounding alone


class Verdict(enum.StrEnum):
    """What a comparison shows, at 5 %."""

    LESS = "less"
    MORE = "more"
    NOT_INFERIOR = "not inferior"
    INFERIOR = "inferior"
    EQUIVALENT = "equivalent"
    DIFFERENT = "different"
    NONE = "no verdict"


class Comparison(NamedTuple):
    """Ours against theirs.

    Attributes:
        estimate: The mean difference, ours less theirs, with its interval.
        p: Two-sided p of a mean difference of zero; NaN where no p could be small enough.
        verdict: LESS or MORE where the p is small enough and the interval leaves zero out, else NONE.
    """

    estimate: Estimate
    p: float
    verdict: Verdict


def compare_means(ours: np.ndarray, theirs: np.ndarray) -> Comparison:
    """Whether ours are less or more than theirs on average, over paired samples (n,)."""
    difference = np.asarray(ours, float) - theirs
    return judge(of_difference(ours, theirs), difference)


def judge(estimate: Estimate, difference: np.ndarray) -> Comparison:
    """The same where the interval of the mean of differences (n,) is known already, such as one over houses."""
    if not enough(difference):
        return Comparison(estimate, np.nan, Verdict.NONE)
    p = sign_flip_p(difference)
    verdict = Verdict.NONE
    if p <= 1 - CONFIDENCE:
        verdict = Verdict.LESS if estimate.high < 0 else Verdict.MORE if estimate.low > 0 else Verdict.NONE
    return Comparison(estimate, p, verdict)


def enough(difference: np.ndarray) -> bool:
    """Whether there are pairs enough, of those that differ, for a p of 5 %."""
    return 2.0 ** (1 - np.count_nonzero(difference)) <= 1 - CONFIDENCE


def not_inferior(
    ours: np.ndarray, theirs: np.ndarray, margin: float, *, more_is_better: bool, ratio: Estimate | None = None
) -> Verdict:
    """Whether ours are worse than theirs by less than a margin: a one-sided test at 2.5 % by the interval of the ratio.

    Args:
        ours: A sample (n,) that is not negative.
        theirs: One paired with it.
        margin: Share of the larger of the two means that does not matter.
        more_is_better: As of toys; not as of damage.
        ratio: The ratio of means with its interval, where it is known already, such as one over houses.
    """
    least = 1 - margin
    if not (_decides(ours, theirs, least) if more_is_better else _decides(theirs, ours, least)):
        return Verdict.NONE
    _, low, high = ratio or of_ratio(ours, theirs)
    fine, bad = (low > least, high < least) if more_is_better else (high * least < 1, low * least > 1)
    return Verdict.NOT_INFERIOR if fine else Verdict.INFERIOR if bad else Verdict.NONE


def equivalent(ours: np.ndarray, theirs: np.ndarray, margin: float, ratio: Estimate | None = None) -> Verdict:
    """Whether neither is less than the other by a margin: two one-sided tests at 2.5 % by the interval of the ratio.

    Args:
        ours: A sample (n,) that is not negative.
        theirs: One paired with it.
        margin: Share of the larger of the two means that does not matter.
        ratio: The ratio of means with its interval, where it is known already, such as one over houses.
    """
    least = 1 - margin
    if not (_decides(ours, theirs, least) and _decides(theirs, ours, least)):
        return Verdict.NONE
    _, low, high = ratio or of_ratio(ours, theirs)
    if low > least and high * least < 1:
        return Verdict.EQUIVALENT
    return Verdict.DIFFERENT if high < least or low * least > 1 else Verdict.NONE


def _decides(ours: np.ndarray, theirs: np.ndarray, least: float) -> bool:
    """Whether there are pairs enough to tell ours from that share of theirs."""
    return enough(np.asarray(ours, float) - least * np.asarray(theirs, float))


def sign_flip_p(difference: np.ndarray) -> float:
    """Two-sided p of a mean of zero, if each of the differences (n,) could as well have the other sign.

    The square of their sum is compared with that under other signs, all of them for 20 differences that are not zero
    or fewer, else so many drawn ones, which are the same every time. Student's t would order the signs alike.
    """
    size = np.abs(np.asarray(difference, float))
    size = size[size > 0]
    if not len(size):
        return 1.0
    observed = np.abs(np.sum(difference)) - _TIE * size.sum()
    if len(size) <= _EXACT_PAIRS:
        sums = np.zeros(1)
        for one in size[1:]:  # the first sign is +; its mirror image is as far from zero
            sums = np.concatenate([sums + one, sums - one])
        return float((np.abs(sums + size[0]) >= observed).mean())
    random = np.random.default_rng(0)
    rows = max(1, _BLOCK // len(size))
    hits = 0
    for first in range(0, _FLIPS, rows):
        signs = random.integers(2, size=(min(rows, _FLIPS - first), len(size)), dtype=np.int8)
        hits += np.count_nonzero(np.abs(2.0 * (signs @ size) - size.sum()) >= observed)
    return (1 + hits) / (1 + _FLIPS)
