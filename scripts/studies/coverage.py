"""How often 95 % intervals cover the truth.

Samples are drawn, again and again, from so many episodes of the grid world that their mean may pass for the truth.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import CONFIDENCE, Estimate, of_difference, of_mean, of_ratio, solve
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE
from study import Page, Parser, progress

IN_USE = "studentised (in use)"
WANTED = (0.94, 0.965)  # coverage of what is called 95 %
_EPISODES_AT_ONCE, _SAMPLES_AT_ONCE = 1000, 100
_CAREGIVERS = ("none", "paper")
_RESAMPLES = 1999
_TAILS = np.array([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
_OVER_HOUSES = {
    "ratio of means": two_level.of_ratio,
    "mean of ratios": two_level.of_mean_ratio,
    "mean difference": two_level.of_difference,
}
_COLOURS = (colours.ROBOT, colours.BIN, colours.CANDLE, colours.DAMAGE)
_BAND = "#dfe3e8"
_WIDTH = 0.19  # of a method's column in the figure


@dataclasses.dataclass(frozen=True)
class Coverage:
    """What is simulated."""

    houses: tuple[str, ...] = ("paper", "apartment", "house-100002", "house-100006")  # names of floor plans
    samples: int = 4000  # samples for each house, epsilon and size
    episodes: int = 5000  # pairs of episodes in a house to draw them from
    sizes: tuple[int, ...] = (20, 50, 200)  # episodes in a sample
    epsilons: tuple[float, ...] = (1.0, 0.75, 0.5, 0.25, 0.05)  # shares of random moves
    house_samples: int = 500  # samples over houses for each epsilon and number of houses
    house_set: str = "train-40"  # name of the houses to draw them from
    house_sizes: tuple[int, ...] = (10, 50)  # houses in a sample
    in_house: int = 20  # episodes in each house of a sample; there are 20 times as many to draw from
    house_epsilons: tuple[float, ...] = (1.0, 0.5, 0.05)  # shares of random moves over houses
    seed: int = 0  # seed of everything

    def in_houses(self) -> pd.DataFrame:
        """Coverage over episodes, in a house."""
        rows: list[dict[str, Any]] = []
        plans = [FloorPlan.load(name) for name in self.houses]
        cells = [(i, plan, epsilon) for i, plan in enumerate(plans) for epsilon in self.epsilons]
        for i, plan, epsilon in progress(cells, "episodes"):
            pool = run_pool(plan, epsilon, self.episodes, self.seed)
            for size in self.sizes:
                seed = (self.seed, i, round(100 * epsilon), size)
                found = cover_ratio(pool, size, self.samples, (*seed, 0))
                found += cover_means(pool, size, self.samples // 4, (*seed, 1))
                cell = {"house": plan.name, "epsilon": epsilon, "size": size}
                rows += [cell | {"truth": pool.ratio, "harmless": pool.harmless} | row for row in found]
        return pd.DataFrame(rows)

    def over_houses(self) -> pd.DataFrame:
        """Coverage over houses, without those in which a child alone is never hurt."""
        rows: list[dict[str, Any]] = []
        houses = house_set(self.house_set)
        for epsilon in progress(self.house_epsilons, "houses"):
            runs = 20 * self.in_house
            pools = [run_pool(plan, epsilon, runs, self.seed + runs * i) for i, plan in enumerate(houses)]
            pools = [pool for pool in pools if pool.theirs.any()]
            for size in self.house_sizes:
                seed = (self.seed, round(100 * epsilon), size)
                found = cover_houses(pools, size, self.in_house, self.house_samples, seed)
                rows += [{"epsilon": epsilon, "pools": len(pools)} | row for row in found]
        return pd.DataFrame(rows)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("samples", Coverage.samples, "samples a cell")
    parser.add("seed", Coverage.seed, "seed of everything")


def run(options: argparse.Namespace) -> Page:
    """Draw the samples; return the page."""
    study = Coverage(samples=options.samples, seed=options.seed)
    return page(study, study.in_houses(), study.over_houses())


def page(study: Coverage, episodes: pd.DataFrame, houses: pd.DataFrame) -> Page:
    """The page of what came out over episodes, and over houses."""
    left, rest = (group for _, group in episodes.groupby(episodes.quantity != "damage left"))
    ours, percentile = (left[left.method == method] for method in (IN_USE, "percentile"))
    values = {
        "study": study,
        "methods": _summary(left, "method"),
        "means": _summary(rest, "quantity"),
        "cells": list(ours.groupby(["house", "epsilon"], sort=False)),
        "count": len(ours) // len(study.sizes),
        "outside": ours[~ours.covered.between(*WANTED)],
        "ours": ours,
        "wanted": WANTED,
        "worst_percentile": percentile[percentile["size"] == study.sizes[0]].covered.min(),
        "quantities": houses.quantity.unique(),
        "over_houses": list(houses.groupby(["epsilon", "houses"], sort=False)),
    }
    return Page(values, {"coverage.png": draw(episodes)})


def _summary(rows: pd.DataFrame, key: str) -> list[tuple[str, int, tuple[float, ...]]]:
    """By a key and the size of samples, shares: covered on average, at least, at most; too low, and too high."""
    return [
        (name, size, (group.covered.mean(), group.covered.min(), group.covered.max(), *group[_SIDES].mean()))
        for (name, size), group in rows.groupby([key, "size"], sort=False)
    ]


_SIDES = ["too_low", "too_high"]


# -- Populations to draw episodes from, whose true means are known: many real episodes of the grid world ---------------


@dataclasses.dataclass(frozen=True)
class Pool:
    """Pairs of episodes, the same child in both."""

    house: str  # name of the floor plan
    epsilon: float  # share of the child's moves that are random
    ours: np.ndarray  # damage with the paper's caregiver, (episodes,)
    theirs: np.ndarray  # damage without any, likewise

    @property
    def ratio(self) -> float:
        """The true damage left."""
        return float(self.ours.mean() / self.theirs.mean())

    @property
    def harmless(self) -> float:
        """Share of the pairs without damage in either."""
        return float(((self.ours == 0) & (self.theirs == 0)).mean())

    def draw(self, random: np.random.Generator, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Draw pairs at random: ours and theirs, of some shape."""
        drawn = random.integers(len(self.ours), size=shape)
        return self.ours[drawn], self.theirs[drawn]


