"""How the results depend on what the paper leaves open, or what others would have chosen otherwise.

What a collision costs, the reading of P(reach), when an interaction ends, how fast the caregiver is, and whether it
makes room for the child: in the grid on two plans and over a set of generated ones, where the house is the unit of
chance, and speed and yielding in the physical house too. And where the rule is no more than "protect from what is
nearest". The page derives that.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import bare_tables
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.errors import FloorPlanError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate, of_difference, of_ratio
from caregiver_mj.experiments.settings import EPSILONS, episode_random, episode_seed
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.plans.sets import house_set
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import load
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE
from caregiver_mj.viz.report.published import PUBLISHED
from studies.ablations import where
from study import Page, Parser, interval, listed, run_all, run_in_grid, side

COLLISIONS = ["stairwell", "candle", "table"]  # of the paper's kinds, which come first
WEIGHTS = ("1:1:1", "5:4:1", "20:4:1")  # of a fall down stairs, a bump into a candle's table and one into a bare table
OWN_WEIGHTS = str(DamageWeights())  # the paper's
ACTIONS = (1, 2, 3, 4)  # of the caregiver in a novice timestep
HOUSE = "paper"  # the physical one
ALONE, OWN = "none", "paper"

Estimator = Callable[[Any, Any], Estimate[Any]]


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("place", ["paper", "apartment", "train-20"], "houses, or sets of them")
    parser.add("episodes", 1000, "in the grid of one house")
    parser.add("set-episodes", 100, "in each of a set")
    parser.add("house-episodes", 20, "in the physical house; 0 for none")
    parser.add_file("out", "keep those there, and go on with what is there", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run all episodes; return the page."""
    places = [Place.of(name, options.episodes, options.set_episodes) for name in options.place]
    results = measure(places, options.jobs)
    work = [HouseJob(robot, epsilon, options.house_episodes) for epsilon in EPSILONS for robot in ROBOTS]
    found = run_all(run_in_house, work, options.jobs, "in the house", options.out) if options.house_episodes else []
    return page(results, pd.DataFrame([row for rows in found for row in rows]))


# -- What is varied in the grid, and where -----------------------------------------------------------


class Condition(NamedTuple):
    """A caregiver, and what it goes by."""

    caregiver: str  # its name
    weights: str = OWN_WEIGHTS  # what it takes a collision to cost
    actions: int = CAREGIVER_ACTIONS  # how many actions it has in a novice timestep
    reach: str = "inverse"  # its reading of P(reach), if it is `paper`


NONE, NEAREST, PAPER, STILL = map(Condition, ("none", "nearest", "paper", "paper-still"))
LINEAR = Condition("paper", reach="linear")
WEIGHTED = {weights: Condition("paper", weights=weights) for weights in WEIGHTS}
SPEEDS = {actions: Condition("paper", actions=actions) for actions in ACTIONS}
# Each once. What `none` and `nearest` do does not depend on what a collision costs.
CONDITIONS = tuple(dict.fromkeys((NONE, NEAREST, PAPER, STILL, LINEAR, *WEIGHTED.values(), *SPEEDS.values())))


def costs(weights: str) -> np.ndarray:
    """Damage of a collision of each kind, in the order of `COLLISIONS`, (kinds,)."""
    damage = DamageWeights.of(weights)
    return np.array([damage[kind] for kind in COLLISIONS])


class Place(NamedTuple):
    """A house, or several."""

    name: str  # its name
    houses: tuple[str, ...]  # the names of its houses
    episodes: int  # episodes in each of them

    @classmethod
    def of(cls, name: str, episodes: int, episodes_in_sets: int) -> Place:
        """Return the place of a floor plan, or of a set of houses such as `train-20`, with its number of episodes."""
        try:
            return cls(name, tuple(plan.name for plan in house_set(name)), episodes_in_sets)
        except FloorPlanError:
            FloorPlan.load(name)
            return cls(name, (name,), episodes)

    def __str__(self) -> str:
        """What it is called in tables."""
        return f"`{self.name}`"


# -- The grid's episodes -----------------------------------------------------------------------------


