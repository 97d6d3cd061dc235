"""What a run's episodes come to: the content of summary.json."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.experiments.versions import versions
from caregiver_mj.recording.record import MEASURES

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


def summarise(settings: Settings, episodes: pd.DataFrame, houses: pd.DataFrame) -> dict[str, Any]:
    """The content of summary.json: every caregiver against none, and the paper's against every other one.

    Args:
        settings: What ran.
        episodes: A row an episode.
        houses: A row for each house, caregiver and family, as `by_house` has them.
    """
    from caregiver_mj.experiments import statistics  # need pandas
    from caregiver_mj.experiments.harm import harm

    ran = settings.caregivers
    against_none = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    others = [("paper", other) for other in ran if other not in ("none", "paper", FLOOR)] if "paper" in ran else []
    return {
        "harm": harm(houses),
        "rows": statistics.mean_rows(episodes, [column for column in MEASURES if column in episodes]),
        "comparisons": [
            row
            for together in (against_none, others)
            for row in statistics.judged_together(
                [row for pair in together for row in statistics.comparison_rows(episodes, *pair)]
            )
        ],
        "versions": versions(),
        "seed": settings.seed,
    }
