"""The model of safety and danger of Rosman, Hayes and Scassellati (ICDL-EpiRob 2015), sections II to IV.

Trajectories of experts give the *action prior*. A novice whose moves are likely under it behaves safely; one whose
moves look random does not. The *expected danger* of an object follows from this, the probability that the novice
reaches it, and the damage of a collision.

Functions take batches of novices in their leading dimensions, written as ....
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

ACTION_COUNT = 4
PRIOR_SAFE = 0.5  # P(safe), section III
HYPERPRIOR = 1.0  # alpha_s^0(a), section II; the paper gives no value, this is Laplace's


def action_counts(
    trajectories: Sequence[Sequence[tuple[int, int]]], states: int, hyperprior: float = HYPERPRIOR
) -> np.ndarray:
    """Return alpha_s(a): the number of expert trajectories that take a in s, plus the hyperprior (section II).

    A trajectory, a sequence of (state, action) indices, counts each pair (s, a) once. The hyperprior alpha_s^0(a) is
    the same for all pairs. The array is (states, 4).

    Raises:
        ValueError: The hyperprior is not positive.
    """
    if not hyperprior > 0:
        raise ValueError(f"the hyperprior must be positive, got {hyperprior}")
    alpha = np.full((states, ACTION_COUNT), float(hyperprior))
    for trajectory in trajectories:
        for state, action in set(trajectory):
            alpha[state, action] += 1
    return alpha


def action_prior_mean(alpha: np.ndarray) -> np.ndarray:
    """Return theta_s(a) as the mean of Dir(alpha_s): (states, 4), rows sum to 1."""
    return alpha / alpha.sum(axis=1, keepdims=True)


def action_prior_draw(alpha: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return theta_s ~ Dir(alpha_s) for every state (section II): (states, 4), rows sum to 1.

    Drawn in log space, where small alpha cannot underflow all gamma variables of a state to 0. A probability of 0 would
    make an action impossible for ever; it is raised to the smallest normal number.
    """
    # For U uniform on (0, 1], Gamma(alpha) ~ Gamma(alpha + 1) U^(1 / alpha).
    log_gamma = np.log(random.standard_gamma(alpha + 1)) + np.log1p(-random.random(alpha.shape)) / alpha
    gamma = np.exp(log_gamma - log_gamma.max(axis=1, keepdims=True))
    return np.maximum(gamma / gamma.sum(axis=1, keepdims=True), np.finfo(float).tiny)


def log_likelihood_ratio(theta: np.ndarray, state: np.ndarray, action: np.ndarray) -> np.ndarray:
    """Return log theta_s(a) - log rho_s(a), one move's contribution to the log-odds of safe behaviour.

    To the unsafe agent of section III every action is equally likely: rho_s(a) = 1/4. The action prior theta is
    (states, 4); states, moves and the result share any shape. Summed over a trajectory, it is the log of the ratio of
    products in equation (1).
    """
    return np.log(theta[state, action]) + np.log(ACTION_COUNT)


def probability_safe(log_ratio: np.ndarray, prior: float = PRIOR_SAFE) -> np.ndarray:
    """Return P(safe|tau), equation (1), in log space.

    Dividing numerator and denominator by the unsafe product leaves the logistic function of
    log(prior / (1 - prior)) + sum_k [log theta(a^k) - log rho(a^k)]. The sum is `log_ratio`: `log_likelihood_ratio`
    summed over each trajectory, (...). The prior P(safe) must be strictly between 0 and 1.
    """
    return np.exp(-np.logaddexp(0.0, -_log_odds(log_ratio, prior)))


def log_probability_unsafe(log_ratio: np.ndarray) -> np.ndarray:
    """Return log(1 - P(safe|tau)), (...), accurate even where P(safe) rounds to 1; see `probability_safe`."""
    return -np.logaddexp(0.0, _log_odds(log_ratio, PRIOR_SAFE))


def _log_odds(log_ratio: np.ndarray, prior: float) -> np.ndarray:
    return np.log(prior) - np.log1p(-prior) + log_ratio


def reach_inverse(distance: np.ndarray) -> np.ndarray:
    """Return P(reach_o|tau) as inverse distance, normalised over the given objects (section IV, first reading).

    The normalising sum is common to all objects of a novice: the other objects do not change the order of two.

    Args:
        distance: Moves until the novice collides with each object, (..., objects), at least 1. Infinite for objects out
            of reach, such as a candle in the caregiver's hand.

    Returns:
        Array (..., objects); rows sum to 1 (to 0 where no object can be reached).
    """
    nearness = 1.0 / distance
    total = nearness.sum(axis=-1, keepdims=True)
    return np.divide(nearness, total, out=np.zeros_like(nearness), where=total > 0)


def reach_linear(distance: np.ndarray, largest: float) -> np.ndarray:
    """Return P(reach_o|tau) as 1 - d/d_max, (..., objects) (section IV, second reading of "normalised distance").

    Distances are as for `reach_inverse`; d_max is the largest possible one in this house.
    """
    return np.clip(1.0 - distance / largest, 0.0, 1.0)


def expected_danger(safe: np.ndarray, reach: np.ndarray, damage: np.ndarray) -> np.ndarray:
    """Return E(d_o|tau) = (1 - P(safe|tau)) P(reach_o|tau) d_o, equation (2).

    The first factor is common to all objects of a novice. It does not change their order, only how they compare with a
    threshold or with another novice's danger.

    P(safe|tau) is (...), P(reach_o|tau) and the result are (..., objects), and d_o is (objects,).
    """
    return (1.0 - safe)[..., None] * reach * damage
