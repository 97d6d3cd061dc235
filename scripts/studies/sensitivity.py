"""How the results depend on what the paper leaves open, or what others would have chosen otherwise.

What a collision costs, the reading of P(reach), when an interaction ends, how fast the caregiver is, and whether it
makes room for the child: in the grid on two plans and over a set of generated ones, where the house is the unit of
chance, and speed and yielding in the physical house too. And where the rule is no more than "protect from what is
nearest".

With one child the expected danger of hazard o, at d_o moves and of damage D_o, is

    E(o) = (1 - P(safe)) P(reach_o) D_o    and    P(reach_o) = (1 / d_o) / sum of 1 / d over all hazards.

1 - P(safe) and the sum are the same for all hazards, so the rule protects from the one of greatest D_o / d_o, and
`nearest` from the one of greatest 1 / d_o. Among hazards of one kind that is the same one. So all depends on the
nearest stairwell, at s moves, and the nearest candle that is worth moving, at c. What is equal goes to the stairwell,
which comes first in the table of hazards: `nearest` takes it if s <= c, the rule if D_c s <= D_s c.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.caregiver import Caregiver
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
from caregiver_mj.plans.hazards import CANDLE, NOTHING, STAIRWELL, TABLE, DamageWeights
from caregiver_mj.plans.sets import house_set
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import load
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, STYLE
from caregiver_mj.viz.report.published import PUBLISHED
from study import Page, Parser, interval, listed, run_all, run_in_grid, side

COLLISIONS = [kind.name for kind in (STAIRWELL, CANDLE, TABLE)]  # the first kinds of all, and the paper's
WEIGHTS = ("1:1:1", "5:4:1", "20:4:1")  # of a fall down stairs, a bump into a candle's table and one into a bare table
OWN_WEIGHTS = str(DamageWeights())  # the paper's
ACTIONS = (1, 2, 3, 4)  # of the caregiver in a novice timestep
HOUSE = "paper"  # the physical one
ALONE, OWN = "none", "paper"


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
    episodes = pd.DataFrame()
    if options.house_episodes:
        episodes = measure_house(options.house_episodes, options.jobs, options.out)
    return page(results, episodes)


# -- What is varied in the grid, and where -----------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Condition:
    """A caregiver, and what it goes by."""

    caregiver: str  # its name
    weights: str = OWN_WEIGHTS  # what it takes a collision to cost
    actions: int = CAREGIVER_ACTIONS  # how many actions it has in a novice timestep
    reach: str = "inverse"  # its reading of P(reach), if it is `paper`

    def make(self, plan: FloorPlan) -> Caregiver | None:
        """Make the caregiver for a house."""
        if self.caregiver == "paper":
            return PaperCaregiver(plan, reach=self.reach)
        return make_caregiver(self.caregiver, plan)


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


@dataclasses.dataclass(frozen=True)
class Place:
    """A house, or several."""

    name: str  # its name
    houses: tuple[str, ...]  # the names of its houses
    episodes: int  # episodes in each of them

    @classmethod
    def of(cls, name: str, episodes: int, episodes_in_sets: int) -> Place:
        """The place of a name.

        Args:
            name: Of a floor plan, or of a set of houses such as `train-20`.
            episodes: How many in a single house.
            episodes_in_sets: How many in each house of a set.

        Raises:
            CaregiverError: There is no such place.
        """
        try:
            houses = tuple(plan.name for plan in house_set(name))
        except FloorPlanError:
            FloorPlan.load(name)
            return cls(name, (name,), episodes)
        return cls(name, houses, episodes_in_sets)

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
    plan = _load(job.house, job.condition.weights)
    caregiver = job.condition.make(plan)
    make = functools.partial(GridWorld, caregiver=caregiver, caregiver_actions=job.condition.actions)
    nearest = NearestCaregiver(plan) if job.condition == PAPER else None
    damage, differs = [], np.zeros(job.episodes)

    def look(world: GridWorld) -> None:
        damage.append(world.ledger.damage)
        if nearest is not None and caregiver is not None:
            percept = world.percept()
            other = caregiver.choose(percept) != nearest.choose(percept)
            differs[:] += other & (percept.holding == NOTHING)

    ledger = run_in_grid(make, plan, [job.epsilon], job.episodes, look=look).ledger
    courses = np.array(damage)
    collisions = np.rint(ledger.harm.sum(axis=1)[:, : len(COLLISIONS)] / costs(job.condition.weights)).astype(int)
    above, at = first(courses > DAMAGE_THRESHOLD), first(courses >= DAMAGE_THRESHOLD)
    return pd.DataFrame(collisions, columns=list(COLLISIONS)).assign(
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
        return rows[list(COLLISIONS)].to_numpy() @ costs(what) if what in WEIGHTS else rows[what].to_numpy()

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

    def mean(self, place: Place, condition: Condition, what: str) -> float:
        """The mean over houses and epsilons."""
        return float(np.mean(self.means(place, condition, what)))

    def collisions(self, place: Place, condition: Condition) -> np.ndarray:
        """Mean collisions of each kind an episode, over houses and epsilons, (kinds,)."""
        return np.array([self.mean(place, condition, kind) for kind in COLLISIONS])

    def mean_difference(self, house: str, ours: Condition, theirs: Condition) -> Estimate[float]:
        """Damage an episode under one condition less that under another, in one house, averaged over the epsilons."""
        return of_difference(*(np.mean([self.of(house, e, one) for e in EPSILONS], axis=0) for one in (ours, theirs)))

    def _compare(
        self, in_one: Any, in_several: Any, place: Place, ours: Condition, theirs: Condition, what: str
    ) -> list[Estimate[float]]:
        """Hold one condition against another, with what is for episodes of one house, or of several."""
        found = []
        for epsilon in EPSILONS:
            both = [[self.of(house, epsilon, one, what) for house in place.houses] for one in (ours, theirs)]
            found.append(in_several(*both) if len(place.houses) > 1 else in_one(*(one for (one,) in both)))
        return found


# -- The physical house: speed and yielding ----------------------------------------------------------


class Robot(NamedTuple):
    """A caregiver in the house, and the share of its base's highest speed that it may use."""

    caregiver: str = OWN
    speed: float = 1.0


