"""What a run's episodes come to: its rows and maps as tables, and the content of summary.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from caregiver_mj.experiments.blocks import MAPS
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.experiments.versions import versions
from caregiver_mj.recording.record import MEASURES

if TYPE_CHECKING:
    import pandas as pd  # imported where used: workers, and commands that only read a plan, do without


def summarise(settings: Settings, episodes: pd.DataFrame) -> dict[str, Any]:
    """The content of summary.json."""
    from caregiver_mj.experiments import statistics  # scipy.stats takes a second to import

    pairs = [(caregiver, "none") for caregiver in settings.caregivers if caregiver != "none"]
    pairs += [("paper", baseline) for baseline in settings.caregivers if baseline not in ("none", "paper")]
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


def episodes_of(results: Mapping[Block, Result]) -> pd.DataFrame:
    """All rows of some blocks, in their order."""
    import pandas as pd

    return pd.DataFrame([row for result in results.values() for row in result["rows"]])


def maps_of(settings: Settings, results: Mapping[Block, Result]) -> pd.DataFrame:
    """The maps of each caregiver and family, summed over their blocks: a row for every free cell."""
    import pandas as pd

    sums: dict[tuple[str, Any], np.ndarray] = {}  # each (maps, free cells)
    for block, result in results.items():
        key = block.caregiver, block.family
        sums[key] = sums.get(key, 0) + np.array([result["maps"][name] for name in MAPS])
    row, column = np.array(settings.plan.free_cells).T
    tables = []
    for (caregiver, family), (visits, damage) in sums.items():
        what = {"world": settings.world, "house": settings.plan.name, "caregiver": caregiver}
        what |= {"family": str(family), "epsilon": family.epsilon}
        tables.append(pd.DataFrame(what | {"row": row, "column": column, "visits": visits, "damage": damage}))
    return pd.concat(tables, ignore_index=True)
