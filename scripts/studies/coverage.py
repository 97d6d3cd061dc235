"""How often 95 % intervals cover the truth.

Samples are drawn, again and again, from so many episodes of the grid world that their mean may pass for the truth.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import CONFIDENCE, of_difference, of_mean, of_ratio, solve
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import INK, STYLE
from study import Page, Parser, load_house, progress

IN_USE = "studentised (in use)"
WANTED = (0.94, 0.965)  # coverage of what is called 95 %
_SAMPLES_AT_ONCE = 100
_CAREGIVERS = ("paper", "none")
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
        """Return coverage over episodes, in a house."""
        rows: list[dict[str, Any]] = []
        for (i, house), epsilon in progress([*itertools.product(enumerate(self.houses), self.epsilons)], "episodes"):
            pool = run_pool(load_house(house), epsilon, self.episodes, self.seed)
            cell = {"house": house, "epsilon": epsilon, "truth": ratio(pool), "harmless": (~pool.any(axis=0)).mean()}
            for size in self.sizes:
                seed = (self.seed, i, round(100 * epsilon), size)
                found = cover_ratio(pool, size, self.samples, (*seed, 0))
                found += cover_means(pool, size, self.samples // 4, (*seed, 1))
                rows += [cell | {"size": size} | row for row in found]
        return pd.DataFrame(rows)

    def over_houses(self) -> pd.DataFrame:
        """Return coverage over houses, without those in which a child alone is never hurt."""
        rows: list[dict[str, Any]] = []
        houses = house_set(self.house_set)
        for epsilon in progress(self.house_epsilons, "houses"):
            runs = 20 * self.in_house
            pools = [run_pool(plan, epsilon, runs, self.seed + runs * i) for i, plan in enumerate(houses)]
            pools = [pool for pool in pools if pool[1].any()]
            for size in self.house_sizes:
                seed = (self.seed, round(100 * epsilon), size)
                found = cover_houses(pools, size, self.in_house, self.house_samples, seed)
                rows += [{"epsilon": epsilon, "houses": size} | row for row in found]
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
    parts = rows.groupby([key, "size"], sort=False)
    return [
        (*at, (*part.covered.agg(["mean", "min", "max"]), part.too_low.mean(), part.too_high.mean()))
        for at, part in parts
    ]


# -- Populations to draw episodes from, whose true means are known: many real episodes of the grid world ---------------


def run_pool(plan: FloorPlan, epsilon: float, episodes: int, seed: int) -> np.ndarray:
    """Return the damage of so many pairs of episodes, with the paper's caregiver and without any, (2, episodes)."""
    seeds = range(seed, seed + episodes)
    return np.array([run_episodes(plan, epsilon, make_caregiver(name, plan), seeds).damage for name in _CAREGIVERS])


def ratio(pool: np.ndarray) -> float:
    """Return the true damage left."""
    ours, theirs = pool.mean(axis=1)
    return float(ours / theirs)


