"""How surely and how quickly the robot closes gates, or picks up batteries: trials in generated houses, with a child.

In every trial the robot starts in a cell and has to close a random gate, or to pick up a battery that lies on a free
cell. Half of the children are novices, and half head for the robot. A trial succeeds if the robot finishes within 60 s.
With a battery in its tray the robot then goes to block a stairwell, and must not lose the battery. Trials that end
because the child has taken the battery count apart.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import math
import random
from typing import Any

import numpy as np

from caregiver_mj.caregivers import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import BATTERY, GATE, NOTHING, HazardKind, State, Where
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.skills import PickUp
from caregiver_mj.tasks import load
from studies.relocations import Touches
from study import Parser, make_console, make_table, run_trials, write_json

_LIMIT, _DRIVEN = 60.0, 15.0  # seconds, and those that it drives with what it has picked up
_TOLD = ("stays", "taken", "begun", "tries")  # of a trial that went wrong
_CHILDREN = ("0.5", "seeker:0.05")


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_trials("count", 500)
    parser.add(
        "houses",
        [f"house-{seed}" for seed in range(800000, 800010)],
        "whose stairwells get a gate where they can, or a floor a battery",
    )
    parser.add("batteries", False, "instead, pick batteries up")
    parser.add("embodiment", None, "the robot (default: the task's own)", metavar="NAME")
    parser.add("sensing", None, "how things are seen, a dictionary in JSON", metavar="JSON")


class Errand(Caregiver):
    """Does what there is to do about one hazard, and then blocks a stairwell, if there is one without a gate.

    Attributes:
        hazard: Its number.
    """

    hazard = NOTHING
    takes_orders = True

    def choose(self, percept: Percept) -> np.ndarray:
        shut, gone = (None if seen is None else seen[0] for seen in (percept.shut, percept.gone))
        openings, _, lying = self.plan.hazards.split(np.arange(len(self.plan.hazards)))
        done = [*openings[shut if shut is not None else []], *lying[gone if gone is not None else []]]
        return np.array([self.hazard if self.hazard not in done else 0 if self.plan.landings else NOTHING])


def with_gates(plan: FloorPlan) -> FloorPlan:
    """Return a house in which every stairwell has a gate that can have one."""
    for cell in plan.stairwells:
        with contextlib.suppress(FloorPlanError):
            plan = _with(plan, cell, GATE)
    return plan


def with_battery(plan: FloorPlan, lots: random.Random) -> FloorPlan:
    """Return a house in which a battery lies on a free cell."""
    return _with(plan, lots.choice(plan.free_cells), BATTERY)


def _with(plan: FloorPlan, cell: Cell, kind: HazardKind) -> FloorPlan:
    rows = [list(row) for row in plan.rows]
    rows[cell[0]][cell[1]] = kind.symbol
    return FloorPlan.parse("\n".join(map("".join, rows)), plan.name)


def trial(options: argparse.Namespace, seed: int) -> dict[str, Any]:
    """Run one trial; return what came of it."""
    lots = random.Random(seed)
    plan = next(iter(houses_named([options.houses[seed % len(options.houses)]])))
    plan = with_battery(plan, lots) if options.batteries else with_gates(plan)
    kwargs = {"embodiment": options.embodiment, "sensing": json.loads(options.sensing) if options.sensing else None}
    env = load("supervise", plan, lots.choice(_CHILDREN), random=seed, task_kwargs=kwargs, visuals=False)
    errand = Errand(plan)
    if options.batteries:
        errand.hazard = plan.hazards.number(Where.FLOOR, 0)
    else:
        errand.hazard = lots.randrange(len(plan.landings), len(plan.stairwells))
    policy, touches = CaregiverPolicy(env, errand), Touches(env.physics)
    step, until, tries, seconds = env.reset(), _LIMIT, 0, math.nan
    while env.physics.time() < until and not step.last() and not env.task.outcome()["damage_battery"]:
        step = env.step(policy(step))
        touches.look()
        skill = policy.executive.routine.skill if policy.executive.routine else None
        tries = max(tries, skill.tries if isinstance(skill, PickUp) else 0)
        is_done = policy.executive.done and env.task.children.state[errand.hazard] != State.AS_PLANNED
        if is_done and math.isnan(seconds):
            seconds = env.physics.time()
            until = seconds + (_DRIVEN if options.batteries else 0.0)
    outcome = env.task.outcome()
    return {
        "house": plan.name,
        "seed": seed,
        "family": str(env.task.family),
        "done": not math.isnan(seconds),
        "stays": bool(env.task.children.state[errand.hazard] != State.AS_PLANNED),
        "taken": bool(outcome["damage_battery"]),
        "seconds": seconds,
        "begun": policy.executive.begun,
        "tries": tries,
        "touched": sorted({thing for part, thing in touches.pairs if part.startswith("robot/")}),
        **{name: outcome[name] for name in ("strikes", "strikes_surface", "contact_speed", "pressings")},
    }


def run(options: argparse.Namespace) -> None:
    """Run the trials, and print what came of them."""
    usable = [plan.name for plan in houses_named(options.houses) if options.batteries or with_gates(plan).mouths]
    options = argparse.Namespace(**(vars(options) | {"houses": usable}))
    what = "batteries" if options.batteries else "gates"
    found = run_trials(functools.partial(trial, options), options, what)
    write_json(options.json, found)
    console = make_console()
    counted = {"taken by the child": found.taken, "begun again": found.begun > 1 + found.done * options.batteries}
    counted |= {"gripped again": found.tries > 1, "not so in the end": found.done & ~found.stays}
    found = found.assign(**counted)
    heads = ("child", "trials", "done", "s, median", "s, 95 %", *counted, "strikes", "strikes_surface")
    table = make_table(what.capitalize(), *heads)
    for family, group in [*found.groupby("family"), ("all", found)]:
        quick = (f"{group.seconds.quantile(share):.1f}" for share in (0.5, 0.95))
        counts = (str(int(group[name].sum())) for name in heads[5:])
        table.add_row(str(family), str(len(group)), str(int(group.done.sum())), *quick, *counts)
    console.print(table)
    touched = found.touched.explode().value_counts().to_dict()
    console.print(f"{len(usable)} houses. Touched by the robot, in so many trials: {touched}.")
    for row in found[~found.done | ~found.stays].to_dict("records"):
        console.print(f"not done: seed {row['seed']}, {row['house']}, {row['family']}", {n: row[n] for n in _TOLD})
    tried = found[~found.taken]
    print(
        f"{tried.done.sum()} of {len(tried)} {what} done, in {tried.seconds.median():.1f} s (median); "
        f"{found.strikes.sum():.0f} strikes, {found.strikes_surface.sum():.0f} by the stricter count"
    )
