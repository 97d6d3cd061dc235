"""From episodes to the rows of tables: means, and paired comparisons of caregivers.

Of episodes in one house the episode is the unit of chance; in several houses the house is, and every mean is one over
houses (see `two_level`). What a row holds is called the same in both cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.samples import CELL, Sample, pairs, samples
from caregiver_mj.experiments.verdicts import (
    LEVEL,
    MARGINS,
    Verdict,
    equivalent,
    holm,
    judge_columns,
    margin_p,
    not_inferior,
    verdict,
)

COMPARED = (
    "damage",
    "damage_until_stop",
    "timesteps_to_threshold",
    "cells_visited",
    "toys_reached",
    "moves_blocked_free",
)
_BY_MARGIN = ("toys_reached_not_inferior", "damage_equivalence")  # verdicts
_LEFT = ("damage", "toys_reached")  # told as shares of the baseline's


def mean_rows(episodes: pd.DataFrame, columns: Sequence[str]) -> list[dict[str, Any]]:
    """One row for each world, caregiver and family, in order of appearance.

    Args:
        episodes: A row an episode.
        columns: The columns to summarise, which cannot be negative; "damage" must be among them.

    Returns:
        Rows with `<column>_mean`, `_sd` (of the sample of episodes, over houses of their means; 0 of a single one),
        `_ci_low` and `_ci_high` (of the mean; None where nothing bounds it). `damage_normalised` is damage over the
        greatest of any episode at all, as in the paper's figure 2.
    """
    worst = episodes["damage"].max()
    normalised = episodes["damage"] / worst if worst > 0 else 0.0
    names = ["damage_normalised", *columns]
    rows = []
    for key, caregiver, sample in samples(episodes.assign(damage_normalised=normalised)):
        found, units = sample.estimators.of_mean(sample.values(names), least=0.0), sample.units(names)
        sd = units.std(axis=0, ddof=1) if len(units) > 1 else np.zeros(len(names))
        row = _heading(key, sample, caregiver=caregiver)
        for i, name in enumerate(names):
            mean, *ends = _columns(f"{name}_mean", found.column(i)).items()
            row |= dict([mean, (f"{name}_sd", float(sd[i])), *ends])
        rows.append(row)
    return rows


def comparison_rows(episodes: pd.DataFrame, caregiver: str, baseline: str) -> list[dict[str, Any]]:
    """Sets a caregiver against another one, episode by episode: episode i has the same children under both.

    Args:
        episodes: A row an episode.
        caregiver: Name of one caregiver.
        baseline: Name of the other.

    Returns:
        For each world and family:

        - `damage_left` and `toys_reached_left`, the ratios of means;
        - `damage_left_by_house`, of several houses: the mean over those with damage (`houses_defined`) of their ratios,
          without an interval, for where little happens in a house both are biased (see docs/coverage.md);
        - `<column>_difference_mean` for those of `COMPARED` that there are, caregiver less baseline, and of the same
          difference `<column>_p`, by sign flips, and what `judged_together` adds for these rows;
        - `toys_reached_not_inferior`, and against a caregiver that acts `damage_equivalence`: verdicts at `MARGINS`,
          with the `_p` of being at the margin.

        Other ratios and differences have `_ci_low` and `_ci_high`. None where there is no such number.

    Raises:
        CaregiverError: There is no such caregiver, or an episode of one has no counterpart with the other.
    """
    columns = [column for column in COMPARED if column in episodes]
    rows = []
    for key, ours, theirs in pairs(episodes, caregiver, baseline):
        row = _heading(key, ours, caregiver=caregiver, baseline=baseline)
        row |= _shares(ours, theirs, acts=baseline != "none")
        found = ours.estimators.of_difference(ours.values(columns), theirs.values(columns))
        judged = judge_columns(found, ours.units(columns) - theirs.units(columns))
        for column, (estimate, p, _) in zip(columns, judged, strict=True):
            row |= _columns(f"{column}_difference_mean", estimate) | {f"{column}_p": _number(p)}
        rows.append(row)
    return judged_together(rows)


def judged_together(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Comparisons that are told together, judged with Holm's correction for their number.

    Args:
        rows: Rows of `comparison_rows`, of one pair of caregivers or of several.

    Returns:
        The same rows with `<column>_p_holm`, corrected over all of them, None where there is no p; and
        `<column>_verdict` by that and the interval: "less", "more" or "no verdict". A verdict at a margin becomes "no
        verdict" where its `_p_holm` is not small enough.
    """
    for name in (name for name in _BY_MARGIN if rows and name in rows[0]):
        corrected = holm(np.array([row[f"{name}_p"] for row in rows], float))
        for row, p in zip(rows, corrected, strict=True):
            row |= {f"{name}_p_holm": _number(p)} | ({} if p <= LEVEL else {name: Verdict.NONE.value})
    for column in (column for column in COMPARED if rows and f"{column}_p" in rows[0]):
        corrected = holm(np.array([row[f"{column}_p"] for row in rows], float))
        for row, p in zip(rows, corrected, strict=True):
            low, high = (row[f"{column}_difference_ci_{end}"] for end in ("low", "high"))
            ends = -np.inf if low is None else low, np.inf if high is None else high
            row |= {f"{column}_p_holm": _number(p), f"{column}_verdict": verdict(p, *ends).value}
    return rows


def _shares(ours: Sample, theirs: Sample, *, acts: bool) -> dict[str, Any]:
    """What is left of damage and of toys, and whether the margins are kept."""
    samples_ = ours.values(_LEFT), theirs.values(_LEFT)
    units = zip(ours.units(_LEFT).T, theirs.units(_LEFT).T, strict=True)
    (damage, toys), found = units, ours.estimators.of_ratio(*samples_)
    row: dict[str, Any] = _columns("damage_left", found.column(0))
    if ours.houses > 1:
        row["houses_defined"] = int((theirs.units(["damage"]) > 0).sum())
        by_house = two_level.of_mean_ratio([*ours.values(["damage"])], [*theirs.values(["damage"])])
        row["damage_left_by_house"] = _number(by_house.column(0).value)
    if acts:
        row["damage_equivalence"] = equivalent(*damage, MARGINS["damage"], found.column(0)).value
        row["damage_equivalence_p"] = _number(margin_p(*damage, MARGINS["damage"], both=True))
    row |= _columns("toys_reached_left", found.column(1))
    kept = not_inferior(*toys, MARGINS["toys_reached"], more_is_better=True, ratio=found.column(1))
    p = _number(margin_p(*toys, MARGINS["toys_reached"]))
    return row | {"toys_reached_not_inferior": kept.value, "toys_reached_not_inferior_p": p}


def _heading(key: dict[str, Any], sample: Sample, **who: str) -> dict[str, Any]:
    """What a row is about: where, who and how much."""
    many = sample.houses > 1
    where = {"world": key["world"], "house": f"{sample.houses} houses" if many else sample.rows["house"].iloc[0]}
    with_whom = {name: key[name] for name in CELL[1:]}
    return where | who | with_whom | ({"houses": sample.houses} if many else {}) | {"episodes": len(sample)}


def _columns(name: str, estimate: Estimate[float]) -> dict[str, float | None]:
    """An estimate as columns; `x` as well as `x_mean` has its interval in `x_ci_low` and `x_ci_high`."""
    stem = name.removesuffix("_mean")
    low, high = _number(estimate.low), _number(estimate.high)
    return {name: _number(estimate.value), f"{stem}_ci_low": low, f"{stem}_ci_high": high}


def _number(value: float) -> float | None:
    """A number as JSON has it, which knows neither NaN nor infinity."""
    return float(value) if np.isfinite(value) else None
