"""What a run's episodes come to: the content of summary.json, and of houses.parquet.

Harm here is more damage with a caregiver than alone, the first of its three parts (module `harm`). A cell is a house
and a child, or a family of children. Episode i of it has the same draws with and without the caregiver, so the two are
compared by pairs. The p is one-sided, of a mean
difference that is not above zero, by flipping the signs of the pairs, and corrected by Holm over all cells of a
caregiver in the run; harm is shown where it is .05 or less and the 95 % interval of the mean difference is above zero.

Why sign flips: if a caregiver makes no difference, each pair could as well be the other way round, so they are exact,
however few the pairs and however uneven their differences, which are mostly zero, else bumps and falls. Student's t is
not: it is certain of two differences that are equal. Wilcoxon's ranks are not of the mean, which is what is claimed.
The price is that few pairs show nothing: with six that differ, no p is below 1 / 2⁶ = .016. So it is said in how many
cells harm could be shown at all.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, statistics
from caregiver_mj.experiments.harm import BASELINE, judge
from caregiver_mj.experiments.provenance import versions
from caregiver_mj.experiments.score import with_costs
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.experiments.verdicts import LEVEL, Verdict, holm, least_p_more, sign_flip_p_more, verdict
from caregiver_mj.recording.record import MEASURES

_KEYS = ["world", "house", "caregiver", "family", "epsilon"]
HARM = (  # columns
    "damage_difference",
    "damage_difference_ci_low",
    "damage_difference_ci_high",
    "worse",
    "harm_p",
    "harm_p_least",
)


def summarise(settings: Settings, episodes: pd.DataFrame, houses: pd.DataFrame) -> dict[str, Any]:
    """Return the content of summary.json: every caregiver against none, and the paper's against every other one.

    `episodes` has a row an episode, `houses` what `by_house` makes of them.
    """
    ran = settings.caregivers
    against_none = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    others = [
        (rule, other) for rule in RULE if rule in ran for other in ran if other not in ("none", *RULE, BARE_TABLES)
    ]
    costs = with_costs(episodes, settings.plans)
    comparisons = [row for together in (against_none, others) for row in compared_together(costs, together)]
    damage = harm(houses)
    return {
        "verdicts": judge(episodes, damage, comparisons),
        "harm": damage,
        "rows": statistics.mean_rows(episodes, [column for column in MEASURES if column in episodes]),
        "comparisons": comparisons,
        "versions": versions(),
        "seed": settings.seed,
    }


def compared_together(episodes: pd.DataFrame, pairs: Iterable[tuple[str, str]]) -> list[dict[str, Any]]:
    """Return the comparisons of pairs of caregivers, with one correction for all of them."""
    return statistics.judged_together([row for pair in pairs for row in statistics.comparison_rows(episodes, *pair)])


def by_house(episodes: pd.DataFrame) -> pd.DataFrame:
    """Return what each caregiver comes to in each house, of a table with a row an episode.

    Returns:
        A row for each world, house, caregiver and family: `episodes`, how many, the mean of each of `MEASURES` that
        there is, and `damage_left`, the ratio of mean damage to that of `none`, with `damage_left_ci_low` and
        `_ci_high`; then what tells whether the caregiver does harm (see `harm`): `HARM`, `harm_p_holm` and
        `harm_verdict`. These are NaN ("") for `none` itself, and a ratio is where there is none; an end is infinite
        where the episodes give none.

    Raises:
        CaregiverError: An episode has no counterpart without a caregiver.
    """
    groups = episodes.sort_values("episode", kind="stable").groupby(_KEYS, sort=False)
    table = groups[[column for column in MEASURES if column in episodes]].mean()
    table.insert(0, "episodes", groups.size())
    order = pd.MultiIndex.from_frame(episodes[_KEYS].drop_duplicates())
    columns = ["damage_left", "damage_left_ci_low", "damage_left_ci_high", *HARM]
    against = pd.DataFrame(np.nan, table.index, columns)
    for keys, (ours, theirs) in _alike(groups):
        against.loc[keys] = np.column_stack([*intervals.of_ratio(ours, theirs), of_cells(ours, theirs)])
    found = table.join(against).loc[order].reset_index()
    return found.join(judge_cells(found))


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


def of_cells(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return what a caregiver does in each cell, of the damage with it and alone, (episodes, cells).

    Returns:
        The `HARM` of each cell, (cells, columns): the mean paired difference, ours less theirs, with its interval;
        the share of the episodes with more damage than alone; the p of harm, and the least that it could be.
    """
    difference = ours - theirs
    found = intervals.of_difference(ours, theirs)
    worse = (difference > 0).mean(axis=0)
    return np.stack([*found, worse, sign_flip_p_more(difference), least_p_more(difference)], axis=1)


