"""Whether the planner gets what it hopes for: the cost that it expects against what then comes, by the shape of house.

The cost is the planner's own: discounted damage, and a price of denied moves. Now and then in an episode, when no
candle is in its hand, it is asked what it expects to come; that is compared with what does come. `foresight` expects it
in the mean over the novices that it believes in, `knows-goal` of each of them.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.foresight.child_model import EPSILONS
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE
from caregiver_mj.children.family import Family, side_by_side
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments import two_level
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import houses_named, shape_of
from study import Parser, fill_in, run_all, table

CAREGIVERS = {"foresight": ForesightCaregiver, "knows-goal": KnowsGoalCaregiver}
ASKED = range(1, 202, 25)  # timesteps after which it is asked
AFTER = 300  # timesteps after the last of them; what comes later counts less than 1.1 %
TOO_HOPEFUL = 1.1  # realised over expected


class Job(NamedTuple):
    """All episodes with one caregiver in one house."""

    house: str
    caregiver: str
    episodes: int


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("houses", ["train-10", "shapes-train-50"], metavar="SET")
    parser.add("episodes", 4, "with each novice")
    parser.add_jobs()
    parser.add_file("docs", "write them into the guide's page there", "DIR")


def run(options: argparse.Namespace) -> None:
    """Run the study; print its tables."""
    names = [plan.name for plan in houses_named(options.houses)]
    work = [Job(house, caregiver, options.episodes) for house in names for caregiver in CAREGIVERS]
    text = report(pd.concat(run_all(ask, work, options.jobs, "houses"), ignore_index=True))
    print(text)
    if options.docs:
        fill_in(options.docs / "guide" / "foresight.md", "value", text)


def ask(job: Job) -> pd.DataFrame:
    """Return what was expected and what came of it: a row an episode with each novice, in the mean over its moments."""
    plan, size = FloorPlan.load(job.house), job.episodes * len(EPSILONS)
    caregiver = CAREGIVERS[job.caregiver](plan)
    world = GridWorld(plan, side_by_side(plan, [Family.of(one) for one in EPSILONS], job.episodes), caregiver)
    timesteps = ASKED[-1] + AFTER
    tapes = [Tape.draw_family(np.random.RandomState(seed), 1, timesteps) for seed in range(job.episodes)]
    world.reset(tapes * len(EPSILONS))
    epsilon = np.repeat(EPSILONS, job.episodes)
    draws = np.array([tape.steps[:, 0] for (tape,) in tapes * len(EPSILONS)]).T  # (timesteps, B)
    price = np.where(draws < epsilon, OBJECTIVE.random_price, OBJECTIVE.price)
    damage, denied = np.zeros((2, timesteps + 1, size))
    expected = np.full((len(ASKED), size), np.nan)
    for timestep in range(1, timesteps + 1):
        world.step()
        damage[timestep] = world.ledger.damage
        denied[timestep] = world.ledger.totals()["moves_blocked_free"]
        if timestep in ASKED:
            free = np.flatnonzero((world.candle_table >= 0).all(axis=1))
            expected[ASKED.index(timestep), free] = caregiver.expected_damage(world.percept(), free)
    to_come = np.diff(damage, axis=0) + price * np.diff(denied, axis=0)
    for timestep in reversed(range(timesteps - 1)):
        to_come[timestep] += OBJECTIVE.discount * to_come[timestep + 1]
    realised = np.where(np.isnan(expected), np.nan, to_come[list(ASKED)])
    means = (np.ma.masked_invalid(one).mean(axis=0).filled(np.nan) for one in (expected, realised))
    rows = dict(zip(("expected", "realised"), means, strict=True))  # NaN where its hand was never empty
    first = {"house": job.house, "shape": shape_of(job.house), "caregiver": job.caregiver, "epsilon": epsilon}
    return pd.DataFrame(first | rows)


def report(rows: pd.DataFrame) -> str:
    """Return the tables, of means over houses: by shape, and by novice for the caregiver that is told which it is."""
    titles = ("cost expected", "realised", "realised over expected", f"too hopeful by more than {TOO_HOPEFUL - 1:.0%}")
    shapes = [*rows["shape"].unique(), "all"]
    by_shape = [
        (f"{shape} ({one.house.nunique()})", f"`{caregiver}`", *_compared(one))
        for shape in shapes
        for caregiver in CAREGIVERS
        if len(one := rows[(rows.caregiver == caregiver) & ((rows["shape"] == shape) | (shape == "all"))])
    ]
    told = rows[rows.caregiver == "knows-goal"]
    by_novice = [(f"{epsilon:g}", *_compared(told[told.epsilon == epsilon])) for epsilon in EPSILONS]
    head = "`knows-goal`, novice of epsilon"
    return table(("houses", "caregiver", *titles), by_shape) + "\n\n" + table((head, *titles), by_novice)


def _compared(rows: pd.DataFrame) -> tuple[str, ...]:
    rows = rows.dropna()
    expected, realised = ([one.to_numpy() for _, one in rows.groupby("house")[c]] for c in ("expected", "realised"))
    ratio = two_level.of_ratio(realised, expected)
    flag = "yes" if ratio.low > TOO_HOPEFUL else "perhaps" if ratio.value > TOO_HOPEFUL else "no"
    means = (f"{two_level.house_means(one).mean():.3f}" for one in (expected, realised))
    return (*means, f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})", flag)
