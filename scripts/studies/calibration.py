"""Whether what `foresight` believes of a child comes true: predicted collisions against those that happened.

Children are left alone in houses of the grid that nobody has seen. Before each of their moves the belief says how
probable it is that the child bumps into each stairwell and table within the next 1, 5 and 15 timesteps.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.child_group import CHILDREN, NOVICE, ChildGroup, side_by_side
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.toddler import SHARE_OF_TIME_WALKING
from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.chain import first_passage
from caregiver_mj.danger.child_model import CHANGE, EPSILONS, child_chain
from caregiver_mj.experiments.intervals import Estimate, of_ratio
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import INK, MUTED, STYLE, explain, panels
from study import Page, Parser, interval, rest, run_all, side, streams

HORIZONS = (1, 5, 15)  # timesteps
LONGEST = HORIZONS[-1]
EACH = ("stairwell", "candle", "table")  # kinds of questions about one object
KINDS = {
    "stairwell": "a stairwell",
    "candle": "a table with a candle",
    "table": "a bare table",
    "any stairwell": "any stairwell",
    "any candle": "any table with a candle",
    "anything": "anything",
}
Kinds = tuple[str, ...]

HARMLESS, SAFE = "harmless", "P(safe)"  # what is asked of a stretch of timesteps, and the paper's number for it
# Ends of the bins of what is predicted. Most collisions are improbable, so the lower ones are narrow.
EDGES = np.array([0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
BINS = len(EDGES) - 1
FEWEST = 200  # predictions in a bin, below which it is not drawn
_SUMS = ["count", "predicted", "happened", "square"]

MODELLED = tuple(f"{epsilon:g}" for epsilon in reversed(EPSILONS))  # epsilons that the belief reckons with
BETWEEN = ("0.875", "0.625", "0.375", "0.15")
# Children that the page itself shows; the table beside it has all.
SHOWN = ("1", "0.5", "0.05", "seeker:0.25", "explorer:0.25", "toddler:0.25", "drifter:0.75")
TOGETHER = "novices"  # those of `MODELLED`, each as often
_SHARES = (0.75, 0.25)  # epsilons of other children
_WITHOUT = {"expert": "expert:0", "adversary": "adversary:0"}  # those that epsilon does nothing to
COMPANY = ("adversary", "seeker", "avoider")  # what they do depends on where a robot is


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["test-20"], "houses, or sets of them")
    parser.add("episodes", 100, "of each child in each")
    parser.add("seed", 0, "of the run to which they belong")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Watch the children; return the page."""
    jobs = [House(plan, options.episodes, options.seed) for plan in houses_named(options.houses)]
    rows = pd.concat(run_all(tally_house, jobs, options.jobs, "houses"), ignore_index=True)
    return page(rows, " ".join(options.houses), options.episodes)


# -- The children: novices, which the belief assumes, and all other behaviours ------------------------


def families() -> tuple[str, ...]:
    """All children, as `ChildGroup.parse` takes them: novices, the most random first, then every other behaviour."""
    novices = sorted((*MODELLED, *BETWEEN), key=float, reverse=True)
    others = [[_WITHOUT[name]] if name in _WITHOUT else [f"{name}:{share:g}" for share in _SHARES]
              for name in CHILDREN if name != NOVICE]  # fmt: skip
    return (*novices, *itertools.chain.from_iterable(others))


def has_company(family: str) -> bool:
    """Whether a child is watched beside a robot that stands still, and not alone."""
    return family.rpartition(":")[0] in COMPANY


def title(family: str) -> str:
    """What a child is called."""
    if family == TOGETHER:
        return "the five novices together"
    name, _, epsilon = family.rpartition(":")
    if name in _WITHOUT:
        return name
    return f"{name or NOVICE} {float(epsilon):g}"


class Bystander(Caregiver):
    """Stands where it stood at first, for children that look for it, or go round it."""

    yields = False

    def choose(self, percept: Percept) -> np.ndarray:
        return np.full(len(percept.child_cell), NOTHING)


# -- Watching them: what was predicted before every move, and what became of it ----------------------------------------


def questions_of(plan: FloorPlan) -> tuple[np.ndarray, np.ndarray]:
    """What is asked of a house's future: whether the child bumps into this or that; the candles stay where they are.

    Returns:
        What each question is about, (Q,): "stairwell", "candle" (a table that bears one) or "table" for one of them;
        "any stairwell", "any candle" or "anything". And which objects each takes together, bool (objects, Q).
    """
    stairwells = len(plan.stairwells)
    kinds = np.array(["stairwell"] * stairwells + ["table"] * len(plan.tables), object)
    kinds[stairwells + np.array(plan.candle_tables, int)] = "candle"
    any_of = np.stack([kinds == "stairwell", kinds == "candle", np.ones(len(kinds), bool)], axis=1)
    groups = np.concatenate([np.eye(len(kinds), dtype=bool), any_of], axis=1)
    return np.concatenate([kinds, ["any stairwell", "any candle", "anything"]]), groups