def run_pool(plan: FloorPlan, epsilon: float, episodes: int, seed: int) -> Pool:
    """Run so many pairs of episodes."""
    damage = []
    for name in _CAREGIVERS:
        starts = range(0, episodes, _EPISODES_AT_ONCE)
        blocks = [range(first, min(first + _EPISODES_AT_ONCE, episodes)) for first in starts]
        runs = (
            run_episodes(plan, epsilon, make_caregiver(name, plan), [seed + i for i in block]).damage
            for block in blocks
        )
        damage.append(np.concatenate(list(runs)))
    return Pool(plan.name, epsilon, ours=damage[1], theirs=damage[0])


# -- Intervals of a ratio of means to compare ours with; samples are (columns, n) --------------------------------------

Ends = tuple[np.ndarray, np.ndarray]


def studentised(ours: np.ndarray, theirs: np.ndarray, _random: np.random.Generator) -> Ends:
    """The one in use, with the resamples that it always has."""
    found = of_ratio(ours.T, theirs.T)
    return found.low, found.high


def fieller(ours: np.ndarray, theirs: np.ndarray, _random: np.random.Generator) -> Ends:
    """Fieller's interval, of normal theory."""
    t = np.full(len(ours), stats.t.ppf(_TAILS[1], ours.shape[1] - 1))
    return solve(ours, theirs, -t, t)


