"""How much is attention worth? Damage left by caregivers that look only a share of the time, in bouts.

While it looks, such a caregiver acts as the rule or the planner does; else it does nothing. So a robot, which always
looks, can be compared with the share of attention that it replaces.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import STYLE
from study import Page, Parser, load_house, run_all, run_in_grid

TODDLERS = ("1", "0.75", "0.5", "0.25", "0.05")
# Share of parents of toddlers whose supervision was high or moderate, and share that intervened when they saw the
# toddler touch a hazard (MacIsaac, University of Guelph).
PARENTS = 0.4


class Attention(Caregiver):
    """Mixin before a caregiver, which then acts only while it looks.

    Whether it looks is a Markov chain with the given share and mean bout, that share at the start as well. A candle in
    the hand is put down all the same.
    """

    share, bout = 1.0, 1.0  # of the time; timesteps

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        numbers = [0] * batch if seeds is None else seeds
        draws = np.stack([np.random.default_rng((1, self.seed, int(n))).random(EPISODE_TIMESTEPS + 1) for n in numbers])
        self._looks, self._timestep = looks(draws, self.share, self.bout), 0

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self._timestep = (self._timestep + 1) % self._looks.shape[1]

    def decide(self, percept: Percept) -> Interventions:
        looking = self._looks[:, self._timestep]
        return super().decide(percept).where(looking, Interventions.idle(len(looking)))


class AttentiveRule(Attention, PaperCaregiver):
    """The rule, while it looks."""


class AttentivePlanner(Attention, ForesightCaregiver):
    """The planner, while it looks."""


CAREGIVERS: dict[str, type[Attention]] = {"expected-danger": AttentiveRule, "foresight": AttentivePlanner}
_COLOURS = {"expected-danger": colours.CANDLE, "foresight": colours.ROBOT}


def looks(draws: np.ndarray, share: float, bout: float) -> np.ndarray:
    """Return whether it looks in each timestep, bool (B, T), by uniform draws, (B, T).

    A bout of looking ends with probability 1 / bout; one of not looking lasts so long that the share is as given.
    """
    if share == 1.0:
        return np.ones(draws.shape, bool)
    goes_on, begins = 1.0 - 1.0 / bout, share / (1.0 - share) / bout
    found = draws < share  # at the start; later ones follow from those before
    for now in range(1, draws.shape[1]):
        found[:, now] = draws[:, now] < np.where(found[:, now - 1], goes_on, begins)
    return found


class Job(NamedTuple):
    """All episodes in one house with one caregiver and share of attention; without a caregiver if it has no name."""

    house: str
    caregiver: str
    share: float
    bout: float
    episodes: int


def run_job(job: Job) -> list[float]:
    """Return the damage of each episode, summed over the toddlers, (episodes,)."""
    plan, caregiver = load_house(job.house), None
    if job.caregiver:
        caregiver = CAREGIVERS[job.caregiver](plan)
        caregiver.share, caregiver.bout = job.share, job.bout
    world = run_in_grid(functools.partial(GridWorld, caregiver=caregiver), plan, TODDLERS, job.episodes)
    damage: np.ndarray = world.ledger.damage.reshape(len(TODDLERS), job.episodes).sum(axis=0)
    return damage.tolist()


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["test-50"], "houses to run in, or sets of them", metavar="SET")
    parser.add("episodes", 10, "with each toddler in each house")
    parser.add("shares", [0.1, 0.2, 0.4, 0.6, 0.8, 1.0], "shares of the time in which it looks", metavar="SHARE")
    parser.add("bout", 6.0, "mean of a bout of looking, timesteps of 1.68 s")
    parser.add_file("out", "keep the episodes there, and go on with them", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run all caregivers; return the page."""
    houses = [plan.name for plan in houses_named(options.houses)]
    kinds = [("", 0.0), *((name, share) for name in CAREGIVERS for share in options.shares)]
    # House by house, so that a planner's tables are made once.
    work = [Job(house, *kind, options.bout, options.episodes) for house in houses for kind in kinds]
    found = dict(zip(work, run_all(run_job, work, options.jobs, "attention", options.out), strict=True))

    def damage(name: str, share: float) -> list[np.ndarray]:
        return [np.array(found[Job(house, name, share, options.bout, options.episodes)]) for house in houses]

    alone = damage("", 0.0)
    left = {
        name: {share: two_level.of_ratio(damage(name, share), alone) for share in options.shares} for name in CAREGIVERS
    }
    values: dict[str, Any] = {
        "houses": " ".join(options.houses),
        "count": len(houses),
        "episodes": options.episodes,
        "bout": 1.68 * options.bout,
        "shares": options.shares,
        "left": left,
        "replaced": replaced(left["foresight"], left["expected-danger"][max(options.shares)].value),
    }
    return Page(values, {"attention.png": picture(left)})


def replaced(left: dict[float, Estimate[float]], level: float) -> float:
    """Return the share of attention at which as much damage is left as a level, linear between those measured."""
    shares = sorted(left, reverse=True)
    return float(np.interp(level, [left[share].value for share in shares], shares))


def picture(left: dict[str, dict[float, Estimate[float]]]) -> Figure:
    """Draw the damage left against the share of attention."""
    with mpl.rc_context(STYLE):
        figure = Figure((5.6, 3.6), layout="constrained")
        axes = figure.subplots()
        for name, by_share in left.items():
            shares, found = [100 * share for share in by_share], np.array([*by_share.values()])
            axes.fill_between(shares, found[:, 1], found[:, 2], color=colours.unit(_COLOURS[name]), alpha=0.25)
            axes.plot(shares, found[:, 0], "o-", color=colours.unit(_COLOURS[name]), label=f"acts as {name}")
        axes.axvline(100 * PARENTS, color=colours.unit(colours.HARM), linestyle=":")
        axes.annotate("parents", (100 * PARENTS, 0.98), (4, 0), ("data", "axes fraction"), "offset points", va="top")
        axes.set(xlabel="looks, % of the time", ylabel="damage left, as a share of alone", ylim=(0, None))
        axes.legend(loc="lower left")
    return figure
