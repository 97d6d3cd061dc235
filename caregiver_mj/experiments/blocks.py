"""The episodes of a block, run in the grid or in the house: their rows and their maps.

A row depends on nothing but the settings and its own place in them.
"""

from __future__ import annotations

import dataclasses
import functools
import time
from typing import Any

import numpy as np

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.seeds import episode_random, episode_seed, episode_tapes
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.record import EpisodeRecord

MAPS = ("visits", "damage")  # summed for every free cell

# What is measured of every episode, and the maps (`MAPS`) of all of them together.
_Measured = tuple[list[dict[str, Any]], tuple[np.ndarray, np.ndarray]]


def run_block(settings: Settings, block: Block) -> Result:
    """Runs the episodes of a block: their rows, with the columns of `EpisodeRecord` as keys, and their maps."""
    run = _run_in_grid if settings.world == "grid" else _run_in_house
    numbers = range(block.first, block.end)
    seeds = [episode_seed(settings.seed, episode) for episode in numbers]
    outcomes, maps = run(settings, block, seeds)
    rows = [
        EpisodeRecord(
            world=settings.world,
            house=settings.plan.name,
            caregiver=block.caregiver,
            family=str(block.family),
            epsilon=block.family.epsilon,
            children=len(block.family),
            episode=episode,
            seed=seed,
            **measured,
        )
        for episode, seed, measured in zip(numbers, seeds, outcomes, strict=True)
    ]
    return {
        "rows": list(map(dataclasses.asdict, rows)),
        "maps": {name: values.tolist() for name, values in zip(MAPS, maps, strict=True)},
    }


def _run_in_grid(settings: Settings, block: Block, seeds: list[int]) -> _Measured:
    start = time.perf_counter()
    caregiver = make_caregiver(block.caregiver, settings.plan, settings.seed)
    world = GridWorld(settings.plan, block.family, caregiver)
    ledger = world.run([episode_tapes(seed, len(block.family)) for seed in seeds])
    times = {
        "sim_seconds": EPISODE_TIMESTEPS * settings.plan.cell_size / WALKING_SPEED,
        "wall_seconds": (time.perf_counter() - start) / len(seeds),
    }
    return [ledger.outcome(i) | times for i in range(len(seeds))], (ledger.visits, ledger.damage_at)


def _run_in_house(settings: Settings, block: Block, seeds: list[int]) -> _Measured:
    env, policy = _house(settings.plan, block.family, block.caregiver, settings.seed, settings.embodiment)
    measured, visits, damage = [], 0.0, 0.0
    for seed in seeds:
        start = time.perf_counter()
        env.task.reseed(episode_random(seed))
        timestep = env.reset()
        while not timestep.last():
            timestep = env.step(policy(timestep) if policy else np.zeros(env.action_spec().shape))
        times = {"sim_seconds": env.physics.time(), "wall_seconds": time.perf_counter() - start}
        measured.append(env.task.outcome() | times)
        visits, damage = visits + env.task.ledger.visits, damage + env.task.ledger.damage_at
    return measured, (visits, damage)


@functools.lru_cache(maxsize=1)  # blocks of one caregiver and family follow each other
def _house(plan: FloorPlan, family: Family, caregiver: str, seed: int, embodiment: str) -> tuple[Any, Any]:
    """A house, and the policy of the caregiver in it (None for "none"). Building them takes a second."""
    from caregiver_mj import tasks  # here, for the grid does without MuJoCo

    robot = caregiver != "none"
    kwargs = {"robot": robot, "embodiment": embodiment}
    env = tasks.load("supervise", plan, family, np.random.RandomState(0), task_kwargs=kwargs)
    if not robot:
        return env, None
    from caregiver_mj.policy.policy import CaregiverPolicy

    return env, CaregiverPolicy(env, caregiver=caregiver, seed=seed)
