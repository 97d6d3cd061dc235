"""What a caregiver that has learnt elsewhere, or that watches a child that changes, is worth.

The paper's future work: "generalizing known expert policies to novel tasks, environments, and agent configurations".
Experts of other houses, by what was around them, are set against experts in place and none at all; and `foresight`,
which believes that a child's epsilon may change, is tried on children whose epsilon or toy bins do.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import rankdata

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.experts import Elsewhere, Experts, InPlace, Nobody, routes
from caregiver_mj.caregivers.foresight.child_model import CHANGE
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.danger import safety
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.viz import colours
from caregiver_mj.viz.figures.style import INK, MUTED, STYLE
from studies.ablations import Alike
from study import Page, Parser, run_all, run_in_grid

IN_PLACE, ELSEWHERE, NOBODY = "in place", "elsewhere", "nobody"
WHOSE = (IN_PLACE, ELSEWHERE, NOBODY)
HOW = ("draw", "mean")
PRIORS = tuple((whose, how) for how in HOW for whose in WHOSE)
HORIZON = 15  # timesteps without a collision that are called safe
HALF = 0.5  # epsilon below which a child is called safe, and above which it is not
_NEW_ROUTES = 1  # seed of expert routes that no caregiver has learnt from
MEASURES = {  # by the name of what `tell` has, what it is called
    "careful": "AUC, epsilon below .5",
    "safe": "AUC, no collision",
    "brier_careful": "Brier, epsilon",
    "brier_safe": "Brier, collision",
    "routes": "log likelihood",
}
NONE, RULE, ALIKE, KNOWS = "none", "paper", "paper-alike", "knows-goal"
FAMILIES = ("1,0.25", "0.75,0.05")
CHILDREN = ("0.4", "drifter:0.4", "waverer:0.4", "0.25", "switcher:0.25")
CHANGES = (0.0, 0.005, 0.02, 0.1)  # probability in a timestep that epsilon changes, as `foresight` believes

Damages = dict[str, np.ndarray]  # by caregiver: of every episode, (episodes, families)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", "test-20", "the new houses")
    parser.add("learnt-in", "train-20", "experts' houses", metavar="SET")
    parser.add("alone", 50, "episodes of each novice alone")
    parser.add("two", 40, "episodes of each two children")
    parser.add("changing", 40, "of each that changes")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run everything in every house of a set; return the page."""
    counts = options.alone, options.two, options.changing
    jobs = [Job(plan.name, options.learnt_in, *counts) for plan in house_set(options.houses)]
    return page(run_all(run_job, jobs, options.jobs, "in the grid"), options.houses, options.learnt_in)


# -- How well P(safe) tells with each of the action priors -------------------------------------------


class Telling(NamedTuple):
    """How well P(safe|tau) tells in one house, with one prior."""

    measures: tuple[float, ...]  # one number for each of `MEASURES`; NaN where there is nothing to tell
    course: np.ndarray  # area under the curve for epsilon after every timestep, (timesteps,)


class Walks(NamedTuple):
    """Children alone in a house, a column an episode."""

    cell: np.ndarray  # in which each move was made, (timesteps, B)
    action: np.ndarray  # the move, likewise
    hurt: np.ndarray  # whether it was a collision that does damage, likewise
    epsilon: np.ndarray  # share of random moves in each episode, (B,)


def walks(plan: FloorPlan, episodes: int) -> Walks:
    """Watch novices of each of `EPSILONS` in so many episodes each."""
    seen, damage = [], [np.zeros(episodes * len(EPSILONS))]

    def look(world: GridWorld) -> None:
        seen.append((world.previous_cell[:, 0], world.previous_action[:, 0]))
        damage.append(world.ledger.damage)

    run_in_grid(functools.partial(GridWorld, caregiver=None), plan, EPSILONS, episodes, look=look)
    cell, action = np.array(seen).swapaxes(0, 1)
    return Walks(cell, action, np.diff(damage, axis=0) > 0, np.repeat(EPSILONS, episodes))


