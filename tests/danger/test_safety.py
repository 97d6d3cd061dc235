"""The safety model, held against values worked by hand on a house of three cells.

The house is a corridor of cells 0, 1 and 2, with a stairwell west of cell 0, a bare table south of it, a candle
south of cell 2 and the only toy bin east of it::

    #######
    #S...B#
    ##T#C##
    #######

Three experts start in cells 0, 1 and 2 and walk east into the bin.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from caregiver_mj.danger import safety

NORTH, EAST, SOUTH, WEST = range(4)
EXPERTS = [[(0, EAST), (1, EAST), (2, EAST)], [(1, EAST), (2, EAST)], [(2, EAST)]]
# With hyperprior 1, east is counted 1 + 1, 2 + 1 and 3 + 1 times in cells 0, 1 and 2; all else once.
ALPHA = np.array([[1, 2, 1, 1], [1, 3, 1, 1], [1, 4, 1, 1]], float)
# Divided by 5, 6 and 7.
THETA = np.array([[1 / 5, 2 / 5, 1 / 5, 1 / 5], [1 / 6, 1 / 2, 1 / 6, 1 / 6], [1 / 7, 4 / 7, 1 / 7, 1 / 7]])
# West from cell 1, then east from cells 0 and 1. theta: 1/6 * 2/5 * 1/2 = 1/30. rho: (1/4)^3 = 1/64.
WALK = [(1, WEST), (0, EAST), (1, EAST)]


def log_ratio(walk):
    states, actions = np.array(walk).T
    return safety.log_likelihood_ratio(THETA, states, actions).sum(keepdims=True)


def test_counts_and_their_mean_by_hand():
    np.testing.assert_array_equal(safety.action_counts(EXPERTS, 3), ALPHA)
    # The hyperprior is added to every count.
    np.testing.assert_array_equal(safety.action_counts(EXPERTS, 3, 0.5), ALPHA - 0.5)
    # A trajectory counts once however often it passes.
    there_and_back = [(0, EAST), (1, WEST), (0, EAST), (1, EAST)]
    np.testing.assert_array_equal(safety.action_counts([there_and_back], 2, 1.0), [[1, 2, 1, 1], [1, 2, 1, 2]])
    np.testing.assert_allclose(safety.action_prior_mean(ALPHA), THETA, rtol=1e-15)


@pytest.mark.parametrize("hyperprior", [0.0, -1.0, float("nan")])
def test_the_hyperprior_must_be_positive(hyperprior):
    with pytest.raises(ValueError, match="hyperprior must be positive"):
        safety.action_counts(EXPERTS, 3, hyperprior)


@given(st.lists(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 3)), max_size=12), max_size=8))
def test_counts_are_conserved_and_do_not_depend_on_the_order(trajectories):
    alpha = safety.action_counts(trajectories, 5, 1.0)
    assert alpha.sum() == 5 * 4 + sum(len(set(t)) for t in trajectories)
    np.testing.assert_array_equal(alpha, safety.action_counts([t[::-1] for t in trajectories[::-1]], 5, 1.0))


@pytest.mark.parametrize("alpha", [[1, 4, 1, 1], [0.1, 2.1, 0.1, 0.1], [10, 30, 20, 40]])
def test_draws_have_the_mean_and_variance_of_the_dirichlet_distribution(alpha):
    many, alpha = 40_000, np.array(alpha, float)
    theta = safety.action_prior_draw(np.tile(alpha, (many, 1)), np.random.default_rng(0))
    np.testing.assert_allclose(theta.sum(axis=1), 1.0, rtol=1e-12)
    total = alpha.sum()
    variance = alpha * (total - alpha) / (total**2 * (total + 1))
    np.testing.assert_allclose(theta.mean(axis=0), alpha / total, atol=4 * np.sqrt(variance.max() / many))
    np.testing.assert_allclose(theta.var(axis=0), variance, rtol=0.05)


def test_draws_of_the_tiniest_counts_are_probabilities_all_the_same():
    # Gamma variables of such shapes underflow to 0, all four at once.
    with np.errstate(all="raise", under="ignore"):
        theta = safety.action_prior_draw(np.full((2000, 4), 1e-4), np.random.default_rng(0))
    assert (theta > 0).all()
    np.testing.assert_allclose(theta.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(theta.mean(axis=0), 0.25, atol=4 * np.sqrt(0.25 * 0.75 / 2000))


def test_probabilities_by_hand():
    # East from cell 1: theta 1/2 against rho 1/4, the odds double: P = 2/3.
    assert log_ratio([(1, EAST)])[0] == pytest.approx(np.log(2), rel=1e-14)
    assert safety.probability_safe(log_ratio([(1, EAST)]))[0] == pytest.approx(2 / 3, rel=1e-14)
    # (1/30 * 1/2) / (1/30 * 1/2 + 1/64 * 1/2) = 64 / (64 + 30) = 32/47
    assert safety.probability_safe(log_ratio(WALK))[0] == pytest.approx(32 / 47, rel=1e-14)
    # (1/30 * 1/5) / (1/30 * 1/5 + 1/64 * 4/5) = (1/150) / (1/150 + 1/80) = 80 / (80 + 150) = 8/23
    assert safety.probability_safe(log_ratio(WALK), prior=0.2)[0] == pytest.approx(8 / 23, rel=1e-14)
    # Before the first move it is the prior.
    np.testing.assert_allclose(safety.probability_safe(np.zeros(2)), 0.5, rtol=1e-15)
    np.testing.assert_allclose(safety.probability_safe(np.zeros(2), prior=0.9), 0.9, rtol=1e-14)
    # Small probabilities keep their digits.
    # Odds of 4^-200 = 2^-400, and P = odds / (1 + odds).
    assert safety.probability_safe(np.array([-200 * np.log(4)]))[0] == pytest.approx(2.0**-400, rel=1e-12)


def test_a_hundred_thousand_moves_neither_overflow_nor_lose_their_balance():
    steps = 100_000
    with np.errstate(all="raise", under="ignore"):
        # (1/2)^100000 itself is 0 in floating point, and so is (1/4)^100000.
        safe = safety.probability_safe(steps * log_ratio([(1, EAST)]))
        odd = safety.probability_safe(steps * log_ratio([(2, NORTH)]))  # theta 1/7 < 1/4
        # Twice as likely and half as likely in turn: (1/2 * 1/8) / (1/4 * 1/4) = 1.
        theta = np.array([[1 / 8, 1 / 2, 1 / 8, 1 / 4]])
        actions = np.tile([EAST, NORTH], steps // 2)
        sums = np.cumsum(safety.log_likelihood_ratio(theta, np.zeros(steps, int), actions))
        balanced = safety.probability_safe(sums[-1:])
    assert (safe[0], odd[0], balanced[0]) == (1.0, 0.0, pytest.approx(0.5, abs=1e-9))


# From cell 0: 1 move into the stairwell, 3 (east, east, south) into the candle.
DISTANCE = np.array([[1.0, 3.0]])
DAMAGE = np.array([5.0, 4.0])


def test_distances_and_danger_by_hand():
    # 1/1 and 1/3 of their sum 4/3.
    np.testing.assert_allclose(safety.reach_inverse(DISTANCE), [[3 / 4, 1 / 4]], rtol=1e-15)
    # The largest distance in the house is 3: 1 - 1/3 and 1 - 3/3.
    np.testing.assert_allclose(safety.reach_linear(DISTANCE, 3.0), [[2 / 3, 0.0]], rtol=1e-15)
    safe = np.array([32 / 47])
    # (1 - 32/47) = 15/47; times 3/4 * 5 = 15/4 and 1/4 * 4 = 1.
    inverse = safety.expected_danger(safe, safety.reach_inverse(DISTANCE), DAMAGE)
    np.testing.assert_allclose(inverse, [[225 / 188, 15 / 47]], rtol=1e-14)
    # 15/47 * 2/3 * 5 = 50/47, and 0.
    linear = safety.expected_danger(safe, safety.reach_linear(DISTANCE, 3.0), DAMAGE)
    np.testing.assert_allclose(linear, [[50 / 47, 0.0]], rtol=1e-14)
    # What cannot be collided with is not reached.
    np.testing.assert_array_equal(safety.reach_inverse(np.array([[2.0, np.inf]])), [[1.0, 0.0]])
    np.testing.assert_array_equal(safety.reach_inverse(np.array([[np.inf, np.inf]])), [[0.0, 0.0]])
    np.testing.assert_array_equal(safety.reach_linear(np.array([[2.0, np.inf]]), 4.0), [[0.5, 0.0]])


def test_a_house_without_objects_has_no_danger():
    nothing = np.zeros((2, 0))
    assert safety.reach_inverse(nothing).shape == safety.reach_linear(nothing, 3.0).shape == (2, 0)
    assert safety.expected_danger(np.array([0.5, 0.5]), nothing, np.zeros(0)).shape == (2, 0)


DISTANCES = hnp.arrays(float, (3, 4), elements=st.floats(1, 50))


@settings(max_examples=50)
@given(DISTANCES, st.permutations(range(4)))
def test_inverse_distance_is_normalised_and_knows_no_unit_and_no_order(distance, order):
    reach = safety.reach_inverse(distance)
    np.testing.assert_allclose(reach.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(safety.reach_inverse(7.0 * distance), reach, rtol=1e-12)
    np.testing.assert_allclose(safety.reach_inverse(distance[:, order]), reach[:, order], rtol=1e-12)


@settings(max_examples=50)
@given(DISTANCES)
def test_nearer_objects_are_likelier_in_both_readings(distance):
    for reach in (safety.reach_inverse(distance), safety.reach_linear(distance, 50.0)):
        assert (np.diff(np.take_along_axis(reach, distance.argsort(axis=1), axis=1), axis=1) <= 1e-15).all()
        assert ((reach >= 0) & (reach <= 1)).all()
