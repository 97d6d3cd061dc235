"""Runs what the study needs beside the house's episodes."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.experiments.seeds import episode_random, episode_seed
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.studies.grid_to_house import breakdown
from caregiver_mj.studies.grid_to_house.breakdown import GRID, InGrid, ladder
from caregiver_mj.studies.grid_to_house.handicap import Handicap
from caregiver_mj.studies.grid_to_house.phases import action_time
from caregiver_mj.studies.grid_to_house.results import Results
from caregiver_mj.studies.grid_to_house.rows import Rows, caregiver_of, in_both_worlds
from caregiver_mj.studies.grid_to_house.watch import Watch
from caregiver_mj.studies.trials import run_all
from caregiver_mj.tasks import load

_ROUNDS = 3  # to find how long an action near the child takes: that changes where the caregiver is, by a little

# An episode's damage, its phases, and what its time went into.
Watched = tuple[float, list[dict[str, Any]], Mapping[str, float]]


def measure(rows: Rows, aside: Rows | None, watched: int, many: int, jobs: int) -> Results:
    """Runs everything.

    Args:
        rows: The episodes in the house.
        aside: Those in a house that does not count.
        watched: Episodes in each house with each novice to watch, no more than there are.
        many: Episodes in each house with each novice in the grid for the breakdown.
        jobs: Worker processes.
    """
    settings = rows.settings
    work = [(house, e, i) for house in rows.houses for e in rows.epsilons for i in range(min(watched, rows.episodes))]
    found = run_all(functools.partial(run_watched, settings), work, jobs, "watched in the house")
    phases = pd.DataFrame([phase for _, log, _ in found for phase in log])
    own = rows.damage("house", rows.caregiver)
    same = sum(own.loc[(house, i), e] == damage for (house, e, i), (damage, _, _) in zip(work, found, strict=True))

    seconds = action_time(settings.plans[0])
    few = InGrid(settings, rows.episodes)
    handicaps = _fit(phases, few, rows.houses, seconds, jobs)
    run_levels = functools.partial(InGrid(settings, many).damages, handicaps)
    tables = run_all(run_levels, rows.houses, jobs, "in the grid, handicapped")
    return Results(
        rows=in_both_worlds(rows, jobs),
        aside=in_both_worlds(aside, jobs) if aside else None,
        levels={level: pd.concat([table[level] for table in tables]) for level in handicaps},
        handicaps=handicaps,
        phases=phases,
        seconds=pd.DataFrame([spent for _, _, spent in found]).fillna(0.0),
        same=(int(same), len(work)),
        delays={
            level: breakdown.delay(phases, _phases(few, handicaps[level], rows.houses, jobs), seconds)
            for level in (GRID, "waiting")
        },
    )


def _fit(
    phases: pd.DataFrame, episodes: InGrid, houses: tuple[str, ...], seconds: float, jobs: int
) -> dict[str, Handicap]:
    """The handicaps with which the grid's caregiver takes as long as the robot: `seconds` are those of an action."""
    pace = breakdown.pace(phases)
    handicap = Handicap(once=True, pace=pace)
    for _ in range(_ROUNDS):
        in_grid = _phases(episodes, handicap, houses, jobs)
        handicap = Handicap(True, pace, breakdown.near(phases, in_grid, handicap, seconds))
    return ladder(pace, handicap.near)


def _phases(episodes: InGrid, handicap: Handicap, houses: tuple[str, ...], jobs: int) -> pd.DataFrame:
    return pd.concat(run_all(functools.partial(episodes.phases, handicap), houses, jobs, "phases in the grid"))


def run_watched(settings: Settings, job: tuple[str, float, int]) -> Watched:
    """Runs one episode in the house with the caregiver, by house, epsilon and number."""
    house, epsilon, episode = job
    env, policy, navigator = _house(settings, house, epsilon)
    env.task.reseed(episode_random(episode_seed(settings.seed, episode)))
    timestep = env.reset()
    watch = Watch(env, policy, navigator)
    while not timestep.last():
        action = policy(timestep)
        watch.look()
        timestep = env.step(action)
    watch.finish()
    return float(env.task.outcome()["damage"]), watch.phases, dict(watch.seconds)


@functools.lru_cache(maxsize=1)  # jobs of one house and epsilon follow each other
def _house(settings: Settings, house: str, epsilon: float) -> tuple[Any, CaregiverPolicy, Navigator]:
    plan, kwargs = settings.plan_of[house], {"embodiment": settings.embodiment}
    env = load("supervise", plan, epsilon, random=np.random.RandomState(0), task_kwargs=kwargs)
    return env, CaregiverPolicy(env, caregiver_of(settings), settings.seed), Navigator(plan, env.task.embodiment)