def percentile(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """Quantiles of resampled ratios."""
    again = _resampled(ours, theirs, random)
    low, high = (_quantile(again, np.full(len(ours), tail)) for tail in _TAILS)
    return low, high


def bca(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> Ends:
    """Bias-corrected and accelerated ones (Efron 1987), as of `scipy.stats.bootstrap`."""
    again = _resampled(ours, theirs, random)
    ratio = ours.sum(axis=1, keepdims=True) / theirs.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = stats.norm.ppf(((again < ratio).mean(axis=1) + (again <= ratio).mean(axis=1)) / 2)
        without = (ours.sum(axis=1, keepdims=True) - ours) / (theirs.sum(axis=1, keepdims=True) - theirs)
        change = without.mean(axis=1, keepdims=True) - without
        acceleration = np.nan_to_num((change**3).sum(axis=1) / (6 * (change**2).sum(axis=1) ** 1.5))
        moved = (shift + stats.norm.ppf(tail) for tail in _TAILS)
        tails = [stats.norm.cdf(shift + z / (1 - acceleration * z)) for z in moved]
    low, high = (_quantile(again, np.nan_to_num(tail, nan=0.5)) for tail in tails)
    return low, high


METHODS: dict[str, Callable[[np.ndarray, np.ndarray, np.random.Generator], Ends]] = {
    IN_USE: studentised,
    "Fieller": fieller,
    "BCa": bca,
    "percentile": percentile,
}


def _resampled(ours: np.ndarray, theirs: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Ratios of resamples in order, (columns, resamples), the same for all; NaN, where there is none, last."""
    size = ours.shape[1]
    share = random.multinomial(size, np.full(size, 1 / size), size=_RESAMPLES).T / size
    y, x = ours @ share, theirs @ share
    return np.sort(np.divide(y, x, out=np.full_like(x, np.nan), where=x > 0), axis=1)


def _quantile(ordered: np.ndarray, tail: np.ndarray) -> np.ndarray:
    """Quantiles (columns,) of values in order, (columns, resamples), NaN last."""
    place = tail * ((~np.isnan(ordered)).sum(axis=1) - 1)
    first = np.floor(place).astype(int)[:, None]
    low, high = (np.take_along_axis(ordered, first + i, axis=1)[:, 0] for i in (0, 1))
    share = place - first[:, 0]
    return np.where(share > 0, low + share * (high - low), low)


# -- Samples, and how often intervals of them cover what is true of the pool -------------------------------------------


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
    open_ended = float(np.isinf(high).mean())
    return {"covered": 1 - too_low - too_high, "too_low": too_low, "too_high": too_high, "open": open_ended}


def cover_ratio(pool: Pool, size: int, samples: int, seed: Sequence[int]) -> list[dict[str, Any]]:
    """Coverage of the damage left, a row a method; samples in which it is not defined are drawn anew."""
    random = np.random.default_rng(seed)
    ends: dict[str, list[Ends]] = {name: [] for name in METHODS}
    for first in range(0, samples, _SAMPLES_AT_ONCE):
        ours, theirs = _draw_defined(pool, random, (min(_SAMPLES_AT_ONCE, samples - first), size))
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
    for first in range(0, samples, _SAMPLES_AT_ONCE):
        ours, theirs = pool.draw(random, (size, min(_SAMPLES_AT_ONCE, samples - first)))
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


# -- The figure --------------------------------------------------------------------------------------


def draw(episodes: pd.DataFrame) -> Figure:
    """Coverage of every cell by method and size, and below it on which side the intervals miss."""
    left = episodes[episodes.quantity == "damage left"]
    with mpl.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure((5.2, 5.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        sizes, methods = left["size"].unique(), left.method.unique()
        for i, (method, colour) in enumerate(zip(methods, _COLOURS, strict=True)):
            shade = colours.unit(colour)
            places = np.arange(len(sizes)) + (i - (len(methods) - 1) / 2) * _WIDTH
            groups = [left[(left.method == method) & (left["size"] == size)] for size in sizes]
            for place, group in zip(places, groups, strict=True):
                spread = place + np.linspace(-0.35, 0.35, len(group)) * _WIDTH
                above.plot(spread, 100 * group.covered, "o", color=shade, markersize=3.4, markeredgewidth=0)
            below.bar(places, [100 * g.too_low.mean() for g in groups], 0.85 * _WIDTH, color=shade, label=method)
            below.bar(places, [-100 * g.too_high.mean() for g in groups], 0.85 * _WIDTH, color=shade, alpha=0.45)
        above.axhspan(100 * WANTED[0], 100 * WANTED[1], color=_BAND, zorder=0)
        above.axhline(95, color=INK, linewidth=0.8, zorder=1)
        above.set_ylabel("interval covers the truth, %\n(a point: house and epsilon)")
        below.axhline(0, color=INK, linewidth=0.8)
        for wanted in (2.5, -2.5):
            below.axhline(wanted, color=INK, linewidth=0.8, linestyle=":")
        below.set_yticks([-2.5, 0, 2.5, 5], ["2.5", "0", "2.5", "5"])
        below.set_ylabel("truth above the interval\n(flattering), or below it, %")
        below.set_xticks(range(len(sizes)), [f"{size} episodes" for size in sizes])
        handles, labels = below.get_legend_handles_labels()
        above.legend(handles, labels, loc="lower right", ncols=2, fontsize=8.5)
    return figure
