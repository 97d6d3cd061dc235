"""From episodes to tables: means, bootstrap intervals, and paired comparisons of caregivers."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

CONFIDENCE = 0.95
COMPARED = ("damage", "timesteps_to_threshold", "cells_visited", "toys_reached")
_PLACE, _WHO = ["world", "house"], ["family", "epsilon"]


def summarise(episodes: pd.DataFrame, columns: tuple[str, ...]) -> list[dict[str, Any]]:
    """One row for each combination of world, house, caregiver and family, in order of appearance.

    Args:
        episodes: A row an episode.
        columns: The columns to summarise; "damage" must be among them.

    Returns:
        Rows with `<column>_mean`, `_sd` (that of a sample; 0 for a single episode), `_ci_low` and `_ci_high` (of the
        mean; None for a single episode). `damage_normalised` is damage over the greatest of any episode at all, as
        in the paper's figure 2.
    """
    worst = episodes["damage"].max()
    figures = episodes[list(columns)].astype(float)
    figures.insert(0, "damage_normalised", episodes["damage"] / worst if worst > 0 else 0.0)
    keys = [*_PLACE, "caregiver", *_WHO]
    rows = []
    for key, group in episodes.groupby(keys, sort=False):
        data = figures.loc[group.index]
        low, high = mean_interval(data.to_numpy())
        row = dict(zip(keys, key, strict=True)) | {"episodes": len(group)}
        for i, column in enumerate(data):
            row[f"{column}_mean"] = float(data[column].mean())
            row[f"{column}_sd"] = float(data[column].std(ddof=1)) if len(group) > 1 else 0.0
            row[f"{column}_ci_low"], row[f"{column}_ci_high"] = _number(low[i]), _number(high[i])
        rows.append(row)
    return rows


def compare(episodes: pd.DataFrame, caregiver: str, baseline: str) -> list[dict[str, Any]]:
    """Sets a caregiver against another one, episode by episode: episode i has the same children under both.

    Args:
        episodes: A row an episode.
        caregiver: Name of one caregiver.
        baseline: Name of the other.

    Returns:
        For each world, house and family: `damage_left`, the ratio of mean damages, and for each column of `COMPARED`
        the `<column>_difference_mean` (caregiver less baseline), both with `_ci_low` and `_ci_high`, and the
        `<column>_p` of Wilcoxon's signed-rank test. None where there is no such number.
    """
    keys = [*_PLACE, *_WHO]
    rows = []
    for key, group in episodes.groupby(keys, sort=False):
        ours, theirs = (
            group[group.caregiver == name].set_index("episode")[list(COMPARED)].astype(float)
            for name in (caregiver, baseline)
        )
        ours = ours.loc[theirs.index]
        left, left_low, left_high = ratio_interval(ours["damage"].to_numpy(), theirs["damage"].to_numpy())
        row = {"caregiver": caregiver, "baseline": baseline} | dict(zip(keys, key, strict=True))
        row |= {"episodes": len(ours), "damage_left": _number(left)}
        row |= {"damage_left_ci_low": _number(left_low), "damage_left_ci_high": _number(left_high)}
        difference = (ours - theirs).to_numpy()
        low, high = mean_interval(difference)
        for i, column in enumerate(COMPARED):
            row[f"{column}_difference_mean"] = float(difference[:, i].mean())
            row[f"{column}_difference_ci_low"] = _number(low[i])
            row[f"{column}_difference_ci_high"] = _number(high[i])
            row[f"{column}_p"] = signed_rank_p(difference[:, i])
        rows.append(row)
    return rows


def mean_interval(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Percentile bootstrap intervals of means.

    Args:
        data: Samples (n, columns).

    Returns:
        Lower and upper ends (columns,), NaN for fewer than two samples.
    """
    return _bootstrap((data,), np.mean, data.shape[1:])


def ratio_interval(ours: np.ndarray, theirs: np.ndarray) -> tuple[float, float, float]:
    """The ratio of two means over paired samples (n,), and the ends of its bootstrap interval; NaN where undefined."""

    def ratio(a: np.ndarray, b: np.ndarray, axis: int) -> np.ndarray:
        above, below = a.mean(axis), b.mean(axis)
        return np.divide(above, below, out=np.full_like(above, np.nan), where=below > 0)

    low, high = _bootstrap((ours, theirs), ratio, ())
    return float(ratio(ours[None], theirs[None], -1)[0]), float(low), float(high)


def signed_rank_p(difference: np.ndarray) -> float:
    """Two-sided p of Wilcoxon's signed-rank test on paired differences (n,); 1 where all are zero."""
    if not difference.any():
        return 1.0
    return float(stats.wilcoxon(difference, zero_method="pratt").pvalue)


def _bootstrap(samples: tuple[np.ndarray, ...], statistic: Any, shape: tuple[int, ...]) -> tuple[Any, Any]:
    size = len(samples[0])
    if size < 2:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    # Fewer resamples of larger samples, whose intervals are narrow anyway, and no more than 16 MB at once.
    resamples = int(np.clip(4_000_000 // size, 999, 9999))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)  # a ratio may be undefined; so is its interval
        interval = stats.bootstrap(
            samples,
            statistic,
            axis=0,
            vectorized=True,
            paired=True,
            method="percentile",
            confidence_level=CONFIDENCE,
            n_resamples=resamples,
            batch=max(1, 2_000_000 // samples[0].size),
            rng=np.random.default_rng(0),
        ).confidence_interval
    return interval.low, interval.high


def _number(value: float) -> float | None:
    """A number as JSON has it, which knows no NaN."""
    return float(value) if np.isfinite(value) else None
