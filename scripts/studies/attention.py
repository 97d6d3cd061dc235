"""How much is attention worth? Damage left by caregivers that look only a share of the time, in bouts.

While it looks, such a caregiver acts as the rule or the planner does; else it does nothing. So a robot, which always
looks, can be compared with the share of attention that it replaces: the physical one, in the houses of a run, with an
attentive caregiver in the grid in the same houses.
"""

from __future__ import annotations

import argparse
import functools
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from caregiver_mj.caregivers.baselines import BOUT, Attentive
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import STYLE
from study import Page, Parser, load_house, run_all, run_in_grid

TODDLERS = ("1", "0.75", "0.5", "0.25", "0.05")
# Share of parents of toddlers whose supervision was high or moderate, and share that intervened when they saw the
# toddler touch a hazard (MacIsaac, University of Guelph).
PARENTS = 0.4


CAREGIVERS = {"expected-danger": colours.CANDLE, "foresight": colours.ROBOT}


class Job(NamedTuple):
    """All episodes in one house with one caregiver, for each share of attention; none if it has no name."""

    house: str
    caregiver: str
    shares: tuple[float, ...]
    bout: float
    episodes: int


def run_job(job: Job) -> list[list[float]]:
    """Return the damage of each episode, summed over the toddlers, (shares, episodes)."""
    plan, caregiver = load_house(job.house), None
    if job.caregiver:
        caregiver = make_caregiver(f"attentive:1:{job.caregiver}", plan)
        assert isinstance(caregiver, Attentive)
        caregiver.share, caregiver.bout = np.repeat(job.shares, len(TODDLERS) * job.episodes), job.bout
    make, toddlers = functools.partial(GridWorld, caregiver=caregiver), TODDLERS * len(job.shares)
    damage: np.ndarray = run_in_grid(make, plan, toddlers, job.episodes).ledger.damage
    found: list[list[float]] = damage.reshape(-1, len(TODDLERS), job.episodes).sum(axis=1).tolist()
    return found


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["test-50"], "houses to run in, or sets of them", metavar="SET")
    parser.add("episodes", 10, "with each toddler in each house")
    parser.add("shares", [0.1, 0.2, 0.4, 0.6, 0.8, 1.0], "shares of the time in which it looks", metavar="SHARE")
    parser.add("robot", "docs/house/houses.csv", "table of the houses of a run of the physical robot", metavar="FILE")
    parser.add("bout", BOUT, "mean of a bout of looking, timesteps of 1.68 s")
    parser.add_file("out", "keep the episodes there, and go on with them", "DIR")
    parser.add_jobs()


def run(options: argparse.Namespace) -> Page:
    """Run all caregivers; return the page."""
    houses = [plan.name for plan in houses_named(options.houses)]
    robot = pd.read_csv(options.robot, dtype={"family": str}).query("family in @TODDLERS")
    others = [*dict.fromkeys(robot.house)]
    shares = tuple(options.shares)
    # House by house, so that a planner's tables are made once.
    work = [
        Job(house, name, shares if name else (0.0,), options.bout, options.episodes)
        for house in dict.fromkeys([*houses, *others])
        for name in ("", *(CAREGIVERS if house in houses else ("expected-danger",)))
    ]
    done = run_all(run_job, work, options.jobs, "attention", options.out)
    found = {(job.house, job.caregiver): np.array(damage) for job, damage in zip(work, done, strict=True)}

    def left(name: str, where: list[str]) -> dict[float, Estimate[float]]:
        alone = [found[house, ""][0] for house in where]
        each = ([found[house, name][number] for house in where] for number in range(len(shares)))
        return {share: two_level.of_ratio(damage, alone) for share, damage in zip(shares, each, strict=True)}

    by_caregiver, person = {name: left(name, houses) for name in CAREGIVERS}, left("expected-danger", others)
    by_house = robot.pivot_table("damage", "house", "caregiver", aggfunc="sum")
    worth = {}
    for name in CAREGIVERS:
        level = intervals.of_ratio(by_house[name].to_numpy(), by_house["none"].to_numpy())
        worth[name] = level, [replaced(person, end) for end in (level.value, level.high, level.low)]
    values: dict[str, Any] = {
        "houses": " ".join(options.houses),
        "count": len(houses),
        "others": len(others),
        "episodes": options.episodes,
        "bout": 1.68 * options.bout,
        "shares": shares,
        "left": by_caregiver,
        "person": person[max(shares)],
        "worth": worth,
    }
    return Page(values, {"attention.png": picture(by_caregiver)})


def replaced(left: dict[float, Estimate[float]], level: float) -> float:
    """Return the share of attention at which as much damage is left as a level, linear between those measured.

    At share 0 all damage is left. If even the greatest share leaves more, return that share.
    """
    shares = sorted(left, reverse=True)
    return float(np.interp(level, [*(left[share].value for share in shares), 1.0], [*shares, 0.0]))


def picture(left: dict[str, dict[float, Estimate[float]]]) -> Figure:
    """Draw the damage left against the share of attention."""
    with mpl.rc_context(STYLE):
        figure = Figure((5.6, 3.6), layout="constrained")
        axes = figure.subplots()
        for name, by_share in left.items():
            shares, found = [100 * share for share in by_share], np.array([*by_share.values()])
            axes.fill_between(shares, found[:, 1], found[:, 2], color=colours.unit(CAREGIVERS[name]), alpha=0.25)
            axes.plot(shares, found[:, 0], "o-", color=colours.unit(CAREGIVERS[name]), label=f"acts as {name}")
        axes.axvline(100 * PARENTS, color=colours.unit(colours.HARM), linestyle=":")
        axes.annotate("parents", (100 * PARENTS, 0.98), (4, 0), ("data", "axes fraction"), "offset points", va="top")
        axes.set(xlabel="looks, % of the time", ylabel="damage left, as a share of alone", ylim=(0, None))
        axes.legend(loc="lower left")
    return figure
