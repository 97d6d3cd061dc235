"""Runs the episodes in both worlds."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.experiments.blocks import run_block
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.seeds import episode_random, episode_seed
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.record import names
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.studies.grid_to_house.grid import grid_delays
from caregiver_mj.studies.grid_to_house.results import EPSILONS, Results
from caregiver_mj.studies.grid_to_house.watch import Watch
from caregiver_mj.studies.trials import run_all
from caregiver_mj.tasks import load

_REFERENCE = 2000  # episodes in the grid, to say how lucky the few are

# An episode's figures, its phases, and what its time went into.
_Watched = tuple[dict[str, float], list[dict[str, Any]], Mapping[str, float]]


def measure(house: str, episodes: int, jobs: int) -> Results:
    """Runs everything."""
    plan, many = FloorPlan.load(house), max(episodes, _REFERENCE)
    grid = _run_grid(plan, episodes)
    damage = _run_grid(plan, many).groupby(["caregiver", "epsilon"]).damage.mean()
    work = [(epsilon, episode) for epsilon in EPSILONS for episode in range(episodes)]
    found = run_all(functools.partial(run_watched, plan), work, jobs, "in the house, with the caregiver")
    watched = dict(zip(work, found, strict=True))
    alone = _run_alone(plan, episodes, jobs)
    return Results(
        episodes=episodes,
        alone={e: (_of(grid, "none", e).damage.to_numpy(), _of(alone, "none", e).damage.to_numpy()) for e in EPSILONS},
        grid={e: _of(grid, "paper", e) for e in EPSILONS},
        house={e: pd.DataFrame([watched[e, i][0] for i in range(episodes)]) for e in EPSILONS},
        many=many,
        reference={e: damage["paper", e] / damage["none", e] for e in EPSILONS},
        phases=pd.DataFrame([phase for _, phases, _ in found for phase in phases]),
        seconds=pd.DataFrame([seconds for _, _, seconds in found]).fillna(0.0),
        grid_delays=grid_delays(plan, EPSILONS, episodes),
    )


def run_watched(plan: FloorPlan, job: tuple[float, int]) -> _Watched:
    """Runs one episode, by epsilon and number, in the house with the caregiver."""
    epsilon, episode = job
    env, policy, navigator = _house(plan, epsilon)
    env.task.reseed(episode_random(episode_seed(0, episode)))
    timestep = env.reset()
    watch = Watch(env, policy, navigator)
    while not timestep.last():
        action = policy(timestep)
        watch.look()
        timestep = env.step(action)
    watch.finish()
    outcome = {name: float(env.task.outcome()[name]) for name in names("damage")}
    return outcome | {"done": policy.interventions_done}, watch.phases, dict(watch.seconds)


@functools.lru_cache(maxsize=1)  # jobs of one epsilon follow each other
def _house(plan: FloorPlan, epsilon: float) -> tuple[Any, CaregiverPolicy, Navigator]:
    env = load("supervise", plan, epsilon, random=np.random.RandomState(0))
    return env, CaregiverPolicy(env), Navigator(plan, env.task.embodiment)


def _run_grid(plan: FloorPlan, episodes: int) -> pd.DataFrame:
    """The same episodes in the grid, without and with the caregiver."""
    return evaluate(Settings(plan, "grid", families=EPSILONS, episodes=episodes)).episodes


def _run_alone(plan: FloorPlan, episodes: int, jobs: int) -> pd.DataFrame:
    """The same episodes in the house, without the caregiver."""
    settings = Settings(plan, "house", ("none",), EPSILONS, episodes)
    found = run_all(functools.partial(run_block, settings), settings.blocks(), jobs, "in the house, alone")
    return pd.DataFrame([row for block in found for row in block["rows"]])


def _of(table: pd.DataFrame, caregiver: str, epsilon: float) -> pd.DataFrame:
    """The rows of a caregiver and epsilon, by episode."""
    rows = table[(table.caregiver == caregiver) & (table.epsilon == epsilon)].sort_values("episode")
    return rows.rename(columns={"interventions_done": "done"})
