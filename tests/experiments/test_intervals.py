"""Intervals: values worked by hand, every resample of a small sample, and samples that tell little."""

import numpy as np
import pytest
from scipy import stats

from caregiver_mj.experiments.intervals import of_mean, of_ratio, quantiles, resamples, shares, solve

INF = np.inf


@pytest.mark.parametrize(
    ("t", "ends"),
    [
        (1, (2 / 3, 2)),  # y is 2 and surely so, x is 2 ± 1: |2 - 2 R| <= t R
        (2, (1 / 2, INF)),  # x may be 0 just so
        (3, (2 / 5, INF)),  # or negative
        (INF, (-INF, INF)),
    ],
)
def test_ratios_by_hand(t, ends):
    low, high = solve(np.array([[2.0, 2.0]]), np.array([[1.0, 3.0]]), np.array([-t]), np.array([t]))
    assert (low[0], high[0]) == pytest.approx(ends)


def test_a_numerator_that_may_be_zero_has_no_lower_end():
    low, high = solve(np.array([[1.0, 3.0]]), np.array([[2.0, 2.0]]), np.array([-3.0]), np.array([3.0]))
    assert low[0] == pytest.approx(1 - 3 / 2)  # y = 2 ± 1, x = 2
    assert high[0] == pytest.approx(1 + 3 / 2)


def test_quantiles_by_hand():
    t = np.arange(1.0, 40)[None]  # 39 of them: a 40th part lies below the first and above the last
    assert [float(end[0]) for end in quantiles(t)] == [1, 39]
    t[0, 20] = np.nan  # tells nothing, and so for all that is known is less than all, and more
    assert [float(end[0]) for end in quantiles(t)] == [-INF, INF]


@pytest.mark.parametrize("size", [1, 20, 2000, 50_000])
def test_resamples_and_large_ones_in_parts(size):
    assert 999 <= resamples(size) <= 9999
    assert (resamples(size) + 1) % 40 == 0
    first = next(shares(size, 40))
    assert first.shape == (40, size)
    assert np.abs(first.sum(axis=1) - 1).max() < 1e-9
    assert np.array_equal(first, next(shares(size, 40)))
    parts = [len(part) for part in shares(4000)]
    assert len(parts) > 1
    assert sum(parts) == resamples(4000)


def all_pivots(errors):
    """t of each of the n^n resamples of errors, written out."""
    n = len(errors)
    drawn = np.stack(np.meshgrid(*[errors] * n), axis=-1).reshape(-1, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sort(np.sqrt(n) * drawn.mean(axis=1) / drawn.std(axis=1, ddof=1))


def test_mean_against_all_resamples():
    data = np.array([0.0, 1.0, 2.0, 4.0, 5.0, 11.0])
    t = all_pivots(data - data.mean())
    assert np.isfinite(t[2000:-2000]).all()  # of 46656; six are all the same
    error = data.std(ddof=1) / np.sqrt(6)
    value, low, high = of_mean(data)
    assert value == pytest.approx(23 / 6)
    assert low == pytest.approx(value - error * np.quantile(t, 0.975), abs=0.05 * error)
    assert high == pytest.approx(value - error * np.quantile(t, 0.025), abs=0.3 * error)  # a long tail


def test_ratio_against_all_resamples():
    theirs, ours = np.array([4.0, 6.0, 5.0, 9.0, 7.0, 5.0]), np.array([2.0, 2.0, 2.0, 3.0, 1.0, 0.0])
    value, low, high = of_ratio(ours, theirs)
    assert value == pytest.approx(10 / 36)
    t = all_pivots(ours - value * theirs)
    ratios = np.linspace(0, 1, 20_001)[:, None]
    errors = ours - ratios * theirs
    at = np.sqrt(6) * errors.mean(axis=1) / errors.std(axis=1, ddof=1)
    inside = ratios[(at >= np.quantile(t, 0.025)) & (at <= np.quantile(t, 0.975))]
    assert (low, high) == pytest.approx((inside.min(), inside.max()), rel=0.05)


def test_other_units():
    random = np.random.default_rng(1)
    theirs = random.poisson(6.0, 20).astype(float)
    ours = random.binomial(theirs.astype(int), 0.3).astype(float) + random.poisson(0.5, 20)
    assert of_ratio(8 * ours, theirs) == pytest.approx([8 * end for end in of_ratio(ours, theirs)])
    assert of_ratio(ours, 8 * theirs) == pytest.approx([end / 8 for end in of_ratio(ours, theirs)])
    assert of_mean(3 * ours + 7) == pytest.approx([3 * end + 7 for end in of_mean(ours)])


ONE = np.eye(20)[0]


@pytest.mark.parametrize(
    ("ours", "theirs", "wanted"),
    [
        (np.zeros(20), np.zeros(20), (np.nan, np.nan, np.nan)),
        (np.arange(20.0), np.zeros(20), (np.nan, np.nan, np.nan)),
        (np.zeros(20), np.arange(20.0), (0, 0, INF)),  # never hurt so far
        (0.9 * np.arange(20.0), np.arange(20.0), (0.9, 0.9, 0.9)),
        (ONE, ONE, (1, 0, INF)),  # but a single pair that tells anything
        (np.array([3.0]), np.array([4.0]), (0.75, 0, INF)),
        (np.array([3.0, 4.0]), np.array([4.0, 5.0]), (7 / 9, 0, INF)),
    ],
)
def test_ratios_that_say_little(ours, theirs, wanted):
    assert of_ratio(ours, theirs) == pytest.approx(wanted, nan_ok=True)


@pytest.mark.parametrize(
    ("data", "wanted"),
    [([5.0], (5, -INF, INF)), ([10.0, 20.0], (15, -INF, INF)), ([5.0, 5.0], (5, 5, 5)), ([0.0] * 20, (0, 0, 0))],
)
def test_means_that_say_little(data, wanted):
    assert of_mean(np.array(data)) == wanted


def test_one_accident_in_twenty_episodes_bounds_nothing_from_above():
    value, low, high = of_mean(4 * ONE, least=0)
    assert (value, low, high) == (0.2, 0, INF)
    assert of_mean(4 * ONE).low < 0


def test_a_ratio_is_of_what_cannot_be_negative():
    with pytest.raises(ValueError, match="must be at least 0"):
        of_ratio(np.array([1.0, -1.0]), np.array([1.0, 1.0]))


def test_coverage_of_a_skewed_mean():
    data = np.random.default_rng(5).exponential(1.0, size=(20, 1000))
    _, low, high = of_mean(data)
    assert 0.93 < np.mean((low <= 1) & (high >= 1)) < 0.97
    t = stats.t.ppf(0.975, 19) * data.std(axis=0, ddof=1) / np.sqrt(20)
    assert np.mean(np.abs(data.mean(axis=0) - 1) <= t) < 0.93  # Student's does not
