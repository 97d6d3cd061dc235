"""A child that learns: alone, with a caregiver, and when the caregiver leaves.

The paper ends on a robot or a child that, better protected, can learn more. Here the novice is a tabular Q-learner in
the grid: toys are its reward, damage is its punishment. It grows up alone or with a caregiver, which leaves it in the
end. What it brings home, what it suffers, how much of the house it sees and what it knows of danger are followed from
episode to episode.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from caregiver_mj.caregivers.registry import CAREGIVERS, make_caregiver
from caregiver_mj.children.behaviour import Behaviour, ChildPercept
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.spec import episode_seed, episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import INK, STYLE
from study import Page, Parser, run_all

NONE = "none"
GUARDS = ("nearest", "paper", "foresight")
FIRST = 5  # episodes alone that are looked at by themselves
ENOUGH = 8  # houses for the page not to warn of their number
KINDS = ("careless", "wary")
MEASURES = ("damage", "toys", "return", "coverage", "known")
TOY = 1.0  # reward for reaching the bin that it goes to; damage counts as it is, negative
RATE = 0.5  # share of an error that is learnt from at once
DISCOUNT = 0.95  # a move
TEMPERATURE = 0.5  # of the random moves of a wary child, in units of reward
_ALIKE = 1e-9  # values that only rounding tells apart
_COUNTS = {
    "learners": (8, "children of each kind in each house with each caregiver"),
    "childhood": (30, "episodes with the caregiver"),
    "after": (15, "episodes alone after it has left"),
    "seed": (0, "seed of all chance"),
}

Houses = list[np.ndarray]  # of each house, (learners, columns)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", "test-8", metavar="SET")
    parser.add("caregivers", list(GUARDS), metavar="NAME")
    for name, (default, is_what) in _COUNTS.items():
        parser.add(name, default, is_what)
    parser.add("epsilon", 0.25, "share of random moves")
    parser.add_file("out", "keep the lives, or take those that are there", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run the lives; return the page."""
    if options.childhood < FIRST or options.after <= FIRST:
        raise CaregiverError(f"childhood has at least {FIRST} episodes, and at least {FIRST + 1} come after it")
    counts = {name: getattr(options, name) for name in (*_COUNTS, "epsilon")}
    work = jobs_of(options.houses, options.caregivers, counts)
    grown = Grown(work, run_all(live, work, options.jobs, "growing up", options.out))
    return page(grown, options.houses, options.epsilon)


# -- The child ---------------------------------------------------------------------------------------


class Learner(Behaviour):
    """B children that learn, each for itself, of the same house.

    A child knows its cell and its bin. A share epsilon of its moves is random; each other move is drawn among those of
    greatest value. A careless child draws random moves uniformly among all four. A wary child draws them in proportion
    to exp(value / `TEMPERATURE`), and so avoids known hazards.

    It learns from every move for all bins at once, because it knows the cell that it reached, the damage, and the
    places of the bins. Only the way to a bin that it reaches ends there.

    Attributes:
        values: Of every move on the way to every bin, (B, free cells, bins, 4); all 0 at first.
    """

    def __init__(self, plan: FloorPlan, epsilon: float, wary: np.ndarray):
        """Prepare children of a house that know nothing, of whom (B,) some are wary."""
        super().__init__(plan, epsilon)
        self._wary, self._each = np.asarray(wary, bool), np.arange(len(wary))
        _, target, index = plan.graph.moves
        bins = np.arange(len(plan.bins))
        self._reaches = (target == Target.BIN)[..., None] & (index[..., None] == bins)  # (cells, 4, bins)
        self.values = np.zeros((len(wary), len(plan.free_cells), len(plan.bins), len(ACTIONS)))

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        values = self.values[self._each, sight.cell, sight.goal]
        best = values.max(axis=1, keepdims=True)
        at_random = np.where(self._wary[:, None], np.exp((values - best) / TEMPERATURE), 1.0)
        weight = np.where(draws[:, :1] < self.epsilon, at_random, values >= best - _ALIKE).cumsum(axis=1)
        return (draws[:, 1:2] * weight[:, -1:] >= weight).sum(axis=1)

    def learn(self, cell: np.ndarray, action: np.ndarray, damage: np.ndarray, next_cell: np.ndarray) -> None:
        """Learns from the last moves, (B,) each.

        Q(s, g, a) += `RATE` (r + `DISCOUNT` max_b Q(s', g, b) - Q(s, g, a)) for every bin g, without what is to come
        where the move has reached it.
        """
        reached = self._reaches[cell, action]  # (B, bins)
        to_come = self.values[self._each, next_cell].max(axis=2)
        aim = np.where(reached, TOY, DISCOUNT * to_come) - damage[:, None]
        known = self.values[self._each, cell, :, action]
        self.values[self._each, cell, :, action] = known + RATE * (aim - known)

    def believed_harmful(self) -> np.ndarray:
        """Which moves the children believe to do harm, bool (B, free cells, 4): of value below 0, the mean over bins.

        A move that has never hurt is worth 0 or more, and one that has just hurt by 1 or more less than that.
        """
        return self.values.mean(axis=2) < 0


