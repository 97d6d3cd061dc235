"""The study of coverage: its parts by hand and against SciPy, and a small run of all of it."""

import numpy as np
import pytest
from scipy import stats

from caregiver_mj.plans.floor_plan import FloorPlan
from studies.coverage import METHODS, Coverage, draw, draw_pairs, fieller, misses, page, ratio, run_pool

SMALL = Coverage(
    houses=("paper", "apartment"), samples=20, episodes=40, sizes=(5, 20), epsilons=(1.0, 0.05),
    house_samples=2, house_set="train-2", in_house=5, house_epsilons=(1.0, 0.05),
)  # fmt: skip


def test_misses_by_hand():
    low, high = np.array([0.1, 0.2, 0.4, 0.3, 0.1]), np.array([0.2, 0.5, 0.6, 0.9, np.inf])
    assert misses((low, high), 0.3) == pytest.approx({"covered": 0.6, "too_low": 0.2, "too_high": 0.2, "open": 0.2})


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
    assert np.array_equal(pool[:, 3:], run_pool(plan, 0.5, 27, seed=7))
    assert ratio(pool) == pytest.approx(pool[0].sum() / pool[1].sum())
    drawn = draw_pairs(pool, np.random.default_rng(0), (500,))
    assert set(zip(*drawn, strict=True)) <= set(zip(*pool, strict=True))


def test_page():
    results = SMALL.in_houses(), SMALL.over_houses()
    text = page(SMALL, *results).text("coverage", "the command")
    assert "{" not in text
    assert "the command" in text
    assert text.count("| apartment |") == 2
    assert "40 pairs of episodes" in text
    for table in text.split("\n\n"):
        if table.startswith("|"):
            assert len({line.count("|") for line in table.splitlines()}) == 1
    assert len(draw(results[0]).axes) == 2