@dataclasses.dataclass(frozen=True, eq=False)
class Watched:
    """N children watched for T timesteps; time t is before move t, when moves 0 to t - 1 have been seen."""

    predicted: np.ndarray  # probability of a bump within each horizon, from each time on, (horizons, T, N, Q)
    possible: np.ndarray  # whether a bump is possible within each horizon, whatever the child does, (horizons, T, N, Q)
    bumped: np.ndarray  # whether each move bumped, (T, N, Q)
    safe: np.ndarray  # P(safe|tau) of the paper, (T, N)

    def happened(self, timesteps: int) -> np.ndarray:
        """Whether there was a bump within some timesteps, at every time from which so many were seen.

        Returns:
            bool (T - timesteps + 1, N, Q).
        """
        count = np.concatenate([np.zeros((1, *self.bumped.shape[1:]), int), self.bumped.cumsum(axis=0)])
        return count[timesteps:] > count[:-timesteps]


def watch_children(
    plan: FloorPlan,
    children: Sequence[ChildGroup],
    chance: Sequence[Sequence[RandomStream]],
    horizons: Sequence[int],
    caregiver: Caregiver | None = None,
    change: float = CHANGE,
) -> Watched:
    """Watch children of several kinds, as many episodes of each.

    Args:
        plan: The house.
        children: Only children.
        chance: That of every episode, the same for each of them.
        horizons: In how many timesteps something may happen.
        caregiver: Who is beside them.
        change: Probability, in a timestep, that an epsilon is thought to change.
    """
    world = GridWorld(plan, side_by_side(plan, children, len(chance)), caregiver)
    world.reset([*chance] * len(children))
    batch = len(chance) * len(children)
    chain, (kinds, groups) = child_chain(plan), questions_of(plan)
    passages = [first_passage(chain, horizon, groups).reshape(chain.shape[0], -1, len(kinds)) for horizon in horizons]
    belief, rule = Belief(chain, batch, 1, change), PaperCaregiver(plan)
    rule.reset(batch)
    shape = len(horizons), len(chance[0][0].steps), batch, len(kinds)
    predicted, possible, bumped = np.empty(shape, np.float32), np.empty(shape, bool), np.empty(shape[1:], bool)
    safe = np.empty(shape[1:3])
    for time in range(shape[1]):
        cell, safe[time] = world.child_cell[:, 0], rule.assess(world.percept()).safe[:, 0]
        probability = belief.probability.reshape(batch, 1, -1)
        for number, passage in enumerate(passages):
            predicted[number, time] = (probability @ passage[cell])[:, 0]
            possible[number, time] = np.any(passage > 0, axis=1)[cell]
        world.step()
        percept = world.percept()
        before, move = percept.previous_cell[:, 0], percept.previous_action[:, 0]
        into = np.where(move == NOTHING, NOTHING, chain.object_at[before, move])
        bumped[time] = (into[:, None] == np.arange(chain.objects)) @ groups
        belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell if caregiver else None)
        rule.watch(percept)
    return Watched(predicted, possible, bumped, safe)


# -- Predictions and what became of them, sorted by what was predicted: sums over the episodes of a house --------------


class House(NamedTuple):
    """A house to watch children in: so many episodes of each, of the run with a seed."""

    plan: FloorPlan
    episodes: int
    seed: int = 0


def tally_house(house: House) -> pd.DataFrame:
    """Watch all children in a house.

    Returns:
        A row for every child (`family`), horizon, kind of question and bin that occurs: how often (`count`), and the
        sums of what was `predicted`, of whether it `happened`, and of the `square` of the difference.
    """
    parts = []
    for company in (False, True):
        names = [name for name in families() if has_company(name) == company]
        children = [ChildGroup.parse(name) for name in names]
        beside = Bystander(house.plan) if company else None
        watched = watch_children(house.plan, children, streams(house.episodes, house.seed), HORIZONS, beside)
        parts.append(tally(watched, questions_of(house.plan)[0], names, house.episodes))
    return pd.concat(parts, ignore_index=True).assign(house=house.plan.name)


