"""Reads finished runs."""

from __future__ import annotations

import os

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.by_house import by_house
from caregiver_mj.experiments.finished import Finished, read_finished
from caregiver_mj.experiments.settings import FLOOR
from caregiver_mj.viz.report.run import Run


def read_run(folder: str | os.PathLike[str]) -> Run:
    """Reads a finished run.

    Raises:
        CaregiverError: There is none in the folder, or none that a report can be made of.
    """
    found = read_finished(folder)
    caregivers = found.settings.caregivers
    acting = [caregiver for caregiver in caregivers if caregiver not in ("none", FLOOR)]
    if not acting or "none" not in caregivers:
        raise CaregiverError(
            f"a report compares `none` with a caregiver that acts, and the run in '{folder}' has only "
            f"{' and '.join(caregivers)}: add what it lacks with `caregiver-mj evaluate --resume`"
        )
    return Run(
        settings=found.settings,
        families=tuple(map(str, found.settings.families)),
        episodes=found.episodes,
        summary={key: found.summary.get(key, {}) for key in ("harm", "rows", "comparisons", "versions")},
        maps=found.maps,
        caregiver="paper" if "paper" in acting else acting[0],
        by_house=_houses(found) if len(found.settings.plans) > 1 else None,
        seeds=tuple(found.seeds),
    )


def _houses(found: Finished) -> pd.DataFrame:
    """Every house by itself: as the run has left it, if it has."""
    try:
        return pd.read_parquet(found.path / "houses.parquet")
    except (OSError, ValueError):
        return by_house(found.episodes)
