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
    """The content of summary.json: every caregiver against none, and the paper's against every other one."""
    from caregiver_mj.experiments import statistics  # needs pandas

    ran = settings.caregivers
    compared = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    compared += [("paper", other) for other in ran if other not in ("none", "paper")] if "paper" in ran else []
    return {
        "rows": statistics.mean_rows(episodes, [column for column in MEASURES if column in episodes]),
        "comparisons": [row for pair in compared for row in statistics.comparison_rows(episodes, *pair)],
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
