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
from caregiver_mj.experiments.settings import Settings

RULE = "paper"  # the caregiver if no other is named


@dataclasses.dataclass(frozen=True)
class Rows:
    """Episodes of single novices in several houses, left alone and with one caregiver.

    Attributes:
        table: A row an episode, with the columns of `episodes.parquet`.
        settings: Of the run in the house, with these two caregivers.
    """

    table: pd.DataFrame
    settings: Settings

    @property
    def houses(self) -> tuple[str, ...]:
        """Names of the houses."""
        return tuple(sorted(self.settings.plan_of))

    @property
    def epsilons(self) -> tuple[float, ...]:
        """The novices."""
        return tuple(family.epsilon for family in self.settings.families)

    @property
    def episodes(self) -> int:
        """Episodes in each house with each novice and caregiver."""
        return self.settings.episodes

    @property
    def caregiver(self) -> str:
        """Name of the caregiver."""
        return caregiver_of(self.settings)

    @property
    def cared(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Damage with the caregiver, in the house and in the grid."""
        return self.damage("house", self.caregiver), self.damage("grid", self.caregiver)

    def damage(self, world: str, caregiver: str) -> pd.DataFrame:
        """Damage in one world: a row a house and episode, a column an epsilon."""
        own = self.table[(self.table.world == world) & (self.table.caregiver == caregiver)]
        return own.pivot(index=["house", "episode"], columns="epsilon", values="damage")[list(self.epsilons)]


def caregiver_of(settings: Settings) -> str:
    """Name of the caregiver that a run is about, beside children left alone."""
    return next(name for name in settings.caregivers if name != "none")


def read_rows(folder: pathlib.Path, caregiver: str = RULE) -> Rows:
    """Reads those of a finished run in the house: of children left alone, and with a caregiver.

    Raises:
        CaregiverError: It has not got what is needed.
    """
    names = ("none", caregiver)
    try:
        table, run = pd.read_parquet(folder / "episodes.parquet"), json.loads((folder / "run.json").read_text("utf-8"))
        settings = dataclasses.replace(Settings.of_record(run), caregivers=names)
        rows = Rows(table[table.caregiver.isin(names)], settings)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CaregiverError(f"'{folder}' holds no finished run: {error}") from error
    wanted = len(settings.plans) * len(settings.families) * settings.episodes
    if any((rows.table.caregiver == name).sum() != wanted for name in names):
        raise CaregiverError(f"the run in '{folder}' lacks episodes with {' and '.join(names)}")
    if settings.world != "house" or any(family != Family.of(family.epsilon) for family in settings.families):
        raise CaregiverError(f"the run in '{folder}' is not one of single novices in the physical house")
    seeds = rows.table.episode.map(lambda episode: episode_seed(settings.seed, episode))
    if (seeds != rows.table.seed).any():
        raise CaregiverError(f"the episodes in '{folder}' have other seeds than those of its run")
    return rows


def run_rows(settings: Settings, jobs: int) -> Rows:
    """Runs them."""
    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task(f"{settings.world} {settings.place}", total=sum(map(len, settings.blocks())))
        return Rows(evaluate(settings, jobs=jobs, progress=lambda done: bar.advance(task, done)).episodes, settings)


def in_both_worlds(rows: Rows, jobs: int) -> Rows:
    """The house's episodes, and the same in the grid."""
    grid = run_rows(dataclasses.replace(rows.settings, world="grid"), jobs)
    return dataclasses.replace(rows, table=pd.concat([grid.table, rows.table], ignore_index=True))
