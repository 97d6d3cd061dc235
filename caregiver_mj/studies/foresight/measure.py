"""Runs the variants in the grid."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.children.side_by_side import side_by_side
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.grid.floor import FloorWorld
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set
from caregiver_mj.studies.foresight.variants import FLOOR, made
from caregiver_mj.studies.trials import run_all

COLUMNS = ("damage", "toys_reached", "moves_blocked_free", "interventions")


@dataclasses.dataclass(frozen=True)
class Job:
    """All episodes with one variant in one house."""

    house: str
    variant: str
    episodes: int


def measure(houses: str, episodes: int, jobs: int, names: Iterable[str]) -> pd.DataFrame:
    """Runs variants in every house of a set: a row an episode, with the columns of `episodes.parquet`."""
    work = [Job(plan.name, variant, episodes) for plan in house_set(houses) for variant in names]
    return pd.concat(run_all(run, work, jobs, "variants"), ignore_index=True)


def run(job: Job) -> pd.DataFrame:
    """Runs the episodes of a job: those that `evaluate` runs with seed 0."""
    plan = FloorPlan.load(job.house)
    children = side_by_side(plan, [Family.of(epsilon) for epsilon in EPSILONS], job.episodes)
    tapes = [episode_tapes(episode_seed(0, episode), 1) for episode in range(job.episodes)] * len(EPSILONS)
    is_floor = job.variant == FLOOR
    world = FloorWorld(plan, children) if is_floor else GridWorld(plan, children, made(job.variant, plan))
    totals = world.run(tapes).totals()
    index = {
        "house": job.house,
        "caregiver": job.variant,
        "family": np.repeat([f"{epsilon:g}" for epsilon in EPSILONS], job.episodes),
        "episode": np.tile(np.arange(job.episodes), len(EPSILONS)),
    }
    return pd.DataFrame(index | {name: totals[name] for name in COLUMNS})


def means(rows: pd.DataFrame, columns: Sequence[str] = COLUMNS) -> pd.DataFrame:
    """Means over episodes and houses, a row for each variant and kind of children."""
    return rows.groupby(["caregiver", "family"], sort=False)[list(columns)].mean()
