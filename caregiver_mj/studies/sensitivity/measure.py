"""Runs the grid's episodes."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.studies.sensitivity.conditions import CONDITIONS, PAPER, Condition, costs
from caregiver_mj.studies.sensitivity.places import Place
from caregiver_mj.studies.sensitivity.results import Results
from caregiver_mj.studies.trials import run_all


@dataclasses.dataclass(frozen=True)
class Job:
    """All episodes of one condition and epsilon in one house."""

    house: str
    epsilon: float
    condition: Condition
    episodes: int


@dataclasses.dataclass(frozen=True)
class Figures:
    """What is measured of every episode; episode i has the same novice under every condition.

    Attributes:
        collisions: Of each kind, (episodes, kinds), in the order of `recording.ledger.KINDS`.
        toys: Toy bins reached, (episodes,).
        stop_above: Timestep in which the damage, as the caregiver takes it, came above 15, (episodes,); 200 if never.
        stop_at: That in which it came to 15, or above.
        differs: Share of the timesteps at whose end `nearest` would set about something else, (episodes,); zeros but
            for `paper`.
    """

    collisions: np.ndarray
    toys: np.ndarray
    stop_above: np.ndarray
    stop_at: np.ndarray
    differs: np.ndarray

    def damage(self, weights: str) -> np.ndarray:
        """Damage of every episode, if a collision costs so much, (episodes,)."""
        return self.collisions @ costs(weights)


def measure(places: Sequence[Place], jobs: int) -> Results:
    """Runs everything in the grid."""
    work = [
        Job(house, epsilon, condition, place.episodes)
        for place in places
        for house in place.houses
        for condition in CONDITIONS
        for epsilon in EPSILONS
    ]
    found = run_all(run, work, jobs, "in the grid")
    figures = {(job.house, job.condition, job.epsilon): one for job, one in zip(work, found, strict=True)}
    return Results(tuple(places), figures)


def run(job: Job) -> Figures:
    """Runs the episodes of a job: those that `evaluate` runs with seed 0."""
    plan = _load(job.house, job.condition.weights)
    tapes = [episode_tapes(episode_seed(0, episode), 1) for episode in range(job.episodes)]
    caregiver = job.condition.make(plan)
    world = GridWorld(plan, job.epsilon, caregiver, caregiver_actions=job.condition.actions)
    nearest = NearestCaregiver(plan) if job.condition == PAPER else None
    damage, differs = [], np.zeros(job.episodes)

    def look() -> None:
        damage.append(world.ledger.damage)
        if nearest is not None and caregiver is not None:
            percept = world.percept()
            other = caregiver.choose(percept) != nearest.choose(percept)
            differs[:] += other & (percept.holding == NOTHING)

    ledger = world.run(tapes, look)
    courses = np.array(damage)
    return Figures(
        collisions=np.rint(ledger.harm.sum(axis=1) / costs(job.condition.weights)).astype(int),
        toys=ledger.totals()["toys_reached"],
        stop_above=first(courses > DAMAGE_THRESHOLD),
        stop_at=first(courses >= DAMAGE_THRESHOLD),
        differs=differs / EPISODE_TIMESTEPS,
    )


def first(reached: np.ndarray) -> np.ndarray:
    """The first timestep, counted from 1, in which something is so: (timesteps, episodes) to (episodes,); else all."""
    return np.where(reached.any(axis=0), reached.argmax(axis=0) + 1, len(reached))


@functools.lru_cache(maxsize=4)  # jobs in one house follow each other, and plans keep what they have worked out
def _load(house: str, weights: str) -> FloorPlan:
    return FloorPlan.load(house, damage=DamageWeights.parse(weights))