class Job(NamedTuple):
    """All episodes of one condition and epsilon in one house."""

    house: str
    epsilon: float
    condition: Condition
    episodes: int


def measure(places: Sequence[Place], jobs: int) -> Results:
    """Run everything in the grid."""
    work = [
        Job(house, epsilon, condition, place.episodes)
        for place in places
        for house in place.houses
        for condition in CONDITIONS
        for epsilon in EPSILONS
    ]
    found = run_all(run_job, work, jobs, "in the grid")
    return Results(tuple(places), {job[:3]: one for job, one in zip(work, found, strict=True)})


def run_job(job: Job) -> pd.DataFrame:
    """Run the episodes of a job: those that `evaluate` runs with seed 0, the same novices under every condition.

    Returns:
        A row an episode: collisions of each kind, by its name; `toys` reached; `above` and `at`, the timestep in which
        the damage, as the caregiver takes it, came above 15, or to 15, 200 if never; whether these are `apart`; and
        `differs`, the share of the timesteps at whose end `nearest` would set about something else, 0 but for `paper`.
    """
    _, weights, actions, reach = condition = job.condition
    plan = _load(job.house, weights)
    is_paper = condition.caregiver == OWN
    caregiver = PaperCaregiver(plan, reach=reach) if is_paper else make_caregiver(where(condition.caregiver), plan)
    nearest, damage, differs = NearestCaregiver(plan), [], np.zeros(job.episodes)

    def look(world: GridWorld) -> None:
        damage.append(world.ledger.damage)
        if condition == PAPER:
            percept = world.percept()
            other = caregiver.choose(percept) != nearest.choose(percept)  # type: ignore[union-attr]  # it is one
            differs[:] += other & (percept.holding == NOTHING)

    make = functools.partial(GridWorld, caregiver=caregiver, caregiver_actions=actions)
    ledger = run_in_grid(make, plan, [job.epsilon], job.episodes, look=look).ledger
    courses = np.array(damage)
    collisions = np.rint(ledger.harm.sum(axis=1)[:, : len(COLLISIONS)] / costs(weights)).astype(int)
    above, at = first(courses > DAMAGE_THRESHOLD), first(courses >= DAMAGE_THRESHOLD)
    return pd.DataFrame(collisions, columns=COLLISIONS).assign(
        toys=ledger.totals()["toys_reached"], above=above, at=at, apart=above != at, differs=differs / EPISODE_TIMESTEPS
    )


def first(reached: np.ndarray) -> np.ndarray:
    """The first timestep, counted from 1, in which something is so: (timesteps, episodes) to (episodes,); else all."""
    return np.where(reached.any(axis=0), reached.argmax(axis=0) + 1, len(reached))


