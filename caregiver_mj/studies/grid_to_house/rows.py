"""The episodes in the house: those of a finished run, or run here."""

from __future__ import annotations

import dataclasses
import json
import pathlib

import pandas as pd
from rich.console import Console
from rich.progress import Progress

from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.seeds import episode_seed
from caregiver_mj.experiments.settings import EPSILONS, Settings
from caregiver_mj.studies.houses import load_house

CAREGIVERS = ("none", "paper")
WORLDS = ("grid", "house")


@dataclasses.dataclass(frozen=True)
class Rows:
    """Episodes of single novices in several houses, with `CAREGIVERS`.

    Attributes:
        table: A row an episode, with the columns of `episodes.parquet`.
        seed: Seed of the run.
    """

    table: pd.DataFrame
    seed: int

    @property
    def houses(self) -> tuple[str, ...]:
        """Names of the houses."""
        return tuple(sorted(self.table.house.unique()))

    @property
    def epsilons(self) -> tuple[float, ...]:
        """The novices, the most careless one first."""
        return tuple(sorted(self.table.epsilon.unique(), reverse=True))

    @property
    def episodes(self) -> int:
        """Episodes in each house with each novice and caregiver."""
        return int(self.table.episode.max()) + 1

    def damage(self, world: str, caregiver: str) -> pd.DataFrame:
        """Damage in one world: a row a house and episode, a column an epsilon."""
        own = self.table[(self.table.world == world) & (self.table.caregiver == caregiver)]
        return own.pivot(index=["house", "episode"], columns="epsilon", values="damage")[list(self.epsilons)]


def read_rows(folder: pathlib.Path) -> Rows:
    """Reads those of a finished run in the house.

    Raises:
        CaregiverError: It has not got what is needed, or houses that have no name to load them by.
    """
    try:
        table, run = pd.read_parquet(folder / "episodes.parquet"), json.loads((folder / "run.json").read_text("utf-8"))
        rows = Rows(table[table.caregiver.isin(CAREGIVERS) & (table.children == 1)], int(run["seed"]))
    except (OSError, ValueError, KeyError, AttributeError) as error:
        raise CaregiverError(f"'{folder}' holds no finished run: {error}") from error
    _check(rows, folder)
    return rows


def _check(rows: Rows, folder: pathlib.Path) -> None:
    table = rows.table
    wanted = len(rows.houses) * len(rows.epsilons) * (rows.episodes if len(table) else 0)
    if not wanted or any((table.caregiver == name).sum() != wanted for name in CAREGIVERS):
        raise CaregiverError(f"the run in '{folder}' lacks episodes with {' and '.join(CAREGIVERS)}")
    if set(table.world) != {"house"} or any(str(Family.of(e)) not in set(table.family) for e in rows.epsilons):
        raise CaregiverError(f"the run in '{folder}' is not one of novices in the physical house")
    if any(episode_seed(rows.seed, episode) != seed for episode, seed in zip(table.episode, table.seed, strict=True)):
        raise CaregiverError(f"the episodes in '{folder}' have other seeds than the run's own, {rows.seed}, gives")
    for house in rows.houses:
        load_house(house)


def run_rows(houses: tuple[str, ...], world: str, episodes: int, jobs: int, seed: int = 0) -> Rows:
    """Runs them in one world."""
    return Rows(pd.concat([_run(house, world, episodes, jobs, seed, EPSILONS) for house in houses]), seed)


def in_both_worlds(rows: Rows, jobs: int) -> Rows:
    """The house's episodes, and the same in the grid."""
    found = [_run(house, "grid", rows.episodes, jobs, rows.seed, rows.epsilons) for house in rows.houses]
    return dataclasses.replace(rows, table=pd.concat([*found, rows.table], ignore_index=True))


def _run(house: str, world: str, episodes: int, jobs: int, seed: int, epsilons: tuple[float, ...]) -> pd.DataFrame:
    settings = Settings(load_house(house), world, CAREGIVERS, epsilons, episodes, seed)
    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task(f"{world} {house}", total=len(CAREGIVERS) * len(epsilons) * episodes)
        return evaluate(settings, jobs=jobs, progress=lambda done: bar.advance(task, done)).episodes