def tally(watched: Watched, kinds: np.ndarray, names: Sequence[str], episodes: int) -> pd.DataFrame:
    """Sort what was watched of children of some names, so many episodes of each, by what is asked for, (Q,)."""
    rows: list[dict[str, Any]] = []
    for number, horizon in enumerate(HORIZONS):
        happened = watched.happened(horizon)
        times = len(happened)
        predicted, possible = watched.predicted[number, :times], watched.possible[number, :times]
        for place, name in enumerate(names):
            some = slice(place * episodes, (place + 1) * episodes)
            for kind in dict.fromkeys(kinds):
                asked = kinds == kind
                which = possible[:, some, asked]  # what cannot happen is no prediction
                found = predicted[:, some, asked][which], happened[:, some, asked][which]
                rows += _rows(*found, family=name, horizon=horizon, kind=kind)
            (anything,) = np.flatnonzero(kinds == "anything")
            harmless = ~happened[:, some, anything].ravel()
            for kind, stated in ((HARMLESS, 1 - predicted[:, some, anything]), (SAFE, watched.safe[:times, some])):
                rows += _rows(stated.ravel(), harmless, family=name, horizon=horizon, kind=kind)
    return pd.DataFrame(rows)


def _rows(predicted: np.ndarray, happened: np.ndarray, **what: Any) -> Iterator[dict[str, Any]]:
    predicted = predicted.astype(float)
    number = np.clip(np.searchsorted(EDGES, predicted, side="right") - 1, 0, BINS - 1)
    values = np.ones(len(number)), predicted, happened.astype(float), (predicted - happened) ** 2
    sums = {name: np.bincount(number, value, BINS) for name, value in zip(_SUMS, values, strict=True)}
    for place in np.flatnonzero(sums["count"]).tolist():
        yield what | {"bin": place} | {name: float(value[place]) for name, value in sums.items()}


# -- How well predictions did. One counts the same wherever it was made; intervals resample houses ---------------------


def sums_of(rows: pd.DataFrame, family: str, horizon: int, kinds: Kinds = EACH) -> np.ndarray:
    """Return the sums of `tally` of one child's predictions of some kinds, (sums, houses, bins)."""
    members = MODELLED if family == TOGETHER else (family,)
    some = rows[rows.family.isin(members) & (rows.horizon == horizon) & rows.kind.isin(kinds)]
    places = pd.MultiIndex.from_product([rows.house.unique(), range(BINS)])
    sums = some.groupby(["house", "bin"])[_SUMS].sum().reindex(places, fill_value=0.0)
    return sums.to_numpy(float).T.reshape(len(_SUMS), -1, BINS)


class Scores(NamedTuple):
    """How well predictions did; all is NaN if there are none."""

    base_rate: float  # share of them that came true
    mean: float  # of what was predicted
    bias: Estimate[float]  # what was predicted over what happened: above 1 it was too much
    brier: float  # mean squared difference (Brier score)
    # 1 - the Brier score over that of somebody who always says the base rate: 1 at best, 0 no better than that.
    skill: Estimate[float]
    calibration_error: float  # mean distance of frequency and prediction, bin by bin (expected calibration error)

    @classmethod
    def of(cls, sums: np.ndarray) -> Scores:
        """Score predictions by their sums, (sums, houses, bins)."""
        whole, error = sums.sum(axis=(1, 2)), np.abs((sums[1] - sums[2]).sum(axis=0)).sum()
        _, mean, rate, brier = whole / whole[0] if whole[0] else np.full(len(whole), np.nan)
        number, predicted, happened, square = sums.sum(axis=2)
        by_rate = number * rate**2 + happened * (1 - 2 * rate)
        skill = rest(of_ratio(square, by_rate))
        return cls(rate, mean, of_ratio(predicted, happened), brier, skill, error / whole[0] if whole[0] else np.nan)


def reliability(sums: np.ndarray) -> tuple[np.ndarray, Estimate[np.ndarray]]:
    """Return of every bin the mean of what was predicted, and the frequency with which it happened, (bins,) each."""
    number, predicted, *_ = sums.sum(axis=1)
    mean = np.divide(predicted, number, out=np.full(BINS, np.nan), where=number > 0)
    return mean, of_ratio(sums[2], sums[0])


# -- The page ----------------------------------------------------------------------------------------


