"""What a run's episodes come to: the content of summary.json."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.experiments.versions import versions
from caregiver_mj.recording.record import MEASURES

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


def summarise(settings: Settings, episodes: pd.DataFrame) -> dict[str, Any]:
    """The content of summary.json."""
    from caregiver_mj.experiments import statistics  # scipy.stats takes a second to import

    pairs = [(caregiver, "none") for caregiver in settings.caregivers if caregiver != "none"]
    pairs += [("paper", baseline) for baseline in settings.caregivers if baseline not in ("none", "paper", FLOOR)]
    return {
        "rows": statistics.summarise(episodes, MEASURES),
        "comparisons": [
            row
            for caregiver, baseline in pairs
            if {caregiver, baseline} <= set(settings.caregivers)
            for row in statistics.compare(episodes, caregiver, baseline)
        ],
        "versions": versions(),
        "seed": settings.seed,
    }
