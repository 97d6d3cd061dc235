"""Whether generated houses work: made, checked, built, toured by the robot, lived in, and driven about in wildly.

On its tour the robot stands in every stairwell and takes every candle to another table, one after the other, while a
child walks about. Then the caregiver `paper` looks after another child for a whole episode.

At last a robot gets wild actions, in each task and with each robot in turn, in every second trial in the home of the
same seed, if that has what every task needs. An action is held for up to a second; each of its numbers is an end of its
range or drawn from it. The child walks on, but nothing touches it. What MuJoCo warns of, numbers that are not finite, a
base off the house or in a wall, and what is under the floor are counted, and the episode begins anew.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from dm_control.rl.control import PhysicsError
from rich.console import Console

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.spec import episode_random
from caregiver_mj.house.physics import Physics
from caregiver_mj.interventions.verb import BLOCK, RELOCATE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.layout import Layout
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS, load
from study import Parser, make_console, make_table, mishaps, run_trials, write_json

FIRST = 400_000  # seed of the first house: far from those of the sets, and from those that anything was tried on
WRONG = ("warnings", "not_finite", "escapes")  # what wild actions can come to
_HELD = 50  # control timesteps for which one is held, at most
_DEEP = 0.05  # metres below the floor


class Tour(Caregiver):
    """Blocks every stairwell and relocates every candle once, the first that is left and within reach.

    Attributes:
        left: Hazards still to do.
    """

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.left = list(range(len(self.plan.hazards)))

    def choose(self, percept: Percept) -> np.ndarray:
        self.left = [hazard for hazard in self.left if not self._is_done(hazard, percept)]
        barred = percept.out_of_reach
        in_reach = [hazard for hazard in self.left if barred is None or not barred[0, hazard]]
        return np.array([in_reach[0] if in_reach else NOTHING])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Of the bare tables the farthest from the child, but not the one that the candle comes from."""
        bare = bare_tables(percept.candle_table, len(self.plan.tables))
        bare[0, self.plan.candle_tables[candle[0]]] = False
        return np.where(bare, self.table_distances[percept.child_cell].min(axis=1), -np.inf).argmax(axis=1)

    def _is_done(self, hazard: int, percept: Percept) -> bool:
        hazards = self.plan.hazards
        if hazards.are_at(Where.OPENING, hazard):
            landing = len(self.plan.free_cells) + hazards.among(Where.OPENING, hazard)
            return bool(percept.caregiver_cell[0] == landing)
        candle = hazards.among(Where.ON_TABLE, hazard)
        return percept.candle_table[0, candle] not in (NOTHING, self.plan.candle_tables[candle])


def live_in(seed: int, minutes: float) -> dict[str, Any]:
    """Make the house of a seed, tour it, live in it, and drive about wildly for some minutes.

    Returns:
        A row: the house's `size` and number of `hazards`; those `missed` on the tour, by name, and its seconds, strikes
        and drops; of the episode the child's `epsilon`, the novice `timesteps` and what came out; and in what `wild`
        actions were given, with the seconds at which something of `WRONG` was found.
    """
    plan = FloorPlan.load(f"house-{seed}")
    epsilon = EPSILONS[seed % len(EPSILONS)]
    caregiver = Tour(plan)
    toured = _play(plan, epsilon, episode_random(seed + 1), caregiver)
    tour = {f"tour_{what}": count for what, count in mishaps(toured.task.outcome()).items()}
    env = _play(plan, epsilon, episode_random(seed))
    outcome = env.task.outcome()
    return {
        "house": plan.name,
        "seed": seed,
        **mishaps(outcome),
        "size": (len(plan.rows), len(plan.rows[0])),
        "hazards": len(plan.hazards),
        "missed": tuple(str(plan.hazards[hazard]) for hazard in caregiver.left),
        "tour_seconds": float(toured.physics.time()),
        **tour,
        "epsilon": epsilon,
        "timesteps": env.task.ledger.timestep,
        "damage": float(outcome["damage"]),
        "interventions_done": int(outcome["interventions_done"]),
        **drive_wildly(seed, 60.0 * minutes),
    }


def _play(plan: FloorPlan, epsilon: float, random: np.random.RandomState, tour: Tour | None = None) -> Any:
    """Run an episode, or a tour to its end; return its environment."""
    env = load("supervise", plan, ChildGroup.of(epsilon), random)
    policy = CaregiverPolicy(env, tour) if tour else CaregiverPolicy(env)
    timestep = env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep))
        if tour and not tour.left:
            break
    return env