def draw_pairs(pool: np.ndarray, random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Draw pairs at random: ours and theirs, of some shape."""
    return pool[:, random.integers(pool.shape[1], size=shape)]


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


def misses(ends: Sequence[np.ndarray] | np.ndarray, truth: float) -> dict[str, float]:
    """Return how often intervals miss the truth, and on which side.

    Args:
        ends: Their lower and upper ends, (2, samples).
        truth: The true value.

    Returns:
        Shares of the samples: `covered`; `too_low`, the interval lies below the truth, which flatters the caregiver;
        `too_high`; and `open`, it has no upper end.
    """
    low, high = ends
    slack = 1e-12 * abs(truth)  # of rounding
    too_low, too_high = float((high < truth - slack).mean()), float((low > truth + slack).mean())
    open_ended = float(np.isinf(high).mean())
    return {"covered": 1 - too_low - too_high, "too_low": too_low, "too_high": too_high, "open": open_ended}


def cover_ratio(pool: np.ndarray, size: int, samples: int, seed: Sequence[int]) -> list[dict[str, Any]]:
    """Return coverage of the damage left, a row a method; samples in which it is not defined are drawn anew."""
    random = np.random.default_rng(seed)
    ends: dict[str, list[Ends]] = {name: [] for name in METHODS}
    for count in _batches(samples):
        ours, theirs = draw_pairs(pool, random, (count, size))
        while (harmless := ~theirs.any(axis=1)).any():
            ours[harmless], theirs[harmless] = draw_pairs(pool, random, (int(harmless.sum()), size))
        for name, method in METHODS.items():
            ends[name].append(method(ours, theirs, random))
    return [
        {"quantity": "damage left", "method": name, **misses(np.concatenate(found, axis=1), ratio(pool))}
        for name, found in ends.items()
    ]


def cover_means(pool: np.ndarray, size: int, samples: int, seed: Sequence[int]) -> list[dict[str, Any]]:
    """Return coverage of mean damage with the caregiver, and of the mean difference to that without."""
    random = np.random.default_rng(seed)
    truths = {"mean damage": pool[0].mean(), "difference": (pool[0] - pool[1]).mean()}
    ends: dict[str, list[Ends]] = {name: [] for name in truths}
    for count in _batches(samples):
        ours, theirs = draw_pairs(pool, random, (size, count))
        for found, estimate in zip(ends.values(), (of_mean(ours, least=0), of_difference(ours, theirs)), strict=True):
            found.append(estimate[1:])
    return [
        {"quantity": name, "method": IN_USE, **misses(np.concatenate(ends[name], axis=1), truth)}
        for name, truth in truths.items()
    ]


def _batches(samples: int) -> list[int]:
    """How many samples there are at once."""
    return [min(_SAMPLES_AT_ONCE, samples - first) for first in range(0, samples, _SAMPLES_AT_ONCE)]


def cover_houses(
    pools: Sequence[np.ndarray], houses: int, episodes: int, samples: int, seed: Sequence[int]
) -> list[dict[str, Any]]:
    """Return coverage over houses: so many of the pools are drawn, then so many episodes in each of them."""
    random = np.random.default_rng(seed)
    found: dict[str, list[Any]] = {name: [] for name in _OVER_HOUSES}
    for _ in range(samples):
        drawn = [draw_pairs(pools[i], random, (episodes,)) for i in random.integers(len(pools), size=houses)]
        for name, estimate in _OVER_HOUSES.items():
            found[name].append(estimate([ours for ours, _ in drawn], [theirs for _, theirs in drawn])[1:])
    ours, theirs = np.array([pool.mean(axis=1) for pool in pools]).T
    truths = ours.sum() / theirs.sum(), (ours / theirs).mean(), (ours - theirs).mean()
    return [
        {"quantity": name, **misses(np.transpose(ends), truth)}
        for (name, ends), truth in zip(found.items(), truths, strict=True)
    ]


# -- The figure --------------------------------------------------------------------------------------


def draw(episodes: pd.DataFrame) -> Figure:
    """Coverage of every cell by method and size, and below it on which side the intervals miss."""
    left = episodes[episodes.quantity == "damage left"]
    with mpl.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure((5.2, 5.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        sizes = left["size"].unique()
        for i, (method, colour) in enumerate(zip(METHODS, _COLOURS, strict=True)):
            shade = colours.unit(colour)
            places = np.arange(len(sizes)) + (i - (len(METHODS) - 1) / 2) * _WIDTH
            own = left[left.method == method].groupby("size")
            for place, (_, group) in zip(places, own, strict=True):
                spread = place + np.linspace(-0.35, 0.35, len(group)) * _WIDTH
                above.plot(spread, 100 * group.covered, "o", color=shade, markersize=3.4, markeredgewidth=0)
            below.bar(places, 100 * own.too_low.mean(), 0.85 * _WIDTH, color=shade, label=method)
            below.bar(places, -100 * own.too_high.mean(), 0.85 * _WIDTH, color=shade, alpha=0.45)
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
