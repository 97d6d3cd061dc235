"""What a run's episodes come to: the content of summary.json."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.experiments.versions import versions
from caregiver_mj.recording.record import MEASURES

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


def summarise(settings: Settings, episodes: pd.DataFrame) -> dict[str, Any]:
    """The content of summary.json: every caregiver against none, and the paper's against every other one."""
    from caregiver_mj.experiments import statistics  # needs pandas

    ran = settings.caregivers
    compared = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    compared += [("paper", other) for other in ran if other not in ("none", "paper", FLOOR)] if "paper" in ran else []
    return {
        "rows": statistics.mean_rows(episodes, [column for column in MEASURES if column in episodes]),
        "comparisons": [row for pair in compared for row in statistics.comparison_rows(episodes, *pair)],
        "versions": versions(),
        "seed": settings.seed,
    }