ROBOTS: Mapping[str, Robot | None] = {
    ALONE: None,
    OWN: Robot(),
    "paper-still": Robot("paper-still"),
    "paper at 75 % of its speed": Robot(speed=0.75),
    "paper at 50 % of its speed": Robot(speed=0.5),
}


def slowed(robot: Embodiment, share: float) -> Embodiment:
    """The same robot with a slower base; it accelerates and turns as before."""
    limits = robot.limits
    base = dataclasses.replace(limits.base, velocity=share * limits.base.velocity)
    limits = dataclasses.replace(limits, base=base, base_speed=share * limits.base_speed)
    return dataclasses.replace(robot, name=f"{robot.name}-{share:g}", limits=limits)


class HouseJob(NamedTuple):
    """An episode: of which of `ROBOTS`, with what novice, and its number."""

    robot: str
    epsilon: float
    episode: int


def measure_house(
    episodes: int, jobs: int, out: pathlib.Path | None = None, epsilons: Sequence[float] = EPSILONS
) -> pd.DataFrame:
    """Run the episodes: a row each.

    Args:
        episodes: How many for each robot and epsilon.
        jobs: Worker processes.
        out: A folder in which finished episodes are kept, and looked for first.
        epsilons: Shares of random moves.
    """
    work = [HouseJob(robot, epsilon, i) for epsilon in epsilons for robot in ROBOTS for i in range(episodes)]
    return pd.DataFrame(run_all(run_in_house, work, jobs, "in the house", out))


def run_in_house(job: HouseJob) -> dict[str, Any]:
    """Run an episode."""
    env, policy = make(ROBOTS[job.robot], job.epsilon)
    env.task.reseed(episode_random(episode_seed(0, job.episode)))
    timestep = env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep) if policy else np.zeros(env.action_spec().shape))
    return {"robot": job.robot, "epsilon": job.epsilon, "episode": job.episode} | env.task.outcome()


@functools.lru_cache(maxsize=1)  # jobs of one robot and epsilon follow each other
def make(robot: Robot | None, epsilon: float) -> tuple[Any, CaregiverPolicy | None]:
    """A house with a novice, and what acts in it, if anything does."""
    kwargs: dict[str, Any] = {"robot": robot is not None}
    if robot:
        kwargs["embodiment"] = slowed(find_embodiment(), robot.speed)
    env = load("supervise", FloorPlan.load(HOUSE), epsilon, np.random.RandomState(0), task_kwargs=kwargs)
    return env, CaregiverPolicy(env, robot.caregiver) if robot else None


