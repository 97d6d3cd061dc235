"""Draws samples from pools of episodes, and counts how often intervals of them cover what is true of the pool."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate, of_difference, of_mean
from caregiver_mj.studies.coverage.methods import IN_USE, METHODS, Ends
from caregiver_mj.studies.coverage.pools import Pool

_BLOCK = 100  # samples at once
_OVER_HOUSES = {
    "ratio of means": two_level.of_ratio,
    "mean of ratios": two_level.of_mean_ratio,
    "mean difference": two_level.of_difference,
}


def misses(low: np.ndarray, high: np.ndarray, truth: float) -> dict[str, float]:
    """How often intervals miss the truth, and on which side.

    Args:
        low: Lower ends, (samples,).
        high: Upper ends.
        truth: The true value.

    Returns:
        Shares of the samples: `covered`; `too_low`, the interval lies below the truth, which flatters the caregiver;
        `too_high`; and `open`, it has no upper end.
    """
    slack = 1e-12 * abs(truth)  # of rounding
    too_low, too_high = float((high < truth - slack).mean()), float((low > truth + slack).mean())
    return {
        "covered": 1 - too_low - too_high,
        "too_low": too_low,
        "too_high": too_high,
        "open": float(np.isinf(high).mean()),
    }


def cover_ratio(pool: Pool, size: int, samples: int, seed: Sequence[int]) -> list[dict[str, Any]]:
    """Coverage of the damage left, a row a method; samples in which it is not defined are drawn anew."""
    random = np.random.default_rng(seed)
    ends: dict[str, list[Ends]] = {name: [] for name in METHODS}
    for first in range(0, samples, _BLOCK):
        ours, theirs = _draw_defined(pool, random, (min(_BLOCK, samples - first), size))
        for name, method in METHODS.items():
            ends[name].append(method(ours, theirs, random))
    rows = []
    for name, found in ends.items():
        low, high = np.concatenate(found, axis=1)
        rows.append({"quantity": "damage left", "method": name, **misses(low, high, pool.ratio)})
    return rows


def cover_means(pool: Pool, size: int, samples: int, seed: Sequence[int]) -> list[dict[str, Any]]:
    """Coverage of mean damage with the caregiver, and of the mean difference to that without."""
    random = np.random.default_rng(seed)
    means, differences = [], []
    for first in range(0, samples, _BLOCK):
        ours, theirs = pool.draw(random, (size, min(_BLOCK, samples - first)))
        means.append(of_mean(ours, least=0)[1:])
        differences.append(of_difference(ours, theirs)[1:])
    truths = {"mean damage": (means, pool.ours.mean()), "difference": (differences, (pool.ours - pool.theirs).mean())}
    rows = []
    for name, (found, truth) in truths.items():
        low, high = np.concatenate(found, axis=1)
        rows.append({"quantity": name, "method": IN_USE, **misses(low, high, truth)})
    return rows


def cover_houses(
    pools: Sequence[Pool], houses: int, episodes: int, samples: int, seed: Sequence[int]
) -> list[dict[str, Any]]:
    """Coverage over houses: so many of the pools are drawn, then so many episodes in each of them."""
    random = np.random.default_rng(seed)
    found: dict[str, list[Estimate[float]]] = {name: [] for name in _OVER_HOUSES}
    for _ in range(samples):
        drawn = [pools[i].draw(random, (episodes,)) for i in random.integers(len(pools), size=houses)]
        for name, estimate in _OVER_HOUSES.items():
            one, other = zip(*drawn, strict=True)
            found[name].append(estimate(one, other))
    ours, theirs = (np.array([getattr(pool, side).mean() for pool in pools]) for side in ("ours", "theirs"))
    truths = {
        "ratio of means": ours.sum() / theirs.sum(),
        "mean of ratios": (ours / theirs).mean(),
        "mean difference": (ours - theirs).mean(),
    }
    rows = []
    for name, truth in truths.items():
        _, low, high = np.array(found[name]).T
        rows.append({"quantity": name, "houses": houses, "truth": truth, **misses(low, high, truth)})
    return rows


def _draw_defined(pool: Pool, random: np.random.Generator, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    ours, theirs = pool.draw(random, shape)
    while (harmless := ~theirs.any(axis=1)).any():
        ours[harmless], theirs[harmless] = pool.draw(random, (int(harmless.sum()), shape[1]))
    return ours, theirs