def drive_wildly(seed: int, seconds: float) -> dict[str, Any]:
    """Drive about wildly; return where, and at which seconds each of `WRONG` was found."""
    plan = FloorPlan.load(f"{'home' if seed % 2 else 'house'}-{seed}")
    if not {BLOCK, RELOCATE} <= {*plan.hazards.verb}:
        plan = FloorPlan.load(f"house-{seed}")
    task, robot = [*TASKS][seed // 2 % len(TASKS)], [*EMBODIMENTS][seed // 2 // len(TASKS) % len(EMBODIMENTS)]
    env = load(task, plan, EPSILONS[2], seed, task_kwargs={"embodiment": robot})
    spec, random, timestep = env.action_spec(), np.random.default_rng(seed), env.control_timestep()
    for geom in env.physics.touch_reader.bodies:
        env.physics.model.geom_contype[geom] = env.physics.model.geom_conaffinity[geom] = 0
    found: dict[str, list[float]] = {what: [] for what in WRONG}
    layout, now = Layout(plan), 0
    env.reset()
    while now * timestep < seconds:
        ends = np.where(random.random(spec.shape) < 0.5, spec.minimum, spec.maximum)
        action = np.where(random.random(spec.shape) < 0.5, ends, random.uniform(spec.minimum, spec.maximum))
        try:
            for _ in range(random.integers(1, _HELD + 1)):
                now += 1
                env.step(action)
            what = is_wrong(layout, env.physics)
        except PhysicsError:
            what = "warnings"
        if what:
            found[what].append(round(now * timestep, 2))
            env.reset()
    return {"wild": f"{plan.name}, {task}, {robot}", **found}


def is_wrong(layout: Layout, physics: Physics) -> str:
    """Return what is wrong with the state, one of `WRONG`, or nothing."""
    if not np.isfinite([*physics.data.qpos, *physics.data.qvel]).all():
        return "not_finite"
    base, plan, walls = physics.base_position()[:2], layout.plan, layout.walls
    heights = np.concatenate([physics.candle_poses()[:, 2], physics.thing_positions()[:, 2]])
    in_wall = (np.abs(base - walls[:, :2]) < walls[:, 2:]).all(axis=1).any()
    outside = (np.abs(base) > np.array(plan.shape[::-1]) * plan.cell_size / 2).any()
    return "escapes" if outside or in_wall or (heights < -_DEEP).any() else ""


def report(console: Console, rows: pd.DataFrame) -> None:
    """Prints what came out."""
    toured, missed = rows.missed.map(len) == 0, int(rows.missed.map(len).sum())
    seconds, hazards = rows.tour_seconds[toured], rows.hazards.sum()
    whole = rows.timesteps == EPISODE_TIMESTEPS
    table = make_table("Generated houses", "what", "figure")
    for what, figure in {
        "houses made, valid and built": len(rows),
        "of them with every episode complete": whole.sum(),
        "of them toured to the last stairwell and candle": toured.sum(),
        "hazards, and those done on the tours": f"{hazards}, {hazards - missed}",
        "seconds of a tour, median and worst": f"{seconds.median():.0f}, {seconds.max():.0f}"
        if len(seconds)
        else "none",
        "interventions done in an episode, mean": f"{rows.interventions_done.mean():.1f}",
        "strikes: tours, episodes": f"{rows.tour_strikes.sum()}, {rows.strikes.sum()}",
        "candles dropped: tours, episodes": f"{rows.tour_drops.sum()}, {rows.drops.sum()}",
        "wild actions: warnings, not finite, escapes": ", ".join(str(rows[what].map(len).sum()) for what in WRONG),
    }.items():
        table.add_row(what, str(figure))
    console.print(table)
    wrong = ~toured | ~whole | (rows[["strikes", "drops", "tour_strikes"]] > 0).any(axis=1)
    wrong |= rows[list(WRONG)].map(len).any(axis=1)
    for row in rows[wrong].itertuples():
        console.print(
            f"{row.house}: missed {', '.join(row.missed) or 'nothing'}; {row.timesteps} timesteps; strikes "
            f"{row.tour_strikes}, {row.strikes}; drops {row.tour_drops}, {row.drops}; {row.wild}: "
            f"{', '.join(f'{what} at {getattr(row, what)}' for what in WRONG if getattr(row, what)) or 'nothing'}",
            highlight=False,
        )
    print(
        f"{toured.sum()} of {len(rows)} houses toured, {hazards - missed} of {hazards} hazards reached; "
        f"{rows.tour_strikes.sum() + rows.strikes.sum()} strikes, {rows.tour_drops.sum() + rows.drops.sum()} drops"
    )


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_trials("count", 300, FIRST)
    parser.add("wild", 60.0, "minutes of wild actions in each")


def run(options: argparse.Namespace) -> None:
    """Run the study and print its table."""
    houses = run_trials(functools.partial(live_in, minutes=options.wild), options, "living in houses")
    report(make_console(), houses)
    write_json(options.json, houses)
