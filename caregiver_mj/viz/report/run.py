"""A finished run, as read from its folder."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import shlex
from typing import Any

import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.experiments.summary import summarise
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.viz.report import words

_WORLDS = {"grid": "Grid", "house": "Physical house"}


@dataclasses.dataclass(frozen=True)
class Run:
    """A finished run.

    Attributes:
        settings: What ran.
        families: The children, a family after the other, as text: "0.5", or "1,0.25".
        episodes: A row an episode.
        summary: What matters of the content of summary.json.
        maps: A row for each caregiver, family and free cell.
        caregiver: The caregiver that the report is about: `paper` if it ran.
    """

    settings: Settings
    families: tuple[str, ...]
    episodes: pd.DataFrame
    summary: dict[str, Any]
    maps: pd.DataFrame
    caregiver: str

    @property
    def plan(self) -> FloorPlan:
        """The house."""
        return self.settings.plan

    @property
    def name(self) -> str:
        """Tells the run from others, in file names."""
        world, house = self.settings.world, self.plan.name.replace("/", "-")
        return world if house == "paper" else f"{world}_{house}"

    @property
    def title(self) -> str:
        world = _WORLDS[self.settings.world]
        return world if self.plan.name == "paper" else f"{world} ({self.plan.name})"

    @property
    def several(self) -> bool:
        """Whether there is more than one child in any of its families."""
        return any(len(words.members(family)) > 1 for family in self.families)

    @property
    def nouns(self) -> words.Nouns:
        """What its children are called."""
        return words.SEVERAL if self.several else words.SINGLE

    @property
    def baselines(self) -> tuple[str, ...]:
        """The other caregivers that do something."""
        return tuple(c for c in self.settings.caregivers if c not in ("none", FLOOR, self.caregiver))

    def row(self, caregiver: str, family: str) -> dict[str, Any]:
        """The summary's row of a caregiver and a family."""
        return next(r for r in self.summary["rows"] if (r["caregiver"], r["family"]) == (caregiver, family))

    def comparison(self, caregiver: str, baseline: str, family: str) -> dict[str, Any] | None:
        """The summary's comparison of two caregivers with a family, if it has one."""
        wanted = (caregiver, baseline, family)
        rows = self.summary["comparisons"]
        return next((r for r in rows if (r["caregiver"], r["baseline"], r["family"]) == wanted), None)

    def mean(self, caregiver: str, column: str) -> float:
        """Mean over all episodes of all families."""
        return float(self.episodes.loc[self.episodes.caregiver == caregiver, column].mean())

    def command(self) -> str:
        """The command that gives the same rows again."""
        settings = self.settings
        command = ["caregiver-mj", "evaluate", "--world", settings.world, "--house", _asked_house(self.plan)]
        if self.plan.damage != DamageWeights():
            command += ["--damage", str(self.plan.damage)]
        if settings.embodiment != DEFAULT:
            command += ["--embodiment", settings.embodiment]
        command += ["--caregiver", *settings.caregivers, "--epsilon", *self.families]
        return shlex.join([*command, "--episodes", str(settings.episodes), "--seed", str(settings.seed)])


def read_run(folder: str | os.PathLike[str]) -> Run:
    """Reads a finished run.

    Raises:
        CaregiverError: There is none in the folder, or none that a report can be made of.
    """
    path = pathlib.Path(folder)
    if not (path / "run.json").is_file():
        raise CaregiverError(f"'{folder}' holds no run: `caregiver-mj evaluate --out DIR` makes one")
    if not (path / "summary.json").is_file():
        raise CaregiverError(f"the run in '{folder}' is not finished: go on with `caregiver-mj evaluate --resume`")
    if not (path / "maps.parquet").is_file():
        raise CaregiverError(f"the run in '{folder}' has no maps.parquet, as runs of an older version: run it again")
    try:
        run = _read(path)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CaregiverError(f"the run in '{folder}' cannot be read: {error}") from error
    caregivers = run.settings.caregivers
    if not {run.caregiver, "none"} <= set(caregivers) or run.caregiver == "none":
        raise CaregiverError(
            f"the run in '{folder}' has {' and '.join(caregivers)}: a report compares `none` with a caregiver"
        )
    return run


def _asked_house(plan: FloorPlan) -> str:
    """What to call a house on the command line: by its name if that gives it, else by that of a file."""
    try:
        return plan.name if FloorPlan.load(plan.name).rows == plan.rows else f"{plan.name}.txt"
    except CaregiverError:
        return f"{plan.name}.txt"


def _read(path: pathlib.Path) -> Run:
    record, summary = (json.loads((path / f"{name}.json").read_text("utf-8")) for name in ("run", "summary"))
    # Runs of an older version have single novices, the paper's damages, and the one robot that there was.
    record.setdefault("families", [str(Family.of(epsilon)) for epsilon in record.get("epsilons", ())])
    record.setdefault("damage", str(DamageWeights()))
    record.setdefault("embodiment", DEFAULT)
    if "plan" in record:  # there was only one
        plan = {"name": record["house"], "cell_size": record["cell_size"], "rows": record["plan"]}
        record |= {"plans": [plan], "houses": ""}
    for row in [*summary["rows"], *summary["comparisons"]]:
        row.setdefault("family", str(Family.of(row["epsilon"])))
    settings, episodes = Settings.of_record(record), pd.read_parquet(path / "episodes.parquet")
    if "family" not in episodes:
        episodes["family"] = [str(Family.of(epsilon)) for epsilon in episodes["epsilon"]]
    if any("damage_verdict" not in row for row in summary["comparisons"]):  # it has other statistics
        summary |= {key: summarise(settings, episodes)[key] for key in ("rows", "comparisons")}
    caregivers = settings.caregivers
    return Run(
        settings=settings,
        families=tuple(map(str, settings.families)),
        episodes=episodes,
        summary={key: summary[key] for key in ("rows", "comparisons", "versions")},
        maps=pd.read_parquet(path / "maps.parquet"),
        caregiver="paper"
        if "paper" in caregivers
        else next((c for c in caregivers if c not in ("none", FLOOR)), "none"),
    )
