"""What a run's episodes come to: the content of summary.json."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import harm
from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.experiments.provenance import versions
from caregiver_mj.experiments.settings import FLOOR, Settings
from caregiver_mj.recording.record import MEASURES

_KEYS = ["world", "house", "caregiver", "family", "epsilon"]


def summarise(settings: Settings, episodes: pd.DataFrame, houses: pd.DataFrame) -> dict[str, Any]:
    """Return the content of summary.json: every caregiver against none, and the paper's against every other one.

    Args:
        settings: What ran.
        episodes: A row an episode.
        houses: A row for each house, caregiver and family, as `by_house` has them.
    """
    from caregiver_mj.experiments import statistics  # need pandas
    from caregiver_mj.experiments.harm import harm

    ran = settings.caregivers
    against_none = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    others = [(rule, other) for rule in RULE if rule in ran for other in ran if other not in ("none", *RULE, FLOOR)]
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


def by_house(episodes: pd.DataFrame) -> pd.DataFrame:
    """Return what each caregiver comes to in each house.

    Args:
        episodes: A row an episode.

    Returns:
        A row for each world, house, caregiver and family: `episodes`, how many, the mean of each of `MEASURES` that
        there is, and `damage_left`, the ratio of mean damage to that of `none`, with `damage_left_ci_low` and
        `_ci_high`; then what tells whether the caregiver does harm (see `harm`): `harm.COLUMNS`, `harm_p_holm` and
        `harm_verdict`. These are NaN ("") for `none` itself, and a ratio is where there is none; an end is infinite
        where the episodes give none.

    Raises:
        CaregiverError: An episode has no counterpart without a caregiver.
    """
    groups = episodes.sort_values("episode", kind="stable").groupby(_KEYS, sort=False)
    table = groups[[column for column in MEASURES if column in episodes]].mean()
    table.insert(0, "episodes", groups.size())
    order = pd.MultiIndex.from_frame(episodes[_KEYS].drop_duplicates())
    columns = ["damage_left", "damage_left_ci_low", "damage_left_ci_high", *harm.COLUMNS]
    against = pd.DataFrame(np.nan, table.index, columns)
    for keys, (ours, theirs) in _alike(groups):
        against.loc[keys] = np.column_stack([*of_ratio(ours, theirs), harm.of_cells(ours, theirs)])
    found = table.join(against).loc[order].reset_index()
    return found.join(harm.judge_cells(found))


def _alike(groups: pd.api.typing.DataFrameGroupBy) -> Iterator[tuple[list[tuple[Any, ...]], tuple[np.ndarray, ...]]]:
    """Pairs of samples (episodes, cells), and the keys of their cells: together are cells of as many episodes."""
    damage = {key: rows.set_index("episode")["damage"].astype(float) for key, rows in groups[["episode", "damage"]]}
    sizes: dict[int, list[tuple[Any, ...]]] = {}
    for key, ours in damage.items():
        world, house, caregiver, *who = key
        theirs = damage.get((world, house, "none", *who))
        if caregiver == "none" or theirs is None:
            continue
        if not ours.index.equals(theirs.index):
            raise CaregiverError(
                f"episodes must be paired, got some of '{caregiver}' or 'none' in house '{house}' without a counterpart"
            )
        sizes.setdefault(len(ours), []).append(key)
    for keys in sizes.values():
        alone = [(world, house, "none", *who) for world, house, _, *who in keys]
        yield keys, tuple(np.stack([damage[key].to_numpy() for key in side], axis=1) for side in (keys, alone))
