"""Over houses: every house counts the same, and what is between houses is the chance."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.house_rows import compare_over_houses, each_house
from caregiver_mj.experiments.intervals import of_difference, of_ratio
from caregiver_mj.experiments.two_level import over_houses

ESTIMATES = ("mean_ratio", "ratio_of_means", "mean_difference")


@pytest.fixture
def houses():
    """Twelve houses of 20 episodes: ours, theirs."""
    random = np.random.default_rng(1)
    share = random.uniform(0.2, 0.5, 12)
    theirs = [random.poisson(mean, 20).astype(float) for mean in random.uniform(5, 30, 12)]
    return [random.binomial(x.astype(int), p).astype(float) for x, p in zip(theirs, share, strict=True)], theirs


def test_by_hand():
    found = over_houses([[2, 0, 4], [3, 5]], [[10, 20, 30], [4, 4]])
    assert found.ours.tolist() == [2, 4]
    assert found.theirs.tolist() == [20, 4]
    assert found.ratios.tolist() == [0.1, 1]
    assert found.mean_ratio.value == pytest.approx(0.55)
    assert found.ratio_of_means.value == pytest.approx(6 / 24)
    assert found.mean_difference.value == pytest.approx(-9)


def test_houses_count_the_same(houses):
    ours, theirs = houses
    often = over_houses([np.tile(ours[0], 5), *ours[1:]], [np.tile(theirs[0], 5), *theirs[1:]])
    once = over_houses(ours, theirs)
    for name in ESTIMATES:
        assert getattr(often, name).value == pytest.approx(getattr(once, name).value)


def test_episodes_alike_leave_the_chance_of_houses(houses):
    """With one episode in each house, or many that are all the same, a house is a pair like any other."""
    ours, theirs = ([house[:1] for house in side] for side in houses)
    y, x = np.concatenate(ours), np.concatenate(theirs)
    for count in (1, 7):
        found = over_houses([np.tile(house, count) for house in ours], [np.tile(house, count) for house in theirs])
        assert found.ratio_of_means == pytest.approx(of_ratio(y, x), rel=0.05)
        assert found.mean_difference == pytest.approx(of_difference(y, x), rel=0.05)


def test_scaling_and_determinism(houses):
    ours, theirs = houses
    found = over_houses(ours, theirs)
    scaled = over_houses([3 * house for house in ours], theirs)
    assert scaled.mean_ratio == pytest.approx([3 * end for end in found.mean_ratio])
    assert scaled.ratio_of_means == pytest.approx([3 * end for end in found.ratio_of_means])
    for name in ESTIMATES:
        estimate = getattr(found, name)
        assert estimate.low < estimate.value < estimate.high
        assert getattr(over_houses(ours, theirs), name) == estimate


def test_swapping_over_houses(houses):
    value, low, high = over_houses(*houses).ratio_of_means
    assert over_houses(*houses[::-1]).ratio_of_means == pytest.approx((1 / value, 1 / high, 1 / low))


def test_more_houses_are_worth_more_than_more_episodes():
    random = np.random.default_rng(2)

    def width(houses, episodes):
        share = random.uniform(0.1, 0.7, houses)
        theirs = random.poisson(20, (houses, episodes)).astype(float)
        _, low, high = over_houses(random.binomial(theirs.astype(int), share[:, None]), theirs).ratio_of_means
        return high - low

    assert width(10, 200) > 0.6 * width(10, 20)
    assert width(100, 20) < 0.5 * width(10, 20)


def test_little_to_go_on():
    lone = over_houses([[1, 2, 3]], [[4, 5, 6]])
    assert lone.ratio_of_means == (0.4, 0, np.inf)
    assert lone.mean_ratio == (0.4, 0, np.inf)
    assert lone.mean_difference == (-3, -np.inf, np.inf)
    harmless = over_houses([[1, 2], [0, 0], [1, 1]], [[4, 2], [0, 0], [2, 2]])
    assert np.isnan(harmless.ratios[1])
    assert harmless.mean_ratio.value == pytest.approx(0.5)
    nothing = over_houses([[0, 0], [0, 0]], [[0, 0], [0, 0]])
    assert np.isnan([*nothing.mean_ratio, *nothing.ratio_of_means]).all()
    assert nothing.mean_difference.value == 0
    safe = over_houses([[0, 0]] * 10, [[3, 4]] * 10)
    assert safe.ratio_of_means == safe.mean_ratio == (0, 0, np.inf)


def test_coverage_over_houses():
    """Ten houses whose ratios differ, in each of which 20 episodes say little: percentiles would be far too wide."""
    random = np.random.default_rng(3)
    covered = {"mean_ratio": [], "ratio_of_means": []}
    for _ in range(200):
        theirs = random.poisson(10.0, (10, 20)).astype(float)
        ours = random.binomial(theirs.astype(int), random.beta(3, 7, 10)[:, None]).astype(float)
        found = over_houses(ours, theirs)
        for name, hits in covered.items():
            _, low, high = getattr(found, name)
            hits.append(low <= 0.3 <= high)
    for hits in covered.values():
        assert 0.9 <= np.mean(hits) < 0.99


# -- Rows --------------------------------------------------------------------------------------------


def frame(houses, epsilons=(1.0,)):
    ours, theirs = houses
    return pd.DataFrame(
        {"world": "grid", "house": f"h{j}", "caregiver": name, "epsilon": e, "episode": i, "damage": value * e}
        for e in epsilons
        for name, side in (("none", theirs), ("paper", ours))
        for j, house in enumerate(side)
        for i, value in enumerate(house)
    )


def test_rows_over_houses(houses):
    episodes = frame(houses, (1.0, 0.5))
    shuffled = episodes.sample(frac=1, random_state=0).sort_values("epsilon", ascending=False, kind="stable")
    first, second = compare_over_houses(episodes, "paper")
    found = over_houses(*houses)
    assert (first["world"], first["epsilon"], second["epsilon"]) == ("grid", 1.0, 0.5)
    assert (first["caregiver"], first["baseline"]) == ("paper", "none")
    assert (first["houses"], first["houses_defined"], first["episodes"]) == (12, 12, 240)
    assert first["damage_left"] == pytest.approx(found.ratio_of_means.value)
    assert first["damage_left_by_house"] == pytest.approx(found.mean_ratio.value)
    assert first["damage_left_by_house_ci_high"] == found.mean_ratio.high
    assert first["damage_difference_mean"] == pytest.approx(2 * second["damage_difference_mean"])
    assert first["damage_difference_ci_low"] == found.mean_difference.low
    assert first["damage_p"] == pytest.approx(2 / 2**12)  # less in all twelve houses
    assert first["damage_verdict"] == "less"
    again = compare_over_houses(shuffled, "paper")[0]
    assert again["damage_left"] == pytest.approx(first["damage_left"])
    assert again["damage_left_ci_low"] == pytest.approx(first["damage_left_ci_low"], rel=0.05)


def test_pairs_are_found_by_episode(houses):
    episodes = frame(houses)
    pd.testing.assert_frame_equal(
        pd.DataFrame(compare_over_houses(episodes.sort_values("damage"), "paper"))[["damage_left", "damage_p"]],
        pd.DataFrame(compare_over_houses(episodes, "paper"))[["damage_left", "damage_p"]],
    )


def test_kinds_of_children_stay_apart(houses):
    episodes = pd.concat([frame(houses).assign(family=family) for family in ("1", "adversary:1")])
    assert [row["family"] for row in compare_over_houses(episodes, "paper")] == ["1", "adversary:1"]


def test_each_house(houses):
    rows = each_house(frame(houses), "paper")
    assert [row["house"] for row in rows] == [f"h{j}" for j in range(12)]
    assert rows[3]["damage_left_ci_low"] == of_ratio(houses[0][3], houses[1][3]).low
    assert rows[3]["episodes"] == 20


def test_no_numbers_are_none():
    (row,) = compare_over_houses(frame(([[1, 2]], [[2, 3]])), "paper")
    assert row["damage_left"] == pytest.approx(0.6)
    assert row["damage_left_ci_high"] is row["damage_p"] is None
    assert row["damage_verdict"] == "no verdict"


def test_what_does_not_pair_is_refused(houses):
    episodes = frame(houses)
    with pytest.raises(CaregiverError, match="1 episodes of 'paper' or 'none' have no counterpart"):
        compare_over_houses(episodes.iloc[:-1], "paper")
    with pytest.raises(CaregiverError, match="no episodes with the caregiver 'nanny': there are none, paper"):
        compare_over_houses(episodes, "nanny")