@functools.lru_cache(maxsize=4)  # jobs in one house follow each other, and plans keep what they have worked out
def _load(house: str, weights: str) -> FloorPlan:
    return FloorPlan.load(house, damage=DamageWeights.of(weights))


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured in the grid. Lists have a member for each of `EPSILONS`.

    What is asked for is a column of the rows, or the damage by the name of some weights.
    """

    places: tuple[Place, ...]  # where
    rows: Mapping[tuple[Any, ...], pd.DataFrame]  # by house, epsilon and condition

    def of(self, house: str, epsilon: float, condition: Condition, what: str = OWN_WEIGHTS) -> np.ndarray:
        """What was measured in every episode, (episodes,)."""
        rows = self.rows[house, epsilon, condition]
        return rows[COLLISIONS].to_numpy() @ costs(what) if what in WEIGHTS else rows[what].to_numpy()

    def left(self, place: Place, condition: Condition, weights: str = OWN_WEIGHTS) -> list[Estimate[float]]:
        """Share of the unassisted damage that is left; over several houses, of the mean over them."""
        return self._compare(of_ratio, two_level.of_ratio, place, condition, NONE, weights)

    def difference(
        self, place: Place, ours: Condition, theirs: Condition, what: str = OWN_WEIGHTS
    ) -> list[Estimate[float]]:
        """What is measured under one condition less that under another, of means over houses."""
        return self._compare(of_difference, two_level.of_difference, place, ours, theirs, what)

    def means(self, place: Place, condition: Condition, what: str) -> list[float]:
        """Means over houses."""
        return [float(np.mean([self.of(h, e, condition, what).mean() for h in place.houses])) for e in EPSILONS]

    def collisions(self, place: Place, condition: Condition) -> np.ndarray:
        """Mean collisions of each kind an episode, over houses and epsilons, (kinds,)."""
        return np.array([np.mean(self.means(place, condition, kind)) for kind in COLLISIONS])

    def mean_difference(self, house: str, ours: Condition, theirs: Condition) -> Estimate[float]:
        """Damage an episode under one condition less that under another, in one house, averaged over the epsilons."""
        return of_difference(*(np.mean([self.of(house, e, one) for e in EPSILONS], axis=0) for one in (ours, theirs)))

    def _compare(
        self, in_one: Estimator, in_several: Estimator, place: Place, ours: Condition, theirs: Condition, what: str
    ) -> list[Estimate[float]]:
        """Hold one condition against another, with what is for episodes of one house, or of several."""
        pairs = ([[self.of(house, e, one, what) for house in place.houses] for one in (ours, theirs)] for e in EPSILONS)
        return [in_several(*p) if len(place.houses) > 1 else in_one(*(one for (one,) in p)) for p in pairs]


# -- The physical house: speed and yielding ----------------------------------------------------------


# A caregiver in the house, and the share of its base's highest speed that it may use.
ROBOTS: Mapping[str, tuple[str, float] | None] = {
    ALONE: None,
    OWN: (OWN, 1.0),
    "paper-still": ("paper-still", 1.0),
    "paper at 75 % of its speed": (OWN, 0.75),
    "paper at 50 % of its speed": (OWN, 0.5),
}


def slowed(robot: Embodiment, share: float) -> Embodiment:
    """The same robot with a slower base; it accelerates and turns as before."""
    limits = robot.limits
    base = dataclasses.replace(limits.base, velocity=share * limits.base.velocity)
    limits = dataclasses.replace(limits, base=base, base_speed=share * limits.base_speed)
    return dataclasses.replace(robot, name=f"{robot.name}-{share:g}", limits=limits)


class HouseJob(NamedTuple):
    """All episodes of one of `ROBOTS` with a novice."""

    robot: str
    epsilon: float
    episodes: int


def run_in_house(job: HouseJob) -> list[dict[str, Any]]:
    """Run the episodes of a job, those that `evaluate` runs with seed 0: a row each."""
    robot = ROBOTS[job.robot]
    kwargs = {"robot": True, "embodiment": slowed(find_embodiment(), robot[1])} if robot else {"robot": False}
    env = load("supervise", FloorPlan.load(HOUSE), job.epsilon, np.random.RandomState(0), task_kwargs=kwargs)
    policy = CaregiverPolicy(env, where(robot[0])) if robot else None
    rows = []
    for episode in range(job.episodes):
        env.task.reseed(episode_random(episode_seed(0, episode)))
        timestep = env.reset()
        while not timestep.last():
            timestep = env.step(policy(timestep) if policy else np.zeros(env.action_spec().shape))
        rows.append({"robot": job.robot, "epsilon": job.epsilon, "episode": episode} | env.task.outcome())
    return rows


def in_house(episodes: pd.DataFrame, compare: Estimator, robot: str, other: str, column: str) -> list[Estimate[float]]:
    """Hold what is measured with one of `ROBOTS` against that with another, at each epsilon."""
    by = episodes.sort_values("episode").groupby(["epsilon", "robot"])[column]
    epsilons = episodes.epsilon.unique()
    return [compare(*(by.get_group((e, one)).to_numpy(float) for one in (robot, other))) for e in epsilons]


# -- Where the rule is no more than `nearest` --------------------------------------------------------


def apart(stairwell: np.ndarray, candle: np.ndarray, stairwell_damage: float, candle_damage: float) -> np.ndarray:
    """Whether the rule and `nearest` protect from different hazards.

    Args:
        stairwell: Moves to the nearest stairwell, of any shape; infinite where there is none.
        candle: Moves to the nearest candle that is worth moving, likewise.
        stairwell_damage: D_s.
        candle_damage: D_c.
    """
    by_nearness = stairwell <= candle
    by_danger = candle_damage * stairwell <= stairwell_damage * candle
    either = np.isfinite(stairwell) & np.isfinite(candle)  # else there is nothing to choose between
    return either & (by_nearness != by_danger)


def cells_apart(plan: FloorPlan, candle_table: np.ndarray | None = None) -> np.ndarray:
    """In which cells a child has the two protect from different hazards, bool (free cells,).

    Args:
        plan: The house, with what a collision costs.
        candle_table: Index of the table on which each candle stands; as in the floor plan if None.
    """
    tables = np.array(plan.candle_tables if candle_table is None else candle_table, int)
    distances = plan.graph.table_distances.astype(float)
    stairwell = plan.graph.stairwell_distances.astype(float).min(axis=1, initial=np.inf)
    farthest = np.where(bare_tables(tables[None], len(plan.tables)), distances, 0.0).max(axis=1, initial=0.0)
    candles = distances[:, tables]
    candle = np.where(candles < farthest[:, None], candles, np.inf).min(axis=1, initial=np.inf)
    return apart(stairwell, candle, plan.damage["stairwell"], plan.damage["candle"])


def first_apart(stairwell_damage: float, candle_damage: float, farthest: int) -> list[tuple[int, int]]:
    """The distances (candle, stairwell) up to some at which the two are apart, the nearest first."""
    candle, stairwell = np.mgrid[1 : farthest + 1, 1 : farthest + 1]
    found = apart(stairwell, candle, stairwell_damage, candle_damage)
    return [(int(c), int(s)) for c, s in zip(candle[found], stairwell[found], strict=True)]


def share_apart(house: str, weights: str) -> float:
    """Share of a child's cells in which the two protect from different hazards, with the candles where they begin."""
    plan = dataclasses.replace(FloorPlan.load(house), damage=DamageWeights.of(weights))
    return float(cells_apart(plan).mean())


