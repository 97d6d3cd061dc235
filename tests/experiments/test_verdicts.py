"""Verdicts: p-values counted by hand, and no verdict where there are too few pairs for one."""

import collections

import numpy as np
import pytest
from scipy import stats

from caregiver_mj.experiments.intervals import of_difference, of_ratio
from caregiver_mj.experiments.verdicts import (
    MARGINS,
    Verdict,
    enough,
    equivalent,
    margin_p,
    not_inferior,
    sign_flip_p,
    verdict,
)


@pytest.mark.parametrize(
    ("difference", "p"),
    [
        ([1, 2, 3], 2 / 8),
        ([3, -1, 2], 4 / 8),  # sums of 6 and 4, either way
        ([3, -1, 2, 0, 0], 4 / 8),
        ([1, 2, 3, 4], 0.125),
        ([5], 1),
        ([0, 0], 1),
        ([1, -1], 1),
        ([0.1] * 10, 2 / 2**10),
        ([1] * 8 + [-1] * 2, stats.binomtest(8, 10).pvalue),
    ],
)
def test_sign_flips_by_hand(difference, p):
    assert sign_flip_p(np.outer(difference, [1, -7.3])) == pytest.approx([p, p])


def test_many_signs_are_drawn():
    difference = np.array([1.0] * 21 + [-1.0] * 9)
    one, turned = sign_flip_p(np.stack([difference, difference[::-1]], axis=1))
    assert one == turned == pytest.approx(stats.binomtest(21, 30).pvalue, rel=0.05)
    alike = np.ones((300, 1))
    assert sign_flip_p(alike) == pytest.approx(300 / 10_000_000, rel=1e-3)  # the least there can be
    assert sign_flip_p(alike, tests=1_000) == pytest.approx(1 / 100_000)  # less, to be corrected for many


Compared = collections.namedtuple("Compared", ("estimate", "p", "verdict"))


def compare_means(ours, theirs):
    estimate, difference = of_difference(ours, theirs), ours - theirs
    p = sign_flip_p(difference[:, None]).item() if enough(difference) else np.nan
    return Compared(estimate, p, verdict(p, estimate.low, estimate.high))


@pytest.mark.parametrize(("pairs", "verdict"), [(4, Verdict.NONE), (5, Verdict.NONE), (6, Verdict.LESS)])
def test_no_verdict_of_few_pairs(pairs, verdict):
    theirs = np.array([10.0, 12.0, 11.0, 13.0, 10.0, 12.0])[:pairs]
    found = compare_means(theirs - 8, theirs)
    assert found.estimate.value == pytest.approx(-8)
    assert found.verdict is verdict
    assert np.isnan(found.p) == (verdict is Verdict.NONE)
    assert enough(np.ones(pairs)) == (verdict is not Verdict.NONE)


def test_verdict_and_interval_do_not_contradict_each_other():
    random = np.random.default_rng(7)
    for shift in np.linspace(0, 1, 40):
        ours, theirs = random.exponential(1.0, (2, 20))
        ours = ours + shift
        estimate, p, verdict = compare_means(ours, theirs)
        assert estimate == of_difference(ours, theirs)
        shown = p <= 0.05 and (estimate.low > 0 or estimate.high < 0)
        assert (verdict is not Verdict.NONE) == shown
        other = compare_means(theirs, ours)
        assert other.p == p
        assert (other.verdict is Verdict.LESS) == (verdict is Verdict.MORE)


TOYS = np.array([20.0, 24, 22, 25, 19, 23, 21, 24, 20, 22])


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [
        (TOYS, Verdict.NOT_INFERIOR),
        (TOYS + 1, Verdict.NOT_INFERIOR),
        (0.98 * TOYS, Verdict.NOT_INFERIOR),
        (0.96 * TOYS, Verdict.INFERIOR),
        (TOYS - 3 * np.arange(10) % 7, Verdict.INFERIOR),
        (TOYS + np.array([3, -3, 2, -2, 1, -1, 2, -2, 3, -3]), Verdict.NONE),
    ],
)
def test_toys_kept(ours, verdict):
    assert not_inferior(ours, TOYS, MARGINS["toys_reached"], of_ratio(ours, TOYS)) is verdict


def test_a_margin_needs_pairs_too():
    for toys, wanted in ((TOYS[:5], "no verdict"), (TOYS[:6], "not inferior"), (np.zeros(20), "no verdict")):
        assert not_inferior(toys, toys, 0.03, of_ratio(toys, toys)) == wanted
    assert equivalent(TOYS[:5], TOYS[:5], 0.1, of_ratio(TOYS[:5], TOYS[:5])) is Verdict.NONE
    assert not enough(np.array([1, 1, 1, 0, 0, 0, 0]))  # pairs that do not differ do not count


@pytest.mark.parametrize(
    ("factor", "verdict"), [(1, Verdict.EQUIVALENT), (0.92, Verdict.EQUIVALENT), (0.88, Verdict.DIFFERENT)]
)
def test_equivalence_from_either_side(factor, verdict):
    for ours, theirs in ((factor * TOYS, TOYS), (TOYS, factor * TOYS)):
        assert equivalent(ours, theirs, 0.10, of_ratio(ours, theirs)) is verdict


def test_p_of_being_at_the_margin_by_hand():
    # 20 less 0.9 x 20 is 2 in each of ten pairs: 2 of 1024 signs are as far from zero.
    theirs = np.full(10, 20.0)
    assert margin_p(theirs, theirs, 0.1) == margin_p(theirs, theirs, 0.1, both=True) == 2 / 2**10
    assert margin_p(0.5 * theirs, theirs, 0.1, both=True) == 2 / 2**10  # 10 less 18, and 20 less 9
    assert np.isnan(margin_p(0.9 * theirs, theirs, 0.1, both=True))
    assert np.isnan(margin_p(theirs[:5], theirs[:5], 0.1))
    many = np.full(5_000, 20.0)
    assert 200 * margin_p(many, many, 0.1, tests=200) <= 0.05  # to be corrected for as many