# -- Its life: some episodes with a caregiver, then some alone ---------------------------------------


class Job(NamedTuple):
    """All children that grow up in one house with one caregiver."""

    house: str  # its name
    caregiver: str  # its name
    learners: int  # children of each kind
    childhood: int  # episodes with the caregiver
    after: int  # episodes alone after these
    seed: int  # of all chance
    epsilon: float  # share of random moves


def live(job: Job) -> dict[str, Any]:
    """Run the lives of a job; those with another caregiver, and of another kind, have the same chance.

    Returns:
        `course`: each of `MEASURES` in every episode, (measures, episodes, kinds, learners). Coverage is the share of
        free cells that are visited until the damage is above 15; known is the share of the moves into stairwells and
        into tables with candles that are believed to do harm, after the episode; None where there are no such moves.
    """
    plan = FloorPlan.load(job.house)
    learner = Learner(plan, job.epsilon, np.repeat([False, True], job.learners))
    guarded = GridWorld(plan, ChildGroup((learner,)), make_caregiver(job.caregiver, plan, job.seed))
    alone = GridWorld(plan, ChildGroup((learner,)), None)
    _, target, index = plan.graph.moves
    # Which moves lead into a stairwell, or into a table on which a candle stands at first, (free cells, 4).
    dangerous = (target == Target.STAIRWELL) | ((target == Target.TABLE) & np.isin(index, plan.candle_tables))
    length = job.childhood + job.after
    course = np.empty((len(MEASURES), length, len(KINDS), job.learners))
    for age in range(length):
        world = guarded if age < job.childhood else alone
        lesson = Lesson(world, learner)
        world.observers = [lesson]
        totals = world.run(_streams(job, age)).totals()
        lesson.over()
        toys, damage = totals["toys_reached"], totals["damage"]
        coverage = totals["cells_visited"] / len(plan.free_cells)
        known = learner.believed_harmful()[:, dangerous].mean(axis=1) if dangerous.any() else np.full(len(toys), np.nan)
        values = np.stack([damage, toys, TOY * toys - damage, coverage, known])
        course[:, age] = values.reshape(len(MEASURES), len(KINDS), job.learners)
    measured = course.astype(object)
    measured[np.isnan(course)] = None  # JSON has no NaN
    return {"course": measured.tolist()}


class Lesson:
    """Has a learner learn from every move of an episode, and once more from all of them in the end, the last one first.

    It is called after each timestep of a world with one child.
    """

    def __init__(self, world: GridWorld, learner: Learner):
        self._world, self._learner = world, learner
        self._damage = np.zeros(())
        self._moves: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []

    def __call__(self, _: GridWorld) -> None:
        """Learns from the last move."""
        world, damage = self._world, self._world.ledger.damage
        move = world.previous_cell[:, 0], world.previous_action[:, 0], damage - self._damage, world.child_cell[:, 0]
        self._moves.append(move)
        self._learner.learn(*move)
        self._damage = damage

    def over(self) -> None:
        """Goes over the whole episode, from its end."""
        for move in reversed(self._moves):
            self._learner.learn(*move)


def _streams(job: Job, number: int) -> Sequence[Sequence[RandomStream]]:
    """The chance of every child in an episode of a number, the same for both kinds."""
    seeds = [episode_seed(job.seed, 1000 * number + learner) for learner in range(job.learners)]
    return [episode_streams(seed, 1) for seed in seeds] * len(KINDS)


def jobs_of(houses: str, guards: Sequence[str], options: Mapping[str, Any]) -> list[Job]:
    """All jobs of a set, house by house, and of caregivers, with what else a `Job` is made of.

    Raises:
        CaregiverError: There is no such set or caregiver.
    """
    for name in guards:
        CAREGIVERS[name]
        if name == NONE:
            raise CaregiverError("children alone are there in any case: leave 'none' out")
    plans = [plan for plan in house_set(houses) if len(plan.hazards)]
    return [Job(plan.name, name, **options) for plan in plans for name in (NONE, *guards)]


class Grown:
    """The children that have grown up, by caregiver.

    Attributes:
        job: One of them, for what all of them have in common.
        names: Names of the caregivers, `none` first.
        houses: How many there are.
    """

    def __init__(self, jobs: Sequence[Job], lives: Sequence[dict[str, Any]]):
        """Sort them, a job and its lives each."""
        self.job, self.names = jobs[0], tuple(dict.fromkeys(job.caregiver for job in jobs))
        self.houses = len(jobs) // len(self.names)
        self._lives = {
            name: [found for job, found in zip(jobs, lives, strict=True) if job.caregiver == name]
            for name in self.names
        }

    def course(self, caregiver: str, measure: str, kind: str) -> Houses:
        """A measure in every episode of every child of a kind, (learners, episodes) for each house."""
        which = MEASURES.index(measure), slice(None), KINDS.index(kind)
        return [np.array(found["course"], float)[which].T for found in self._lives[caregiver]]

    def mean(self, caregiver: str, measure: str, kind: str, first: int, end: int) -> Houses:
        """The mean over episodes [first, end), (learners,) for each house."""
        return [one[:, first:end].mean(axis=1) for one in self.course(caregiver, measure, kind)]


