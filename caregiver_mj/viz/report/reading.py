"""Reads finished runs."""

from __future__ import annotations

import json
import os
import pathlib

import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.by_house import by_house
from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.experiments.summary import summarise
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.viz.report.run import Run


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
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CaregiverError(f"the run in '{folder}' cannot be read: {error}") from error
    caregivers = run.settings.caregivers
    if not {run.caregiver, "none"} <= set(caregivers) or run.caregiver == "none":
        raise CaregiverError(
            f"the run in '{folder}' has {' and '.join(caregivers)}: a report compares `none` with a caregiver"
        )
    wanted = {(caregiver, family) for caregiver in caregivers for family in run.families}
    compared = [row for row in run.summary["comparisons"] if row.get("baseline") == "none"]
    for name, table, who in (
        ("summary.json", pd.DataFrame(run.summary["rows"]), wanted),
        ("summary.json", pd.DataFrame(compared), {(c, family) for c, family in wanted if c != "none"}),
        ("episodes.parquet", run.episodes, wanted),
    ):
        if not {"caregiver", "family"} <= set(table) or set(zip(table.caregiver, table.family, strict=True)) != who:
            raise CaregiverError(f"the run in '{folder}' cannot be read: its {name} is that of another run")
    return run


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
    acting = [caregiver for caregiver in settings.caregivers if caregiver not in ("none", FLOOR)]
    table, houses = path / "houses.parquet", None
    if len(settings.plans) > 1:
        houses = pd.read_parquet(table) if table.is_file() else by_house(episodes)
    return Run(
        settings=settings,
        families=tuple(map(str, settings.families)),
        episodes=episodes,
        summary={key: summary[key] for key in ("rows", "comparisons", "versions")},
        maps=pd.read_parquet(path / "maps.parquet"),
        caregiver="paper" if "paper" in acting else next(iter(acting), "none"),
        by_house=houses,
    )