def judge_cells(cells: pd.DataFrame) -> pd.DataFrame:
    """Return `harm_p_holm` and `harm_verdict` of cells with `caregiver` and `HARM`; "" is the verdict where is no p."""
    corrected = cells.groupby("caregiver", sort=False)["harm_p"].transform(holm)
    ends = cells["damage_difference_ci_low"], cells["damage_difference_ci_high"]
    judged = ["" if np.isnan(one[0]) else verdict(*one).value for one in zip(corrected, *ends, strict=True)]
    return pd.DataFrame({"harm_p_holm": corrected, "harm_verdict": judged}, cells.index)


def harm(cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Return how much harm each caregiver does, by what `by_house` has of the cells: the `harm` of summary.json.

    Returns:
        For each caregiver that acts, in order of appearance: `cells` of a house and a family, in how many of them harm
        is shown (`cells_harmed`) and could be (`cells_decidable`: where one with so many pairs that differ could, if
        the others did not); `episodes`, and the share of them with more damage than alone (`episodes_worse`); and
        `worst`, the cell of the greatest difference, of those with harm if there are any: `house`, `family`,
        `episodes`, `damage_alone`, `damage_with`, the mean `damage_difference` with its interval (an end is None where
        the episodes give none), `p`, `p_holm` and `verdict`. None at all of a run without `none`.
    """
    alone = cells[cells["caregiver"] == BASELINE].set_index(["house", "family"])["damage"]
    judged = cells[(cells["harm_verdict"] != "") & (cells["caregiver"] != BARE_TABLES)]
    return [_of_caregiver(name, rows, alone) for name, rows in judged.groupby("caregiver", sort=False)]


def judge_run(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the `verdicts` of episodes that have no summary yet, with `none` among them."""
    acting = [name for name in episodes["caregiver"].unique() if name != BASELINE]
    against_none = compared_together(episodes, [(name, BASELINE) for name in acting])
    return judge(episodes, harm(by_house(episodes)), against_none)


def _of_caregiver(caregiver: str, cells: pd.DataFrame, alone: pd.Series) -> dict[str, Any]:
    harmed = cells["harm_verdict"] == Verdict.MORE
    worst = cells.loc[cells.loc[harmed if harmed.any() else slice(None), "damage_difference"].idxmax()].copy()
    episodes, worst["damage_with"] = cells["episodes"], worst["damage"]
    worst["damage_alone"] = alone[worst["house"], worst["family"]]
    numbers = ("damage_alone", "damage_with", *HARM[:3], "harm_p", "harm_p_holm")
    told = {name.removeprefix("harm_"): float(worst[name]) if np.isfinite(worst[name]) else None for name in numbers}
    return {
        "world": worst["world"],
        "caregiver": caregiver,
        "baseline": BASELINE,
        "cells": len(cells),
        "cells_harmed": int(harmed.sum()),
        "cells_decidable": int((cells["harm_p_least"] * len(cells) <= LEVEL).sum()),
        "episodes": int(episodes.sum()),
        "episodes_worse": float((cells["worse"] * episodes).sum() / episodes.sum()),
        "worst": {"house": worst["house"], "family": worst["family"], "episodes": int(worst["episodes"])}
        | told
        | {"verdict": str(worst["harm_verdict"])},
    }