# -- The page and its figure -------------------------------------------------------------------------


def page(grown: Grown, houses: str, epsilon: float) -> Page:
    """The page of children that have grown up in a set of houses, with a share of random moves."""
    rows = [_row(grown, kind, name) for kind in KINDS for name in grown.names]
    values = {
        "grown": grown,
        "job": grown.job,
        "houses": houses,
        "epsilon": epsilon,
        "first": FIRST,
        "enough": ENOUGH,
        "rate": RATE,
        "discount": DISCOUNT,
        "temperature": TEMPERATURE,
        "rows": rows,
        "said": {name: [row for row in rows if row["name"] == name] for name in grown.names[1:]},
    }
    return Page(values, {"learning_child.png": draw(grown)})


def _row(grown: Grown, kind: str, name: str) -> dict[str, Any]:
    """What becomes of the children of a kind with a caregiver, and how that is beside those that never had one."""
    start = grown.job.childhood
    end = start + grown.job.after
    before, soon, later, life = (start - 1, start), (start, start + FIRST), (start + FIRST, end), (0, end)

    def less(measure: str, first: int, last: int, times: int = 1) -> Estimate[float]:
        ours, theirs = ([times * one for one in grown.mean(who, measure, kind, first, last)] for who in (name, NONE))
        return two_level.of_difference(ours, theirs)

    damage = grown.mean(name, "damage", kind, *soon)
    protected, unprotected = (grown.mean(who, "damage", kind, 0, start) for who in (name, NONE))
    alone = name == NONE
    return {
        "kind": kind,
        "name": name,
        # Of the first and last episodes of childhood.
        "means": [
            [_mean(grown.mean(name, measure, kind, *span)) for span in ((0, FIRST), (start - FIRST, start))]
            for measure in ("damage", "toys", "coverage")
        ],
        "whole": start * _mean(protected),
        "known": _mean(grown.mean(name, "known", kind, *before)),
        "damage": _mean(damage),
        "spread": np.mean([one.std(ddof=1) for one in damage]),
        "life": end * _mean(grown.mean(name, "damage", kind, *life)),
        "spared": two_level.of_ratio(protected, unprotected),
        "less_known": None if alone else less("known", *before),
        "less_soon": None if alone else less("damage", *soon),
        "less_later": None if alone else less("damage", *later),
        "less_toys": None if alone else less("toys", *soon),
        "less_life": None if alone else less("damage", *life, times=end),
    }


def _mean(houses: Houses) -> float:
    """The mean over houses."""
    return float(np.nanmean([np.mean(one) for one in houses]))


_PANELS = {
    "damage": "damage an episode",
    "return": "return: toys less damage",
    "coverage": "cells seen before the stop",
    "known": "dangerous moves shunned",
}
_COLOURS = (colours.HARM, colours.ROBOT, colours.CANDLE, colours.BIN, colours.STAIRWELL)


def draw(grown: Grown) -> Figure:
    """Each measure over age, a row for each kind of child: means, and the middle half of the children of a house."""
    with mpl.rc_context(STYLE):
        figure = Figure((3.1 * len(_PANELS), 5.6), layout="constrained")
        grid = figure.subplots(len(KINDS), len(_PANELS), sharex=True, sharey="col")
        for row, kind in zip(grid, KINDS, strict=True):
            for axes, (measure, title) in zip(row, _PANELS.items(), strict=True):
                _panel(axes, grown, measure, kind)
                axes.set_title(title if kind == KINDS[0] else "", fontsize=10)
            row[0].set_ylabel(f"{kind} children")
        for axes, measure in zip(grid[-1], _PANELS, strict=True):
            axes.set_xlabel("episodes lived")
            if measure != "return":
                axes.set_ylim(bottom=0)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=9)
    return figure


def _panel(axes: Axes, grown: Grown, measure: str, kind: str) -> None:
    for name, colour in zip(grown.names, _COLOURS, strict=False):
        houses = [one for one in grown.course(name, measure, kind) if not np.isnan(one).any()]
        value = np.mean([one.mean(axis=0) for one in houses], axis=0)
        low, high = np.mean([np.quantile(one, (0.25, 0.75), axis=0) for one in houses], axis=0)
        age, shade = np.arange(1, len(value) + 1), colours.unit(colour)
        label = "alone from the first" if name == NONE else f"with {name}"
        axes.fill_between(age, low, high, color=shade, alpha=0.15, linewidth=0)
        axes.plot(age, value, color=shade, linewidth=1.4, label=label)
    axes.axvline(grown.job.childhood + 0.5, color=INK, linewidth=0.9, linestyle="--")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
