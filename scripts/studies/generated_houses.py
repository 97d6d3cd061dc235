"""Whether generated houses work: each is made, checked, built, toured by the robot, and lived in for an episode.

On its tour the robot stands in every stairwell and takes every candle to another table, one after the other, while a
child walks about. Then the caregiver `paper` looks after another child for a whole episode.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from rich.console import Console

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.settings import EPSILONS, episode_random
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from study import Parser, Trial, make_console, make_table, mishaps, run_all, seeds, write_json

FIRST = 400_000  # seed of the first house: far from those of the sets, and from those that anything was tried on


@dataclasses.dataclass(frozen=True)
class House(Trial):
    """How a house fared.

    Attributes:
        size: Its rows and columns.
        hazards: How many hazards it has.
        missed: Those that the robot did not get done on its tour, by name.
        tour_seconds: How long the tour took; that of an episode if something was missed.
        tour_strikes: Times that the robot struck the child on it.
        tour_drops: Candles that fell on it.
        epsilon: Of the child of the episode.
        timesteps: Novice timesteps of the episode that were run.
        damage: That the child took in them.
        interventions_done: What the caregiver completed in them.
    """

    size: tuple[int, int]
    hazards: int
    missed: tuple[str, ...]
    tour_seconds: float
    tour_strikes: int
    tour_drops: int
    epsilon: float
    timesteps: int
    damage: float
    interventions_done: int


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


def live_in(seed: int) -> House:
    """Makes the house of a seed, tours it and lives in it."""
    plan = FloorPlan.load(f"house-{seed}")
    epsilon = EPSILONS[seed % len(EPSILONS)]
    tour = _tour(plan, epsilon, seed)
    env = load("supervise", plan, Family.of(epsilon), episode_random(seed))
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep))
    outcome = env.task.outcome()
    return House(
        house=plan.name,
        seed=seed,
        **mishaps(outcome),
        size=(len(plan.rows), len(plan.rows[0])),
        hazards=len(plan.hazards),
        **tour,
        epsilon=epsilon,
        timesteps=env.task.ledger.timestep,
        damage=float(outcome["damage"]),
        interventions_done=int(outcome["interventions_done"]),
    )


class _Tour(TypedDict):
    """What a tour comes to, as fields of a `House`."""

    missed: tuple[str, ...]
    tour_seconds: float
    tour_strikes: int
    tour_drops: int


def _tour(plan: FloorPlan, epsilon: float, seed: int) -> _Tour:
    """Tours the house."""
    env = load("supervise", plan, Family.of(epsilon), episode_random(seed + 1))
    caregiver = Tour(plan)
    policy = CaregiverPolicy(env, caregiver)
    timestep = env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep))
        if not caregiver.left:
            break
    outcome = mishaps(env.task.outcome())
    return {
        "missed": tuple(str(plan.hazards[hazard]) for hazard in caregiver.left),
        "tour_seconds": float(env.physics.time()),
        "tour_strikes": outcome["strikes"],
        "tour_drops": outcome["drops"],
    }


def report(console: Console, houses: Sequence[House]) -> None:
    """Prints what came out."""
    whole = [house for house in houses if house.timesteps == EPISODE_TIMESTEPS]
    toured = [house for house in houses if not house.missed]
    table = make_table("Generated houses", "what", "figure")
    table.add_row("houses made, valid and built", str(len(houses)))
    table.add_row("of them with every episode complete", str(len(whole)))
    table.add_row("of them toured to the last stairwell and candle", str(len(toured)))
    table.add_row("hazards, and those done on the tours", _done(houses))
    table.add_row("seconds of a tour, median and worst", _seconds(toured))
    table.add_row("interventions done in an episode, mean", f"{np.mean([h.interventions_done for h in houses]):.1f}")
    table.add_row(
        "strikes: tours, episodes", f"{sum(h.tour_strikes for h in houses)}, {sum(h.strikes for h in houses)}"
    )
    table.add_row(
        "candles dropped: tours, episodes", f"{sum(h.tour_drops for h in houses)}, {sum(h.drops for h in houses)}"
    )
    console.print(table)
    for house in houses:
        if house.missed or house.timesteps < EPISODE_TIMESTEPS or house.strikes or house.drops or house.tour_strikes:
            console.print(
                f"{house.house}: missed {', '.join(house.missed) or 'nothing'}; {house.timesteps} timesteps; strikes "
                f"{house.tour_strikes}, {house.strikes}; drops {house.tour_drops}, {house.drops}",
                highlight=False,
            )


def _done(houses: Sequence[House]) -> str:
    hazards = sum(house.hazards for house in houses)
    return f"{hazards}, {hazards - sum(len(house.missed) for house in houses)}"


def _seconds(houses: Sequence[House]) -> str:
    found = [house.tour_seconds for house in houses]
    return f"{np.median(found):.0f}, {max(found):.0f}" if found else "none"


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_trials("count", 300, FIRST)


def run(options: argparse.Namespace) -> None:
    """Run the study and print its table."""
    houses = run_all(live_in, seeds(options), options.jobs, "living in houses")
    report(make_console(), houses)
    write_json(options.json, houses)
