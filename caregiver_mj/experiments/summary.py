"""Summary of a run: the content of summary.json and of houses.parquet.

Harm here is more damage with a caregiver than alone, the first of its three parts (module `harm`). A condition is a
(house, family) pair. Its episode i has the same draws with and without the caregiver, so a test by pairs applies: the p
of a mean difference not above zero, one-sided, by sign flips of the pairs, with Holm's correction over all conditions
of a caregiver in the run. Harm is shown where p is .05 or less and the 95 % interval of the mean difference is above
zero.

Why sign flips: if a caregiver makes no difference, the sign of each pair is random. The test is therefore exact for few
pairs and for uneven differences (most are zero, the others bumps and falls). Student's t is not: it is certain of two
equal differences. Wilcoxon's ranks do not test the mean, which is the claim. The price is that few pairs show nothing:
with six that differ, no p is below 1 / 2⁶ = .016. The summary states in how many conditions harm could be shown.
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
    """Return the content of summary.json: comparisons of every caregiver with `none`, and of the rule with all others.

    `episodes` has a row an episode; `houses` is `by_house(episodes)`.
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
    """Return the results of each caregiver in each house, from a table with a row an episode.

    Returns:
        A row for each world, house, caregiver and family: the number of `episodes`, the mean of each measured column of
        `MEASURES`, `damage_left`, the ratio of mean damage to that of `none`, with `damage_left_ci_low` and `_ci_high`,
        and the evidence of harm (see `harm`): `HARM`, `harm_p_holm` and `harm_verdict`. These are NaN ("") for `none`,
        an undefined ratio is NaN, and an unbounded end infinite.

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
        against.loc[keys] = np.column_stack([*intervals.of_ratio(ours, theirs), of_conditions(ours, theirs)])
    found = table.join(against).loc[order].reset_index()
    return found.join(judge_conditions(found))


def _alike(groups: pd.api.typing.DataFrameGroupBy) -> Iterator[tuple[list[tuple[Any, ...]], tuple[np.ndarray, ...]]]:
    """Yield the keys of conditions with equally many episodes, and their paired samples (episodes, conditions)."""
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


def of_conditions(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Compare the damage with a caregiver and alone in each condition, (episodes, conditions) each.

    Returns:
        The `HARM` of each condition, (conditions, columns): the mean paired difference, ours less theirs, with its
        interval; the share of episodes with more damage than alone; the p of harm, and the least possible p.
    """
    difference = ours - theirs
    found = intervals.of_difference(ours, theirs)
    worse = (difference > 0).mean(axis=0)
    return np.stack([*found, worse, sign_flip_p_more(difference), least_p_more(difference)], axis=1)


def judge_conditions(conditions: pd.DataFrame) -> pd.DataFrame:
    """Return `harm_p_holm` and `harm_verdict` of conditions with `caregiver` and `HARM`; no p gives the verdict ""."""
    corrected = conditions.groupby("caregiver", sort=False)["harm_p"].transform(holm)
    ends = conditions["damage_difference_ci_low"], conditions["damage_difference_ci_high"]
    judged = ["" if np.isnan(one[0]) else verdict(*one).value for one in zip(corrected, *ends, strict=True)]
    return pd.DataFrame({"harm_p_holm": corrected, "harm_verdict": judged}, conditions.index)


def harm(conditions: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the harm that each caregiver does, from the rows of `by_house`: the `harm` of summary.json.

    Returns:
        For each caregiver that acts, in order of appearance: the number of conditions (`cells`), of those in which harm
        is shown (`cells_harmed`) and of those in which it could be with as many pairs that differ (`cells_decidable`);
        `episodes`, and the share of them with more damage than alone (`episodes_worse`); and `worst`, the condition
        with the greatest difference, among those with harm if there are any: `house`, `family`, `episodes`,
        `damage_alone`, `damage_with`, the mean `damage_difference` with its interval (None for an unbounded end), `p`,
        `p_holm` and `verdict`. The list is empty for a run without `none`.
    """
    alone = conditions[conditions["caregiver"] == BASELINE].set_index(["house", "family"])["damage"]
    judged = conditions[(conditions["harm_verdict"] != "") & (conditions["caregiver"] != BARE_TABLES)]
    return [_of_caregiver(name, rows, alone) for name, rows in judged.groupby("caregiver", sort=False)]


def judge_run(episodes: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the `verdicts` of episodes that have no summary yet, with `none` among them."""
    acting = [name for name in episodes["caregiver"].unique() if name != BASELINE]
    against_none = compared_together(episodes, [(name, BASELINE) for name in acting])
    return judge(episodes, harm(by_house(episodes)), against_none)


def _of_caregiver(caregiver: str, conditions: pd.DataFrame, alone: pd.Series) -> dict[str, Any]:
    harmed = conditions["harm_verdict"] == Verdict.MORE
    candidates = conditions[harmed] if harmed.any() else conditions
    worst = candidates.loc[candidates["damage_difference"].idxmax()].copy()
    episodes, worst["damage_with"] = conditions["episodes"], worst["damage"]
    worst["damage_alone"] = alone[worst["house"], worst["family"]]
    numbers = ("damage_alone", "damage_with", *HARM[:3], "harm_p", "harm_p_holm")
    values = {name.removeprefix("harm_"): float(worst[name]) if np.isfinite(worst[name]) else None for name in numbers}
    return {
        "world": worst["world"],
        "caregiver": caregiver,
        "baseline": BASELINE,
        "cells": len(conditions),
        "cells_harmed": int(harmed.sum()),
        "cells_decidable": int((conditions["harm_p_least"] * len(conditions) <= LEVEL).sum()),
        "episodes": int(episodes.sum()),
        "episodes_worse": float((conditions["worse"] * episodes).sum() / episodes.sum()),
        "worst": {"house": worst["house"], "family": worst["family"], "episodes": int(worst["episodes"])}
        | values
        | {"verdict": str(worst["harm_verdict"])},
    }