def plans_apart(results: Results) -> list[Place]:
    """The houses, each as a place, in which the two ever differ: at the start, or in an episode."""
    houses = [Place(house, (house,), place.episodes) for place in results.places for house in place.houses]
    return [one for one in houses if share_apart(one.name, OWN_WEIGHTS) or any(results.means(one, PAPER, "differs"))]


# -- The page ----------------------------------------------------------------------------------------


def page(results: Results, episodes: pd.DataFrame) -> Page:
    """The page of the grid's results and the house's episodes, of which there may be none."""
    where, readings, endings = [], [], []
    for place in results.places:
        several = f"{len(place.houses)} houses with {place.episodes:,} episodes each in {place}"
        where.append(several if len(place.houses) > 1 else f"{place.episodes:,} episodes on {place}")
        linear, inverse = (np.mean([one.value for one in results.left(place, c)]) for c in (LINEAR, PAPER))
        readings.append(f"{linear / inverse:.2f} times on {place}")
        alone, ours = (f"{np.mean(results.means(place, one, 'apart')):.0%}" for one in (NONE, PAPER))
        endings.append(f"{alone} unassisted and {ours} assisted episodes on {place}")
    robots = []
    for robot in ROBOTS if len(episodes) else ():
        if robot == ALONE:
            continue
        caregiver, *rest = robot.split(" ", 1)
        less = [
            in_house(episodes, of_difference, robot, OWN, column) if robot != OWN else None
            for column in ("damage", "toys_reached")
        ]
        left = in_house(episodes, of_ratio, robot, ALONE, "damage")
        robots.append((" ".join([f"`{caregiver}`", *rest]), left, *less))
    values = {
        "results": results,
        "where": where,
        "readings": readings,
        "endings": endings,
        "robots": robots,
        "episodes": episodes,
        "each": episodes.episode.nunique() if robots else 0,
        "houses": sum(len(place.houses) for place in results.places),
        "apart": [(one, results.mean_difference(one.name, PAPER, NEAREST)) for one in plans_apart(results)],
        "cells": cells,
        "verdict_at": verdict_at,
        "share_apart": share_apart,
        "first_apart": first_apart,
        "published": PUBLISHED["timesteps_to_threshold"],
        "epsilons": EPSILONS,
        "weighted": WEIGHTED,
        "speeds": SPEEDS,
        "house": HOUSE,
        "alone": NONE,
        "nearest": NEAREST,
        "paper": PAPER,
        "still": STILL,
        "linear": LINEAR,
    }
    return Page(values, {"sensitivity.svg": draw(results)})


