"""Rows of tables from episodes: means, and paired comparisons of caregivers.

In one house the sampling unit is the episode; in several houses it is the house, and every mean is over houses (see
`two_level`). The columns have the same names in both cases.
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, two_level, verdicts
from caregiver_mj.experiments.intervals import Estimate

COMPARED = (
    "damage",
    "damage_until_stop",
    "timesteps_to_threshold",
    "cells_visited",
    "toys_reached",
    "moves_blocked_free",
)
_BY_MARGIN = ("toys_reached_not_inferior", "damage_equivalence")  # verdicts
_LEFT = ("damage", "toys_reached")  # given as shares of the baseline's
CONDITION = ["world", "family", "epsilon"]  # episodes that differ in one of these are never combined


def mean_rows(episodes: pd.DataFrame, columns: Sequence[str]) -> list[dict[str, Any]]:
    """Return a row for each world, caregiver and family, in order of appearance.

    For each of the columns, which must not be negative and must include "damage", it has `<column>_mean`, `_sd` (over
    the sampling units; 0 for one), `_ci_low` and `_ci_high` (of the mean; None where it is unbounded).
    `damage_normalised` is damage over the greatest of any episode, as in the paper's figure 2.
    """
    worst = episodes["damage"].max()
    normalised = episodes["damage"] / worst if worst > 0 else 0.0
    names = ["damage_normalised", *columns]
    rows = []
    groups = episodes.assign(damage_normalised=normalised).groupby([*CONDITION, "caregiver"], sort=False)
    for (*values, caregiver), group in groups:
        key, sample = dict(zip(CONDITION, values, strict=True)), Sample(group)
        found, units = sample.estimators.of_mean(sample.values(names), least=0.0), sample.units(names)
        sd = units.std(axis=0, ddof=1) if len(units) > 1 else np.zeros(len(names))
        row = _heading(key, sample, caregiver=caregiver)
        for i, name in enumerate(names):
            mean, *ends = _columns(f"{name}_mean", found.column(i)).items()
            row |= dict([mean, (f"{name}_sd", float(sd[i])), *ends])
        rows.append(row)
    return rows


def comparison_rows(episodes: pd.DataFrame, caregiver: str, baseline: str) -> list[dict[str, Any]]:
    """Compare a caregiver with another, episode by episode: episode i has the same children under both.

    Returns:
        For each world and family:

        - `damage_left` and `toys_reached_left`, the ratios of means; against `none`, in a table of `score.with_costs`,
          also `score`;
        - `damage_left_by_house`, of several houses: the mean ratio over the houses with damage (`houses_defined`),
          without an interval, because both are biased in houses with few events (see docs/coverage.md);
        - `<column>_difference_mean` of each measured column of `COMPARED`, caregiver less baseline, its `<column>_p` by
          sign flips, and the columns of `judged_together`;
        - `toys_reached_not_inferior`, and against a caregiver that acts `damage_equivalence`: verdicts at `MARGINS`,
          with the `_p` of being at the margin.

        Other ratios and differences have `_ci_low` and `_ci_high`. An undefined number is None.

    Raises:
        CaregiverError: There is no such caregiver, or an episode of one has no counterpart with the other.
    """
    columns = [column for column in COMPARED if column in episodes]
    rows: list[dict[str, Any]] = []
    tests = len(episodes[[*CONDITION, "caregiver"]].drop_duplicates())  # at most, of rows that are judged together
    for key, ours, theirs in pairs(episodes, caregiver, baseline):
        row = _heading(key, ours, caregiver=caregiver, baseline=baseline)
        row |= _shares(ours, theirs, tests, acts=baseline != "none")
        if baseline == "none" and "preventable" in episodes:
            prevented = theirs.rows["damage"].to_numpy() - ours.rows["all_harm"].to_numpy()
            alone = Sample(theirs.rows.assign(prevented=prevented))
            both = alone.values(["prevented"]), alone.values(["preventable"])
            row |= _columns("score", alone.estimators.of_ratio(*both, least=-np.inf).column(0))
        found = ours.estimators.of_difference(ours.values(columns), theirs.values(columns))
        differences = ours.units(columns) - theirs.units(columns)
        for i, (column, p) in enumerate(zip(columns, verdicts.sign_flip_p(differences, tests), strict=True)):
            p = _number(p) if verdicts.enough(differences[:, i]) else None
            row |= _columns(f"{column}_difference_mean", found.column(i)) | {f"{column}_p": p}
        rows.append(row)
    return judged_together(rows)


def judged_together(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Judge rows of `comparison_rows` together, with Holm's correction for their number.

    They get `<column>_p_holm`, corrected over all of them (None without a p), and `<column>_verdict` from it and the
    interval: "less", "more" or "no verdict". A verdict at a margin becomes "no verdict" where its p is too large.
    """
    names = [name for name in (*_BY_MARGIN, *COMPARED) if rows and f"{name}_p" in rows[0]]
    for name in names:
        corrected = verdicts.holm(np.array([row[f"{name}_p"] for row in rows], float))
        for row, p in zip(rows, corrected, strict=True):
            row[f"{name}_p_holm"] = _number(p)
            if name in _BY_MARGIN:
                row |= {} if p <= verdicts.LEVEL else {name: verdicts.Verdict.NONE.value}
                continue
            low, high = (row[f"{name}_difference_ci_{end}"] for end in ("low", "high"))
            ends = -np.inf if low is None else low, np.inf if high is None else high
            row[f"{name}_verdict"] = verdicts.verdict(p, *ends).value
    return rows