def tell(plan: FloorPlan, theta: np.ndarray, seen: Walks) -> Telling:
    """How well P(safe|tau) tells safe walks from others, and theta the routes of experts.

    Args:
        plan: The house.
        theta: The action prior, (free cells, 4).
        seen: The walks.
    """
    ratio = safety.log_likelihood_ratio(theta, seen.cell, seen.action).cumsum(axis=0)  # (timesteps, B)
    ahead = np.cumsum(seen.hurt, axis=0)
    unhurt = ahead[HORIZON:] == ahead[:-HORIZON]  # after each timestep that has so many after it
    told = np.broadcast_to(seen.epsilon, ratio.shape)
    clear = told != HALF
    new = routes(plan, np.random.default_rng(_NEW_ROUTES))
    cells, actions = (np.concatenate([route[part] for route in new]) for part in (0, 1))
    measures = (
        area_under_curve(ratio[clear], told[clear] < HALF),
        area_under_curve(ratio[:-HORIZON], unhurt),
        _brier(ratio[clear], told[clear] < HALF),
        _brier(ratio[:-HORIZON], unhurt),
        float(np.log(theta[cells, actions]).mean()),
    )
    of = clear[0]
    course = [area_under_curve(row[of], seen.epsilon[of] < HALF) for row in ratio]
    return Telling(measures, np.array(course))


def area_under_curve(score: np.ndarray, positive: np.ndarray) -> float:
    """How often a positive has a higher score than a negative, ties counting half; NaN where one kind is missing."""
    score, positive = np.ravel(score), np.ravel(positive)
    count = int(positive.sum())
    others = len(positive) - count
    if not count or not others:
        return np.nan
    return float((rankdata(score)[positive].sum() - count * (count + 1) / 2) / (count * others))


def _brier(ratio: np.ndarray, positive: np.ndarray) -> float:
    return float(((safety.probability_safe(ratio) - positive) ** 2).mean())


# -- The episodes in the grid, a house a job ---------------------------------------------------------


class Job(NamedTuple):
    """All that is done in one house, and in how many episodes: of each novice, each two children, each that changes."""

    house: str
    learnt_in: str  # the set of houses in which the experts elsewhere walk
    alone: int
    two: int
    changing: int


class Found(NamedTuple):
    """What came out in a house."""

    telling: Mapping[tuple[str, str], Telling]  # by whose routes were learnt, and whether theta is a draw or the mean
    two: Damages  # to two children; a column for each of `FAMILIES`
    changing: Damages  # to one child; a column for each of `CHILDREN`


def run_job(job: Job) -> Found:
    """Run the episodes of a house: those that `evaluate` runs with seed 0."""
    plan = FloorPlan.load(job.house)
    experts: dict[str, Experts] = {IN_PLACE: InPlace(), ELSEWHERE: _learnt(job.learnt_in), NOBODY: Nobody()}
    seen = walks(plan, job.alone)
    telling = {}
    for whose, how in PRIORS:
        theta = experts[whose].action_prior(plan, np.random.default_rng(0), how == HOW[0])
        telling[whose, how] = tell(plan, theta, seen)
    guards = {whose: PaperCaregiver(plan, experts=experts[whose]) for whose in WHOSE}
    guards[ALIKE] = Alike(plan)
    watchers: dict[str, Caregiver] = {RULE: PaperCaregiver(plan)}
    watchers |= {foresight(change): ForesightCaregiver(plan, change=change) for change in CHANGES}
    watchers[KNOWS] = KnowsGoalCaregiver(plan)
    return Found(
        telling,
        {name: _damage(plan, caregiver, FAMILIES, job.two) for name, caregiver in ({NONE: None} | guards).items()},
        {n: _damage(plan, caregiver, CHILDREN, job.changing) for n, caregiver in ({NONE: None} | watchers).items()},
    )


def foresight(change: float) -> str:
    """What it is called if it believes in so much change."""
    return f"foresight, change {change:g}"


def _damage(plan: FloorPlan, caregiver: Caregiver | None, who: Sequence[str], episodes: int) -> np.ndarray:
    """Damage of every episode of every family, (episodes, families)."""
    world = run_in_grid(functools.partial(GridWorld, caregiver=caregiver), plan, who, episodes)
    return world.ledger.damage.reshape(len(who), episodes).T


@functools.lru_cache(maxsize=1)  # all jobs of a process learn in the same houses
def _learnt(houses: str) -> Elsewhere:
    return Elsewhere.in_houses(house_set(houses))


# -- The page and its figure -------------------------------------------------------------------------