def cells(estimates: Sequence[Estimate[float]], sign: str = "") -> str:
    """Some estimates as cells of a table, each with its interval."""
    return " | ".join(interval(estimate, sign=sign, exact=True) for estimate in estimates)


def verdict_at(differences: Sequence[Estimate[float]]) -> str:
    """At which epsilons a difference is above or below zero with its whole interval, in words."""
    if all(one.value == one.low == one.high == 0 for one in differences):
        return "the same in every episode"
    parts = []
    for what, which in (("more", 1), ("less", -1)):
        found = [f"{e:g}" for e, one in zip(EPSILONS, differences, strict=True) if side(one) == which]
        if found:
            parts.append(f"{what} at epsilon {listed(found)}")
    if not all(map(side, differences)):
        parts.append(f"no difference seen at {'the others' if parts else 'any epsilon'}")
    return ", ".join(parts)


# -- The figure --------------------------------------------------------------------------------------

_COLOURS = (colours.ROBOT, colours.BIN, colours.CANDLE, colours.STAIRWELL)
_TOP = 1.2  # share left at which an axis ends; there is room for the legend above what is measured
_SPREAD = 0.6  # of the room between two epsilons


def draw(results: Results) -> Figure:
    """Damage left, a row of panels for each place, a column for each of four things that are varied."""
    rows = [_series(results, place) for place in results.places]
    with mpl.rc_context(STYLE):
        figure = Figure((3.0 * len(rows[0]), 2.4 * len(rows)), layout="constrained")
        grid = figure.subplots(len(rows), len(rows[0]), sharex=True, sharey=True, squeeze=False)
        for line, place, found in zip(grid, results.places, rows, strict=True):
            for axes, series in zip(line, found.values(), strict=True):
                offsets = np.linspace(-0.5, 0.5, len(series)) * _SPREAD * (len(series) - 1) / len(series)
                for (name, estimates), shade, offset in zip(series.items(), _COLOURS, offsets, strict=False):
                    value, low, high = np.array(estimates).T
                    at, colour = np.arange(len(estimates)) + offset, colours.unit(shade)
                    axes.vlines(at, low, high, color=colour, linewidth=1.8)
                    edge = {"markeredgecolor": INK, "markeredgewidth": 0.5, "markersize": 4.5}
                    axes.plot(at, value, "o", color=colour, label=name, **edge)
            line[0].set(ylim=(0.0, _TOP), ylabel=f"{place.name}: damage left")
        for axes, title in zip(grid[0], rows[0], strict=True):
            axes.set_title(title, fontsize=10)
            axes.legend(fontsize=7.5, loc="upper left", ncols=2, handlelength=1.0, labelspacing=0.2)
        for axes in grid[-1]:
            axes.set_xticks(range(len(EPSILONS)), [f"{epsilon:g}" for epsilon in EPSILONS])
            axes.set_xlabel("epsilon")
    return figure


def _series(results: Results, place: Place) -> dict[str, dict[str, list[Estimate[float]]]]:
    """What there is to compare, by the panel's title."""
    weights = {name: results.left(place, condition, name) for name, condition in WEIGHTED.items()}
    dearest = list(WEIGHTED)[-1]
    weights[f"{dearest}, nearest"] = results.left(place, NEAREST, dearest)
    return {
        "damage of stairs : candle : table": weights,
        "reading of P(reach)": {"inverse": results.left(place, PAPER), "linear": results.left(place, LINEAR)},
        "caregiver's actions a timestep": {str(n): results.left(place, one) for n, one in SPEEDS.items()},
        "making room for the child": {"yields": results.left(place, PAPER), "still": results.left(place, STILL)},
    }
