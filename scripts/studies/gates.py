"""How surely and how quickly the robot closes gates: trials in generated houses, with a child about.

In every trial the robot starts in a cell, and is told to close a gate that is drawn; half of the children are novices,
and half head for the robot. A trial is done when the gate has latched and the robot has let go of it, within 60 s.
"""

from __future__ import annotations

import argparse
import collections
import functools
import json
import random
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import GATE, NOTHING
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from study import Parser, make_console, make_table, run_all

_LIMIT = 60.0  # seconds
_CHILDREN = ("0.5", "seeker:0.05")


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_trials("count", 500)
    parser.add(
        "houses", [f"house-{seed}" for seed in range(800000, 800010)], "whose stairwells get a gate where they can"
    )
    parser.add("embodiment", None, "the robot (default: the task's own)", metavar="NAME")
    parser.add("sensing", None, "how things are seen, a dictionary in JSON", metavar="JSON")


class Closer(Caregiver):
    """Closes one gate, and then nothing.

    Attributes:
        gate: Number of the hazard.
    """

    gate = NOTHING

    def choose(self, percept: Percept) -> np.ndarray:
        shut = percept.shut is not None and percept.shut[0, self.gate]
        return np.array([NOTHING if shut else self.gate])


def with_gates(plan: FloorPlan) -> FloorPlan:
    """Return a house in which every stairwell has a gate that can have one."""
    for cell in plan.stairwells:
        rows = [list(row) for row in plan.rows]
        rows[cell[0]][cell[1]] = GATE.symbol
        try:
            plan = FloorPlan.parse("\n".join(map("".join, rows)), plan.name)
        except FloorPlanError:
            continue
    return plan


def trial(options: argparse.Namespace, seed: int) -> dict[str, Any]:
    """Run one trial; return what came of it."""
    lots = random.Random(seed)
    plan = with_gates(next(iter(houses_named([options.houses[seed % len(options.houses)]]))))
    kwargs = {"embodiment": options.embodiment, "sensing": json.loads(options.sensing) if options.sensing else None}
    env = load("supervise", plan, lots.choice(_CHILDREN), random=seed, task_kwargs=kwargs, visuals=False)
    closer = Closer(plan)
    closer.gate = lots.randrange(len(plan.landings), len(plan.stairwells))
    policy, touched = CaregiverPolicy(env, closer), collections.Counter[str]()
    names = [env.physics.model.id2name(geom, "geom") for geom in range(env.physics.model.ngeom)]
    step, gate = env.reset(), closer.gate - len(plan.landings)
    while env.physics.time() < _LIMIT and not step.last():
        step = env.step(policy(step))
        for pair in env.physics.data.ptr.contact.geom.tolist():
            one, two = (names[geom] for geom in pair)
            thing = two if one.startswith("robot/") else one if two.startswith("robot/") else ""
            if thing and not thing.startswith("toddler"):
                touched[thing.partition("/")[2] or thing] += 1
        if policy.interventions_done:
            break
    outcome = env.task.outcome()
    latched = bool(env.physics.gates_latched()[gate])
    return {
        "house": plan.name,
        "family": str(env.task.family),
        "done": latched and policy.interventions_done > 0,
        "latched": latched,
        "seconds": env.physics.time(),
        "tries": policy.interventions,
        "touched": dict(touched),
        **{name: outcome[name] for name in ("strikes", "strikes_surface", "contact_speed", "pressings")},
    }


def run(options: argparse.Namespace) -> int:
    """Run the trials, and print what came of them."""
    usable = [plan.name for plan in houses_named(options.houses) if with_gates(plan).mouths]
    options = argparse.Namespace(**(vars(options) | {"houses": usable}))
    seeds = range(options.first, options.first + options.trials)
    found = pd.DataFrame(run_all(functools.partial(trial, options), seeds, options.jobs, "closing gates"))
    if options.json:
        found.to_json(options.json, orient="records", lines=True)
    console = make_console()
    table = make_table(
        "Gates", "child", "trials", "done", "s, median", "s, 95 %", "begun more than once", "strikes", "surface"
    )
    for family, group in [*found.groupby("family"), ("all", found)]:
        done = group[group.done]
        counts = (str(int(group[name].sum())) for name in ("strikes", "strikes_surface"))
        quick = (f"{done.seconds.quantile(share):.1f}" for share in (0.5, 0.95))
        again = f"{int((group.tries > 1).sum())}"
        table.add_row(str(family), str(len(group)), str(len(done)), *quick, again, *counts)
    console.print(table)
    touched = collections.Counter[str]()
    for each in found.touched:
        touched.update(dict.fromkeys(each, 1))
    console.print(f"{len(usable)} houses. Touched by the robot, in so many trials: {dict(touched)}.")
    for _, row in found[~found.done].iterrows():
        console.print(f"not done: {row.house}, {row.family}, latched {row.latched}, begun {row.tries} times")
    return 0