def page(found: Sequence[Found], houses: str, learnt_in: str) -> Page:
    """The page of what came out in each of some houses, for experts of others."""
    place = {prior: np.array([one.telling[prior].measures for one in found]).T for prior in PRIORS}
    telling_less = [(whose, how, place[whose, how] - place[IN_PLACE, how]) for how in HOW for whose in WHOSE[1:]]
    two: list[tuple[str, str, Estimate[float] | None, Estimate[float] | None]] = []
    for i, family in enumerate(FAMILIES):
        damage = {name: [one.two[name][:, i] for one in found] for name in (NONE, *WHOSE, ALIKE)}
        for name in (*WHOSE, ALIKE):
            less = None if name == ALIKE else two_level.of_difference(damage[name], damage[ALIKE])
            left = two_level.of_ratio(damage[name], damage[NONE])
            two.append((family, f"`{ALIKE}`" if name == ALIKE else name, left, less))
        less = two_level.of_difference(damage[ELSEWHERE], damage[IN_PLACE])
        two.append((family, "elsewhere, less in place", None, less))
    ours, names = foresight(CHANGE), (RULE, *map(foresight, CHANGES), KNOWS)
    columns = {n: [[one.changing[n][:, i] for one in found] for i in range(len(CHILDREN))] for n in (NONE, *names)}
    values = {
        "count": len(found),
        "houses": houses,
        "learnt_in": learnt_in,
        "horizon": HORIZON,
        "measures": MEASURES.values(),
        "telling": [(*prior, list(map(_over, place[prior]))) for prior in PRIORS],
        "telling_less": [(whose, how, list(map(_over, less))) for whose, how, less in telling_less],
        "two": two,
        "change": CHANGE,
        "children": CHILDREN,
        "changing": [(name, list(map(two_level.of_ratio, columns[name], columns[NONE]))) for name in names],
        "alone": np.mean([one.changing[NONE].mean(axis=0) for one in found], axis=0),
        "changing_less": [
            (name, list(map(two_level.of_difference, columns[name], columns[ours]))) for name in names if name != ours
        ],
    }
    return Page(values, {"generalisation.png": draw(found)})


def _over(values: np.ndarray) -> Estimate[float]:
    """The mean over those houses that have a value."""
    return intervals.of_mean(values[~np.isnan(values)])


_COLOURS = [colours.unit(colour) for colour in (colours.ROBOT, colours.BIN, colours.CANDLE, colours.STAIRWELL)]


def draw(found: Sequence[Found]) -> Figure:
    """How well P(safe) tells as time goes on; what that is worth with two children; and children that change."""
    with mpl.rc_context(STYLE):
        figure = Figure((11.0, 3.4), layout="constrained")
        telling, two, changing = figure.subplots(1, 3)
        for whose, colour in zip(WHOSE, _COLOURS, strict=False):
            for how, line in zip(HOW, ("-", ":"), strict=True):
                courses = np.mean([one.telling[whose, how].course for one in found], axis=0)
                telling.plot(np.arange(1, len(courses) + 1), courses, line, color=colour, label=f"{whose}, {how}")
        telling.set(xlabel="timesteps watched", ylabel="area under the curve, mean over houses")
        telling.legend(fontsize=7.5, title="experts", title_fontsize=7.5, loc="center right")
        for i, (whose, colour) in enumerate(zip(WHOSE, _COLOURS, strict=False)):
            differences = two_level.of_difference([one.two[whose] for one in found], [one.two[ALIKE] for one in found])
            _bars(two, np.arange(len(FAMILIES)) + (i - 1) * 0.18, differences, color=colour, label=whose)
        two.axhline(0, color=INK, linewidth=0.8)
        two.set_xticks(range(len(FAMILIES)), [family.replace(",", " and ") for family in FAMILIES])
        two.legend(fontsize=7.5, title="experts (draw)", title_fontsize=7.5)
        alone = [one.changing[NONE] for one in found]
        names = [RULE, *map(foresight, CHANGES)]
        left = [two_level.of_ratio([one.changing[name] for one in found], alone) for name in names]
        shades = [MUTED, _COLOURS[0], _COLOURS[1], INK, _COLOURS[2]]
        for i, (child, shade) in enumerate(zip(CHILDREN, shades, strict=True)):
            estimate = np.array([[part[i] for part in one] for one in left]).T
            _bars(changing, np.arange(len(names)) + (i - 2) * 0.13, estimate, color=shade, label=child)
        changing.set_xticks(range(len(names)), ["rule", *(f"{change:g}" for change in CHANGES)])
        changing.set(xlabel="the rule; foresight, by its change", ylim=(0, None))
        changing.legend(fontsize=7.5, ncols=2)
        titles = (
            "telling epsilon below .5 from above",
            "two children: damage, less that without P(safe)",
            "children that change: damage left",
        )
        for axes, title in zip(figure.axes, titles, strict=True):
            axes.set_title(title, fontsize=10)
    return figure


def _bars(axes: Axes, place: np.ndarray, estimate: Iterable[np.ndarray], **options: Any) -> None:
    value, low, high = (np.asarray(part, float) for part in estimate)
    axes.errorbar(place, value, [value - low, high - value], fmt="o", markersize=4, linewidth=1, **options)
