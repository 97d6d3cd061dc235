"""Rows of a table over houses, and of the points of its figure, from the episodes of a run over many houses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.intervals import Estimate, of_ratio
from caregiver_mj.experiments.two_level import over_houses
from caregiver_mj.experiments.verdicts import judge

_CELL = ("world", "family", "epsilon")  # episodes that differ in one of these are not put together
_PAIR = ["house", "episode"]


def compare_over_houses(
    episodes: pd.DataFrame, caregiver: str, baseline: str = "none", measure: str = "damage"
) -> list[dict[str, Any]]:
    """Sets a caregiver against another one over all houses of a run.

    Args:
        episodes: A row an episode, with the columns house, caregiver, episode, those of world, family and epsilon
            that there are, and the measure; paired by house and episode.
        caregiver: Name of one caregiver.
        baseline: Name of the other.
        measure: The column to compare.

    Returns:
        A row for each world and each kind of children, in order of appearance. Its `<measure>_left_by_house` is the
        mean over houses of the ratio of means, over those of the `houses` in which there is one (`houses_defined`);
        `<measure>_left` is the ratio of the means over houses, and `<measure>_difference_mean` the mean over houses
        of the difference (caregiver less baseline). All have `_ci_low` and `_ci_high`; `<measure>_p` and
        `<measure>_verdict` are those of the difference. None where there is no such number.

    Raises:
        CaregiverError: There is no such caregiver, or an episode of one has no counterpart with the other.
    """
    rows = []
    for key, cell in _cells(episodes, caregiver, baseline, measure):
        houses = [house for _, house in cell.groupby("house", sort=False)]
        found = over_houses([h.ours.to_numpy() for h in houses], [h.theirs.to_numpy() for h in houses])
        verdict = judge(found.mean_difference, found.ours - found.theirs)
        rows.append(
            key
            | {"houses": len(houses), "houses_defined": int(np.isfinite(found.ratios).sum()), "episodes": len(cell)}
            | _columns(f"{measure}_left_by_house", found.mean_ratio)
            | _columns(f"{measure}_left", found.ratio_of_means)
            | _columns(f"{measure}_difference_mean", found.mean_difference)
            | {f"{measure}_p": _number(verdict.p), f"{measure}_verdict": verdict.verdict.value}
        )
    return rows


def each_house(
    episodes: pd.DataFrame, caregiver: str, baseline: str = "none", measure: str = "damage"
) -> list[dict[str, Any]]:
    """The ratio of means in every house by itself, its interval resampling the episodes there.

    Takes and raises what `compare_over_houses` does.
    """
    return [
        key
        | {"house": house, "episodes": len(found)}
        | _columns(f"{measure}_left", of_ratio(found.ours.to_numpy(), found.theirs.to_numpy()))
        for key, cell in _cells(episodes, caregiver, baseline, measure)
        for house, found in cell.groupby("house", sort=False)
    ]


def _cells(
    episodes: pd.DataFrame, caregiver: str, baseline: str, measure: str
) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """What makes a cell, and its pairs in order: house, episode, ours, theirs."""
    keys = [key for key in _CELL if key in episodes]
    for name in (caregiver, baseline):
        if name not in set(episodes.caregiver):
            known = ", ".join(episodes.caregiver.unique())
            raise CaregiverError(f"no episodes with the caregiver '{name}': there are {known}")
    groups = episodes.groupby(keys, sort=False) if keys else [((), episodes)]
    for values, group in groups:
        both = [group[group.caregiver == name].set_index(_PAIR)[measure] for name in (caregiver, baseline)]
        pairs = pd.concat(both, axis=1, keys=["ours", "theirs"])
        if lone := int(pairs.isna().any(axis=1).sum()):
            what = ", ".join(f"{key} {value}" for key, value in zip(keys, values, strict=True))
            raise CaregiverError(f"{lone} episodes of '{caregiver}' or '{baseline}' have no counterpart ({what})")
        key = {"caregiver": caregiver, "baseline": baseline} | dict(zip(keys, values, strict=True))
        yield key, pairs.reset_index().sort_values("episode", kind="stable")


def _columns(name: str, estimate: Estimate) -> dict[str, float | None]:
    """An estimate as columns; `x` as well as `x_mean` has its interval in `x_ci_low` and `x_ci_high`."""
    stem = name.removesuffix("_mean")
    low, high = _number(estimate.low), _number(estimate.high)
    return {name: _number(estimate.value), f"{stem}_ci_low": low, f"{stem}_ci_high": high}


def _number(value: float) -> float | None:
    """A number as JSON has it, which knows neither NaN nor infinity."""
    return float(value) if np.isfinite(value) else None