def _shares(ours: Sample, theirs: Sample, tests: int, *, acts: bool) -> dict[str, Any]:
    """Return the shares of damage and toys left, and the verdicts at their margins."""
    samples_ = ours.values(_LEFT), theirs.values(_LEFT)
    units = zip(ours.units(_LEFT).T, theirs.units(_LEFT).T, strict=True)
    (damage, toys), found = units, ours.estimators.of_ratio(*samples_)
    row: dict[str, Any] = _columns("damage_left", found.column(0))
    if ours.houses > 1:
        row["houses_defined"] = int((theirs.units(["damage"]) > 0).sum())
        by_house = two_level.of_mean_ratio([*ours.values(["damage"])], [*theirs.values(["damage"])])
        row["damage_left_by_house"] = _number(by_house.column(0).value)
    if acts:
        row["damage_equivalence"] = verdicts.equivalent(*damage, verdicts.MARGINS["damage"], found.column(0)).value
        p = verdicts.margin_p(*damage, verdicts.MARGINS["damage"], both=True, tests=tests)
        row["damage_equivalence_p"] = _number(p)
    row |= _columns("toys_reached_left", found.column(1))
    kept = verdicts.not_inferior(*toys, verdicts.MARGINS["toys_reached"], found.column(1))
    p = verdicts.margin_p(*toys, verdicts.MARGINS["toys_reached"], tests=tests)
    return row | {"toys_reached_not_inferior": kept.value, "toys_reached_not_inferior_p": _number(p)}


def _heading(key: dict[str, Any], sample: Sample, **who: str) -> dict[str, Any]:
    many = sample.houses > 1
    where = {"world": key["world"], "house": f"{sample.houses} houses" if many else sample.rows["house"].iloc[0]}
    with_whom = {name: key[name] for name in CONDITION[1:]}
    return where | who | with_whom | ({"houses": sample.houses} if many else {}) | {"episodes": len(sample)}


def _columns(name: str, estimate: Estimate[float]) -> dict[str, float | None]:
    """Return an estimate as columns; the interval of `x` or `x_mean` is `x_ci_low` and `x_ci_high`."""
    stem = name.removesuffix("_mean")
    low, high = _number(estimate.low), _number(estimate.high)
    return {name: _number(estimate.value), f"{stem}_ci_low": low, f"{stem}_ci_high": high}


def _number(value: float) -> float | None:
    """Return a number for JSON, None for NaN and infinity."""
    return float(value) if np.isfinite(value) else None


class Sample:
    """Episodes of one caregiver with the same children: `rows`, a row an episode, in a number of `houses`."""

    def __init__(self, rows: pd.DataFrame):
        codes, names = pd.factorize(rows["house"], sort=True)
        order = np.lexsort((rows["episode"].to_numpy(), codes))
        self.rows, self.houses = rows.iloc[order], len(names)  # rows by house and by episode
        self._starts = np.searchsorted(codes[order], np.arange(1, len(names)))

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def estimators(self) -> types.ModuleType:
        """Module with `of_mean`, `of_difference` and `of_ratio` for its values."""
        return intervals if self.houses == 1 else two_level

    def values(self, columns: Sequence[str]) -> np.ndarray | list[np.ndarray]:
        """Return the values of each episode, (episodes, columns); of several houses a list of such arrays."""
        data = self.rows[list(columns)].to_numpy(float)
        return data if self.houses == 1 else np.split(data, self._starts)

    def units(self, columns: Sequence[str]) -> np.ndarray:
        """Return the sampling units, (units, columns): the episodes of one house, or the means of several houses."""
        values = self.values(columns)
        return values if isinstance(values, np.ndarray) else two_level.house_means(values)


def pairs(episodes: pd.DataFrame, caregiver: str, baseline: str) -> Iterator[tuple[dict[str, object], Sample, Sample]]:
    """Yield each condition with the samples of two caregivers; unit i of one belongs to unit i of the other.

    Raises:
        CaregiverError: There is no such caregiver, or an episode of one has no counterpart with the other.
    """
    names = episodes["caregiver"].unique()
    for name in (caregiver, baseline):
        if name not in names:
            raise CaregiverError(f"no caregiver '{name}' in the run: there are {', '.join(names)}")
    for values, rows in episodes[episodes.caregiver.isin((caregiver, baseline))].groupby(CONDITION, sort=False):
        ours, theirs = (Sample(rows[rows.caregiver == name]) for name in (caregiver, baseline))
        key = dict(zip(CONDITION, values, strict=True))
        where = ["house", "episode"]
        if len(ours) != len(theirs) or (ours.rows[where].to_numpy() != theirs.rows[where].to_numpy()).any():
            lone = int((pd.concat([ours.rows[where], theirs.rows[where]]).value_counts() != 2).sum())
            which = ", ".join(f"{name} {value}" for name, value in key.items())
            raise CaregiverError(
                f"episodes must be paired, got {lone} of '{caregiver}' or '{baseline}' without a counterpart ({which})"
            )
        yield key, ours, theirs
