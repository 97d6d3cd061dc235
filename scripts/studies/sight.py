"""With its own eyes: what partial sight costs, what remembering and looking win back, and where the time goes.

Caregivers with walls that are opaque, with a camera, and with cameras on the ceilings, in the grid. What they believe
of the cell of a child that they do not see is held against where it is.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import itertools
import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.cli import main as caregiver_mj_command
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.viz import figure_style as style
from study import Page, Parser, damage_sums, read_run, run_all, run_in_grid

FULL, WALLS = "all", "walls"
NEVER, ABSENT, HALF = (f"studies.sight:{name}" for name in ("NeverLooks", "NotSeenTellsNothing", "AllAreHalfRandom"))
TITLES = {
    "last-seen": "`last-seen`",
    "expected-danger": "`expected-danger`",
    NEVER: "`foresight` that never looks",
    "foresight": "`foresight`",
}
ABLATED = {
    NEVER: "never goes to look",
    ABSENT: "where it does not see a child may be one",
    HALF: "epsilon is taken for 0.5",
}
CHILDREN = ("1", "0.5", "0.05", "explorer:0.25", "toddler:0.5", "seeker:0.25", "avoider:0.25")
SPENT = ("seen", "looking", "guarding", "handling")
_EDGES = np.array([0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0])  # of bins of what is believed
_LEAST = 1e-3  # the least probability that a cell is taken to have in the log score


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["test-20"], "houses, or sets of them")
    parser.add("sights", [FULL, WALLS, "camera", "rooms:1", "rooms:2", "rooms:4"], "the first one is all")
    parser.add("fewer", ["test-20"], "those of the houses for rooms:N, and for what is believed")
    parser.add("episodes", 20, "of each toddler in each house")
    parser.add("children", 5, "episodes of each child in each house, to hold the belief against")
    parser.add_file("runs", "keep the runs there, and go on with them", "DIR", required=True)
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run what is missing; return the page."""
    runs = {}
    for sight in options.sights:
        names = ["none", "expected-danger", "foresight"]
        if sight != FULL:
            names += ["last-seen", NEVER]
        if sight == WALLS:
            names += [ABSENT, HALF]
        folder = options.runs / sight.replace(":", "-")
        houses = options.fewer if _is_ceiling(sight) else options.houses
        where = ["--world", "grid", "--houses", *houses, "--sight", sight]
        what = ["--caregiver", *names, "--episodes", str(options.episodes), "--jobs", str(options.jobs)]
        with contextlib.redirect_stdout(sys.stderr):
            if caregiver_mj_command(["evaluate", *where, *what, "--out", str(folder), "--resume"]):
                raise CaregiverError(f"the run in '{folder}' failed")
        runs[sight] = Run(*read_run(folder)[:1], pd.read_parquet(folder / "houses.parquet"))
    jobs = [
        Job(plan, child, sight, options.children)
        for plan in houses_named(options.fewer)
        for child in CHILDREN
        for sight in options.sights[1:3]
    ]
    tallies = dict(zip(jobs, run_all(believed, jobs, options.jobs, "beliefs"), strict=True))
    cells = {plan.name: len(plan.free_cells) for plan in houses_named(options.houses)}
    return page(runs, tallies, cells, (" ".join(options.houses), " ".join(options.fewer)), options.episodes)


class Run(NamedTuple):
    """The episodes of a run, and what each house comes to."""

    episodes: pd.DataFrame
    cells: pd.DataFrame


def _is_ceiling(sight: str) -> bool:
    return sight.startswith("rooms:")


# -- Ablations ---------------------------------------------------------------------------------------