def page(rows: pd.DataFrame, names: str, episodes: int) -> Page:
    """The page of tallies of all houses, asked for by some names, with so many episodes of each child in each."""

    def scores(family: str, horizon: int, *kinds: str) -> Scores:
        return Scores.of(sums_of(rows, family, horizon, kinds or EACH))

    everybody = TOGETHER, *families()
    children = {horizon: {f: scores(f, horizon) for f in everybody} for horizon in reversed(HORIZONS)}
    values = {
        "change": CHANGE,
        "episodes": episodes,
        "houses": rows.house.nunique(),
        "names": names,
        "fewest": FEWEST,
        "longest": LONGEST,
        "walking": SHARE_OF_TIME_WALKING,
        "kinds": [
            (what, horizon, scores(TOGETHER, horizon, kind)) for kind, what in KINDS.items() for horizon in HORIZONS
        ],
        "children": children,
        "too_few": [title(family) for family, scores in children[LONGEST].items() if side(scores.bias, 1) < 0],
        "stretches": [(f, scores(f, LONGEST, HARMLESS), scores(f, LONGEST, SAFE)) for f in everybody],
        "title": title,
        "cells": score_cells,
        "shown": SHOWN,
    }
    within = {f"within {timesteps(horizon)}": (horizon, EACH) for horizon in HORIZONS}
    said = {"the belief": (LONGEST, (HARMLESS,)), "the paper's P(safe|tau)": (LONGEST, (SAFE,))}
    figures = {
        "calibration.png": draw(rows, within, "a collision", _LOWEST),
        "calibration_safe.png": draw(rows, said, f"{timesteps(LONGEST)} without harm"),
    }
    return Page(values, figures)


def score_cells(scores: Scores) -> str:
    """The figures of a line of a table; dashes where there are no predictions."""
    if np.isnan(scores.mean):
        return " | ".join("–" * 6)
    shares = f"{scores.base_rate:.2%} | {scores.mean:.2%} | {interval(scores.bias)}"
    return f"{shares} | {scores.brier:.4f} | {interval(scores.skill, 3)} | {scores.calibration_error:.2%}"


def timesteps(count: int) -> str:
    """So many timesteps, in words."""
    return f"{count} timestep" + "s" * (count != 1)


# -- The figures: a small reliability diagram for every child ----------------------------------------

_COLUMNS, _WIDTH, _HEIGHT = 4, 8.6, 1.95  # panels in a row; inches of the figure and of a row
_SHADES = (colours.CANDLE, colours.ROBOT, colours.BIN)
_LOWEST = 1e-4  # where the axes of collisions begin


def draw(rows: pd.DataFrame, lines: Mapping[str, tuple[int, Kinds]], what: str, lowest: float = 0.0) -> Figure:
    """Predicted probability of something against its frequency; with a logarithmic scale, if that begins above zero.

    Each line is of a horizon and of some kinds of questions, by its name.
    """
    with mpl.rc_context(STYLE):
        figure, grid = panels({family: title(family) for family in (TOGETHER, *families())}, _COLUMNS, _WIDTH, _HEIGHT)
        for family, axes in grid.items():
            if lowest:
                axes.set(xscale="log", yscale="log", xlim=(lowest, 1), ylim=(lowest, 1))
            axes.plot([lowest, 1], [lowest, 1], color=MUTED, linewidth=0.8, zorder=1)
            for asked, shade in zip(lines.values(), _SHADES, strict=False):
                _line(axes, sums_of(rows, family, *asked), shade, lowest)
            if not lowest:
                axes.set(xlim=(0, 1), ylim=(0, 1.02))
        keys = (Line2D([], [], color=colours.unit(shade), marker="o", markersize=4) for shade in _SHADES)
        explain(figure, dict(zip(lines, keys, strict=False)))
        figure.supxlabel(f"predicted probability of {what}", fontsize=9.5, color=INK)
        figure.supylabel("frequency with which it happened", fontsize=9.5, color=INK)
    return figure


def _line(axes: Axes, sums: np.ndarray, shade: colours.Colour, lowest: float) -> None:
    """What happened by what was predicted, in bins of which there is enough."""
    predicted, frequency = reliability(sums)
    drawn = sums[0].sum(axis=0) >= FEWEST
    if not drawn.any():
        return  # an empty line would stretch the layout
    x, value, low, high = (values[drawn] for values in (predicted, *frequency))
    colour = colours.unit(shade)
    # What never happened lies below a logarithmic scale, and is drawn at its edge.
    x, bounded = np.maximum(x, lowest), np.isfinite(high) & (low > 0)
    axes.vlines(x[bounded], np.maximum(low, lowest)[bounded], high[bounded], color=colour, linewidth=1.0, alpha=0.55)
    axes.plot(x, np.maximum(value, lowest), "o-", color=colour, markersize=2.8, linewidth=1.1, clip_on=False)
