"""The study of coverage: its parts by hand and against SciPy, and a small run of all of it."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from caregiver_mj.plans.floor_plan import FloorPlan
from studies.coverage import METHODS, Coverage, Pool, cover_houses, cover_ratio, draw, fieller, misses, page, run_pool

SMALL = Coverage(
    houses=("paper", "apartment"), samples=20, episodes=40, sizes=(5, 20), epsilons=(1.0, 0.05),
    house_samples=2, house_set="train-2", in_house=5, house_epsilons=(1.0, 0.05),
)  # fmt: skip


def test_misses_by_hand():
    low, high = np.array([0.1, 0.2, 0.4, 0.3, 0.1]), np.array([0.2, 0.5, 0.6, 0.9, np.inf])
    assert misses(low, high, 0.3) == pytest.approx({"covered": 0.6, "too_low": 0.2, "too_high": 0.2, "open": 0.2})


@pytest.mark.parametrize(("name", "method"), [("percentile", "percentile"), ("BCa", "BCa")])
def test_rivals_agree_with_scipy(name, method):
    random = np.random.default_rng(0)
    theirs = random.negative_binomial(2, 0.2, 20).astype(float)
    ours = random.binomial(theirs.astype(int), 0.4).astype(float)
    wanted = stats.bootstrap(
        (ours, theirs), lambda y, x, axis: y.mean(axis) / x.mean(axis), paired=True, method=method,
        n_resamples=99_999, rng=random,
    ).confidence_interval  # fmt: skip
    found = [METHODS[name](ours[None], theirs[None], random) for _ in range(40)]
    assert np.mean(found, axis=0).ravel() == pytest.approx([wanted.low, wanted.high], rel=0.01)


def test_fieller_by_hand():
    ours, theirs = np.array([[2.0, 2.0, 2.0]]), np.array([[5.0, 8.0, 11.0]])
    low, high = fieller(ours, theirs, np.random.default_rng(0))
    reach = stats.t.ppf(0.975, 2) * np.sqrt(3)  # x is 8 ± √3, so that R lies in 2 / (8 ± t √3)
    assert (low[0], high[0]) == pytest.approx((2 / (8 + reach), 2 / (8 - reach)))


def test_pool_pairs_episodes():
    plan = FloorPlan.load("paper")
    pool = run_pool(plan, 0.5, 30, seed=4)
    assert np.array_equal(pool.theirs[3:], run_pool(plan, 0.5, 27, seed=7).theirs)
    assert pool.ratio == pytest.approx(pool.ours.sum() / pool.theirs.sum())
    ours, theirs = pool.draw(np.random.default_rng(0), (500,))
    assert set(zip(ours, theirs, strict=True)) <= set(zip(pool.ours, pool.theirs, strict=True))


def test_samples_always_have_a_ratio():
    pool = Pool("h", 0.05, ours=np.array([0.0, 0, 0, 1]), theirs=np.array([0.0, 0, 0, 2]))
    assert pool.harmless == 0.75
    rows = cover_ratio(pool, 2, 60, (0,))
    assert [row["method"] for row in rows] == list(METHODS)
    ours = rows[0]
    assert ours["covered"] == ours["open"] == 1  # two pairs say nothing, and it says so


def test_houses_alike_are_covered():
    pools = [Pool(f"h{i}", 1.0, ours=np.arange(40.0) % (3 + i), theirs=np.arange(40.0)) for i in range(6)]
    rows = cover_houses(pools, 8, 10, 20, (0,))
    assert [row["quantity"] for row in rows] == ["ratio of means", "mean of ratios", "mean difference"]
    assert all(row["covered"] >= 0.7 for row in rows)


@pytest.fixture(scope="module")
def results():
    return SMALL.in_houses(), SMALL.over_houses()


def test_page(results):
    text = page(SMALL, *results).text("coverage", "the command")
    assert "{" not in text
    assert "the command" in text
    assert text.count("| apartment |") == 2
    assert "40 pairs of episodes" in text
    for table in text.split("\n\n"):
        if table.startswith("|"):
            assert len({line.count("|") for line in table.splitlines()}) == 1


def test_figure_has_every_cell(results):
    figure = draw(results[0])
    above, below = figure.axes
    points = sum(len(line.get_xdata()) for line in above.lines if line.get_marker() == "o")
    assert points == len(SMALL.houses) * 2 * 2 * len(METHODS)
    assert len(below.patches) == 2 * 2 * len(METHODS)


def test_seed_decides(results):
    again = dataclasses.replace(SMALL, epsilons=(0.05,)).in_houses()
    first = results[0][results[0].epsilon == 0.05].reset_index(drop=True)
    assert again.equals(first)