class NeverLooks(ForesightCaregiver):
    """The planner without the regret of not knowing: QMDP over the belief."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, regrets=0)


class NotSeenTellsNothing(ForesightCaregiver):
    """The planner whose belief does not know that a child that is not seen is not where it would be."""

    absence, epsilons = False, slice(None)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        chain = child_chain(self.plan)
        prior = np.zeros_like(chain.prior)
        prior[:, self.epsilons] = chain.prior[:, self.epsilons]
        self._own = Tracker(dataclasses.replace(chain, prior=prior / prior.sum()), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        cell, in_view = self._seen(percept)
        known = percept.belief is not None and percept.previous_action != NOTHING
        previous = np.where(known, percept.previous_cell, NOTHING)
        self._own.move(previous, percept.previous_action, cell, in_view, percept.caregiver_cell)
        super().watch(self._as_believed(percept))

    def decide(self, percept: Percept) -> Interventions:
        self._own.look(*self._seen(percept))
        return super().decide(self._as_believed(percept))

    def _seen(self, percept: Percept) -> tuple[np.ndarray, np.ndarray]:
        """Return where children are seen, and which cells are, for all that it makes of that."""
        if percept.belief is None:
            raise CaregiverError("sight must be walls, camera or rooms:N for this caregiver, got all")
        presence = percept.belief.presence
        empty = (presence == 0).all(axis=1)  # no child can be there
        cell = np.where(percept.belief.seen, percept.child_cell, NOTHING)
        return cell, empty if self.absence else np.zeros_like(empty)

    def _as_believed(self, percept: Percept) -> Percept:
        return dataclasses.replace(percept, belief=self._own, child_cell=self._own.cell)


class AllAreHalfRandom(NotSeenTellsNothing):
    """The planner that takes all children for half random ones."""

    absence, epsilons = True, slice(2, 3)


# -- Whether what is believed is so ------------------------------------------------------------------


class Job(NamedTuple):
    """A child in a house, with `foresight`."""

    house: FloorPlan
    child: str
    sight: str
    episodes: int


def believed(job: Job) -> dict[str, Any]:
    """Return sums over the timesteps in which the child is not seen: scores, and what is believed of each cell."""
    counts, hits, predicted = np.zeros((3, len(_EDGES) - 1))
    sums = dict.fromkeys(("timesteps", "log", "brier", "uniform", "last"), 0.0)
    last: list[np.ndarray] = []

    def look(world: GridWorld) -> None:
        assert world.eyes
        tracker, cell = world.eyes.tracker, world.child_cell[:, 0]
        before = last.pop() if last else cell
        last.append(np.where(tracker.seen[:, 0], cell, before))
        hidden = np.flatnonzero(~tracker.seen[:, 0])
        presence, cell = tracker.presence[hidden, 0], cell[hidden]
        at = presence[np.arange(len(hidden)), cell]
        sums["timesteps"] += len(hidden)
        sums["log"] -= np.log(np.maximum(at, _LEAST)).sum()
        sums["uniform"] += np.log((presence > 0).sum(axis=1)).sum()
        sums["brier"] += ((presence**2).sum(axis=1) - 2 * at + 1).sum()
        sums["last"] += 2 * (last[0][hidden] != cell).sum()
        true = np.arange(presence.shape[1]) == cell[:, None]
        which = np.clip(np.searchsorted(_EDGES, presence, side="left") - 1, 0, len(counts) - 1)
        for total, weights in ((counts, None), (hits, true.ravel()), (predicted, presence.ravel())):
            total += np.bincount(which.ravel(), weights, len(counts))

    run_in_grid(
        lambda plan, family: GridWorld(plan, family, make_caregiver("foresight", plan), sight=job.sight),
        job.house,
        [ChildGroup.of(job.child)],
        job.episodes,
        look=look,
    )
    return sums | {"counts": counts.tolist(), "hits": hits.tolist(), "predicted": predicted.tolist()}


# -- The page ----------------------------------------------------------------------------------------


def page(
    runs: dict[str, Run],
    tallies: dict[Job, dict[str, Any]],
    cells: dict[str, int],
    houses: tuple[str, str],
    episodes: int,
) -> Page:
    """Return the page; houses by name have so many free cells."""
    sums = {sight: _sums(run) for sight, run in runs.items()}
    full = {sight: _sums(runs[FULL], run) for sight, run in runs.items()}  # what each is held against
    partial = [sight for sight in runs if sight != FULL]
    ceilings = {sight: run for sight, run in runs.items() if _is_ceiling(sight)}
    runs = {sight: run for sight, run in runs.items() if sight not in ceilings}
    epsilons = sorted(runs[FULL].episodes.epsilon.unique(), reverse=True)
    values = {
        "houses": houses[0],
        "fewer": houses[1],
        "episodes": episodes,
        "epsilons": epsilons,
        "titles": TITLES,
        "partial": partial,
        "never": NEVER,
        "left": {
            (sight, name): two_level.of_ratio(found, full[sight]["none"])
            for sight, of_sight in sums.items()
            for name, found in of_sight.items()
        },
        "closed": {
            (sight, name): _closed(sums[sight]["last-seen"], sums[sight][name], full[sight]["foresight"])
            for sight, name in itertools.product(partial, TITLES)
        },
        "by_epsilon": {
            (sight, name): _means(run.episodes, name, "damage")
            for sight, run in runs.items()
            for name in run.episodes.caregiver.unique()
        },
        "spent": {(sight, what): _means(runs[sight].episodes, "foresight", what) for sight in runs for what in SPENT},
        "bought": {
            sight: [_bought(of.episodes[of.episodes.epsilon == epsilon]) for epsilon in epsilons]
            for sight, of in runs.items()
            if sight != FULL
        },
        "sizes": [row for sight in runs if sight != FULL for row in _by_size(sight, runs[sight].episodes, cells)],
        "ablated": {
            title: two_level.of_difference(sums[WALLS][name], sums[WALLS]["foresight"])
            for name, title in ABLATED.items()
        }
        if WALLS in runs
        else {},
        "harm": {
            (sight, name): int(((run.cells.caregiver == name) & (run.cells.harm_verdict == "more")).sum())
            for sight, run in (runs | ceilings).items()
            for name in TITLES
            if name in set(run.cells.caregiver)
        },
        "cells": len(runs[FULL].cells) // runs[FULL].cells.caregiver.nunique(),
        "scores": _scores(tallies),
    }
    least = min([*runs.values(), *ceilings.values()], key=lambda run: run.episodes.house.nunique())
    shown = {sight: _sums(run, least) for sight, run in (runs | ceilings).items()}
    return Page(values, {"sight.svg": draw(shown), "sight_belief.svg": draw_belief(tallies)})


def _sums(run: Run, among: Run | None = None) -> dict[str, list[np.ndarray]]:
    """Return the damage by caregiver, as `damage_sums`, in the houses that another run has, too."""
    episodes = run.episodes if among is None else run.episodes[run.episodes.house.isin(among.episodes.house)]
    return {name: damage_sums(of) for name, of in episodes.groupby("caregiver", sort=False)}


def _means(episodes: pd.DataFrame, name: str, column: str) -> list[float]:
    """Return the mean of a column by epsilon, the most random first."""
    means = episodes[episodes.caregiver == name].groupby("epsilon")[column].mean()
    return [float(means[epsilon]) for epsilon in sorted(means.index, reverse=True)]


def _bought(episodes: pd.DataFrame) -> float:
    """Return the damage that a minute of looking saves: that of the planner that never looks, less its own."""
    means = episodes.groupby("caregiver")[["damage", "looking", "sim_seconds"]].mean()
    looks = means.loc["foresight"]
    return float((means.damage[NEVER] - looks.damage) / max(1e-9, looks.looking * looks.sim_seconds / 60))


def _by_size(sight: str, episodes: pd.DataFrame, cells: dict[str, int]) -> list[dict[str, Any]]:
    """Return what a sight comes to in each third of the houses by their free cells."""
    third, rows = pd.Series(cells).rank(method="first", pct=True).mul(3).apply(np.ceil), []
    for _, of in episodes.groupby(episodes.house.map(third)):
        size, damage = of.house.map(cells), of.groupby("caregiver").damage.mean()
        spent = of[of.caregiver == "foresight"][["seen", "looking"]].mean()
        left = damage / damage["none"] if damage["none"] else damage * np.nan
        rows.append({"sight": sight, "cells": (size.min(), size.max()), "left": left, "bought": _bought(of), **spent})
    return rows


def _closed(worst: list[np.ndarray], ours: list[np.ndarray], best: list[np.ndarray]) -> Estimate[float]:
    """Return how much of the way from the worst to the best ours goes, by sums of damage, with an interval."""
    last, own, full = (np.array([house.mean() for house in houses]) for houses in (worst, ours, best))
    value = (last.sum() - own.sum()) / (last.sum() - full.sum())
    # Houses drawn anew; where they hardly differ the ratio can be anything, and its quantiles say so.
    again = np.random.default_rng(0).integers(len(last), size=(4000, len(last)))
    drawn = (last - own)[again].sum(axis=1) / (last - full)[again].sum(axis=1)
    return Estimate(float(value), *map(float, np.quantile(drawn, (0.025, 0.975))))


def _scores(tallies: dict[Job, dict[str, Any]]) -> dict[tuple[str, str], dict[str, float]]:
    """Return mean scores by sight and child, and of how many timesteps."""
    rows = pd.DataFrame([{"sight": job.sight, "child": job.child, **sums} for job, sums in tallies.items()])
    sums = rows.groupby(["sight", "child"], sort=False)[["timesteps", "log", "brier", "uniform", "last"]].sum()
    return sums.div(sums.timesteps.clip(lower=1), axis=0).assign(timesteps=sums.timesteps).to_dict("index")


def draw(sums: dict[str, dict[str, list[np.ndarray]]]) -> Figure:
    """Return a figure: damage left against the number of cameras on the ceiling, and with full sight."""
    figure, axes = style.single()
    cameras = {0: "camera"} | {int(sight.partition(":")[2]): sight for sight in sums if sight.startswith("rooms")}
    cameras = {number: sight for number, sight in sorted(cameras.items()) if sight in sums}
    for number, name in enumerate(("last-seen", "expected-danger", "foresight")):
        left = [two_level.of_ratio(sums[sight][name], sums[FULL]["none"]) for sight in cameras.values()]
        value, low, high = np.array(left).T
        axes.errorbar(
            list(cameras), value, [value - low, high - value], color=f"C{number}", marker="o", label=name, capsize=2
        )
        if name in sums[FULL]:
            full = two_level.of_ratio(sums[FULL][name], sums[FULL]["none"]).value
            axes.axhline(full, color=f"C{number}", linestyle=":", linewidth=1)
    axes.set_xticks(list(cameras))
    axes.set_xlabel("cameras on the ceiling (dotted: full sight)")
    axes.set_ylabel("share of the damage that is left")
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    return figure


def draw_belief(tallies: dict[Job, dict[str, Any]]) -> Figure:
    """Return a figure: how often a child is in a cell, by how probable that is believed to be."""
    figure, axes = style.single()
    for number, child in enumerate(CHILDREN):
        counts, hits, predicted = (
            np.sum([sums[key] for job, sums in tallies.items() if job.child == child], axis=0)
            for key in ("counts", "hits", "predicted")
        )
        if not np.size(counts):
            continue
        some = counts >= 100
        axes.plot(
            predicted[some] / counts[some], hits[some] / counts[some], marker="o", color=f"C{number}", label=child
        )
    axes.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    axes.set_xlabel("believed probability of a cell")
    axes.set_ylabel("how often it is there")
    axes.legend(frameon=False, ncols=2)
    return figure
