"""Over houses: every house counts the same, and what is between houses is the chance."""

import numpy as np
import pytest
from comparing import twelve_houses

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import of_difference, of_mean, of_ratio

HOUSES = twelve_houses()
ESTIMATES = (two_level.of_mean_ratio, two_level.of_ratio, two_level.of_difference)


def test_by_hand():
    ours, theirs = [[2, 0, 4], [3, 5]], [[10, 20, 30], [4, 4]]
    assert (two_level.house_means(ours).tolist(), two_level.of_mean(ours).value) == ([2, 4], 3)
    assert two_level.of_mean_ratio(ours, theirs).value == pytest.approx(0.55)  # of .1 and 1
    assert two_level.of_ratio(ours, theirs).value == pytest.approx(6 / 24)
    assert two_level.of_difference(ours, theirs).value == pytest.approx(-9)


def test_houses_count_the_same():
    ours, theirs = HOUSES
    often = [np.tile(ours[0], 5), *ours[1:]], [np.tile(theirs[0], 5), *theirs[1:]]
    for estimate in ESTIMATES:
        assert estimate(*often).value == pytest.approx(estimate(*HOUSES).value)


def test_episodes_alike_leave_the_chance_of_houses():
    """With one episode in each house, or many that are all the same, a house is a pair like any other."""
    ours, theirs = ([house[:1] for house in side] for side in HOUSES)
    y, x = np.concatenate(ours), np.concatenate(theirs)
    for count in (1, 7):
        found = [[np.tile(house, count) for house in side] for side in (ours, theirs)]
        assert two_level.of_ratio(*found) == pytest.approx(of_ratio(y, x), rel=0.05)
        assert two_level.of_difference(*found) == pytest.approx(of_difference(y, x), rel=0.05)
        assert two_level.of_mean(found[0]) == pytest.approx(of_mean(y), rel=0.05)


def test_columns_of_houses():
    other = [house[::-1] + 1 for house in HOUSES[0]]
    both = [[np.stack(pair, axis=1) for pair in zip(*sides, strict=True)] for sides in ((HOUSES[0], other), HOUSES)]
    for estimate in ESTIMATES:
        found = estimate(*both)
        assert found.column(0) == pytest.approx(estimate(HOUSES[0], HOUSES[0]))
        assert found.column(1) == pytest.approx(estimate(other, HOUSES[1]))


def test_little_to_go_on():
    lone = [[1, 2, 3]], [[4, 5, 6]]
    assert two_level.of_ratio(*lone) == two_level.of_mean_ratio(*lone) == (0.4, 0, np.inf)
    assert two_level.of_difference(*lone) == (-3, -np.inf, np.inf)
    assert two_level.of_mean_ratio([[1, 2], [0, 0], [1, 1]], [[4, 2], [0, 0], [2, 2]]).value == pytest.approx(0.5)
    nothing = [[0, 0], [0, 0]], [[0, 0], [0, 0]]
    assert np.isnan([*two_level.of_mean_ratio(*nothing), *two_level.of_ratio(*nothing)]).all()
    assert two_level.of_difference(*nothing) == (0, 0, 0)
    safe = [[0, 0]] * 10, [[3, 4]] * 10
    assert two_level.of_ratio(*safe) == two_level.of_mean_ratio(*safe) == (0, 0, np.inf)


@pytest.mark.parametrize(("houses", "wanted"), [(3, (0.5, 0, np.inf)), (4, (0.5, 0.5, 0.5))])
def test_houses_that_are_all_the_same(houses, wanted):
    ours, theirs = [[2, 2]] * houses, [[4, 4]] * houses
    assert two_level.of_ratio(ours, theirs) == two_level.of_mean_ratio(ours, theirs) == wanted
    assert two_level.of_mean(ours) == (2, 2, 2)
    by_chance = [[1, 3], [3, 1], [2, 2], [0, 4]]  # equal means of a few different episodes bound nothing
    assert (
        two_level.of_mean(by_chance)
        == two_level.of_ratio(by_chance, [[1, 1]] * 4, least=-np.inf)
        == (2, -np.inf, np.inf)
    )


def test_ratios_that_may_be_negative():
    """Ours less theirs over theirs is the ratio less 1, and so are its ends."""
    ours, theirs = HOUSES
    less = [y - x for y, x in zip(ours, theirs, strict=True)]
    wanted = np.subtract(two_level.of_ratio(ours, theirs), 1)
    assert two_level.of_ratio(less, theirs, least=-np.inf) == pytest.approx(wanted)
    zero = two_level.of_ratio([[1.0, 2], [-2.0, -3], [2.0, 1], [-1.0, 0]], [[4.0, 5]] * 4, least=-np.inf)
    assert -np.inf < zero.low < zero.value == 0 < zero.high < np.inf  # a value as any other
    assert of_ratio(less[0], theirs[0], least=-np.inf) == pytest.approx(np.subtract(of_ratio(ours[0], theirs[0]), 1))
    assert of_ratio(-ours[0], np.arange(20.0) - 9, least=-np.inf)[1:] == (-np.inf, np.inf)  # the latter may be zero