def house_left(episodes: pd.DataFrame, robot: str) -> list[Estimate[float]]:
    """Share of the unassisted damage that is left with one of `ROBOTS`, at each epsilon."""
    return [of_ratio(_of(group, robot), _of(group, ALONE)) for _, group in episodes.groupby("epsilon", sort=False)]


def house_difference(episodes: pd.DataFrame, robot: str, column: str) -> list[Estimate[float]]:
    """What is measured with one of `ROBOTS` less that with `paper`, at each epsilon."""
    groups = episodes.groupby("epsilon", sort=False)
    return [of_difference(_of(group, robot, column), _of(group, OWN, column)) for _, group in groups]


def _of(episodes: pd.DataFrame, robot: str, column: str = "damage") -> np.ndarray:
    """A column of one robot, by episode."""
    return episodes[episodes.robot == robot].sort_values("episode")[column].to_numpy(float)


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
    return [one for one in houses if share_apart(one.name, OWN_WEIGHTS) or results.mean(one, PAPER, "differs")]


# -- The page ----------------------------------------------------------------------------------------


def page(results: Results, episodes: pd.DataFrame) -> Page:
    """The page of the grid's results and the house's episodes, of which there may be none."""
    where, readings, endings = [], [], []
    for place in results.places:
        several = f"{len(place.houses)} houses with {place.episodes:,} episodes each in {place}"
        where.append(several if len(place.houses) > 1 else f"{place.episodes:,} episodes on {place}")
        linear, inverse = (np.mean([one.value for one in results.left(place, c)]) for c in (LINEAR, PAPER))
        readings.append(f"{linear / inverse:.2f} times on {place}")
        alone, ours = (f"{results.mean(place, one, 'apart'):.0%}" for one in (NONE, PAPER))
        endings.append(f"{alone} unassisted and {ours} assisted episodes on {place}")
    robots = []
    for robot in dict.fromkeys(episodes.robot[episodes.robot != ALONE]) if len(episodes) else ():
        caregiver, *rest = robot.split(" ", 1)
        columns = ("damage", "toys_reached")
        differences = [house_difference(episodes, robot, column) if robot != OWN else None for column in columns]
        robots.append((" ".join([f"`{caregiver}`", *rest]), house_left(episodes, robot), *differences))
    values = {
        "results": results,
        "where": where,
        "readings": readings,
        "endings": endings,
        "robots": robots,
        "episodes": episodes,
        "each": len(episodes) // len(episodes[["robot", "epsilon"]].drop_duplicates()) if robots else 0,
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

Series = dict[str, list[Estimate[float]]]


def draw(results: Results) -> Figure:
    """Damage left, a row of panels for each place, a column for each of four things that are varied."""
    rows = [_series(results, place) for place in results.places]
    titles = list(rows[0])
    with mpl.rc_context(STYLE):
        figure = Figure((3.0 * len(titles), 2.4 * len(rows)), layout="constrained")
        grid = figure.subplots(len(rows), len(titles), sharex=True, sharey=True, squeeze=False)
        for line, place, found in zip(grid, results.places, rows, strict=True):
            for axes, title in zip(line, titles, strict=True):
                series = found[title]
                offsets = np.linspace(-0.5, 0.5, len(series)) * _SPREAD * (len(series) - 1) / len(series)
                for (name, estimates), shade, offset in zip(series.items(), _COLOURS, offsets, strict=False):
                    value, low, high = np.array(estimates).T
                    at, colour = np.arange(len(estimates)) + offset, colours.unit(shade)
                    axes.vlines(at, low, high, color=colour, linewidth=1.8)
                    edge = {"markeredgecolor": INK, "markeredgewidth": 0.5, "markersize": 4.5}
                    axes.plot(at, value, "o", color=colour, label=name, **edge)
                axes.set_ylim(0.0, _TOP)
            line[0].set_ylabel(f"{place.name}: damage left")
        for axes, title in zip(grid[0], titles, strict=True):
            axes.set_title(title, fontsize=10)
            axes.legend(fontsize=7.5, loc="upper left", ncols=2, handlelength=1.0, labelspacing=0.2)
        for axes in grid[-1]:
            axes.set_xticks(range(len(EPSILONS)), [f"{epsilon:g}" for epsilon in EPSILONS])
            axes.set_xlabel("epsilon")
    return figure


def _series(results: Results, place: Place) -> dict[str, Series]:
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
