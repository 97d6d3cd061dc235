"""Ratios of mean damage over houses, averaged over epsilons. Tables have a row a house and episode, columns epsilons.

The house is the unit of chance. Every house counts the same at an epsilon, and every epsilon the same in the average.
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.grid_to_house.breakdown import GRID, REMAINDER, STEPS
from caregiver_mj.studies.grid_to_house.results import Results


def ratio(ours: pd.DataFrame, theirs: pd.DataFrame) -> Estimate[float]:
    """The mean over the epsilons of ours over theirs, with its interval; NaN where nothing happens in theirs.

    The ratios R_e are put together into one: mean_e (y_e - (R_e - R) x_e) / X_e over mean_e x_e / X_e, with y ours, x
    theirs, X the mean of x and R that of R_e. Its value is R, and its error for a house, mean_e (y_e - R_e x_e) / X_e,
    is that of the mean of the ratios.
    """
    weight = _weights(theirs)
    each = (ours.mean() / theirs.mean())[weight.index]
    if not len(weight):
        return Estimate(np.nan, np.nan, np.nan)
    # Relative to the greatest ratio, for no sample may be negative.
    above = (ours[weight.index] + (each.max() - each) * theirs[weight.index]) @ weight
    below = theirs[weight.index] @ weight
    found = two_level.of_ratio(_split(above), _split(below))
    shift = each.max() - each.mean()
    return Estimate(found.value - shift, max(0.0, found.low - shift), found.high - shift)


def by_house(ours: pd.DataFrame, theirs: pd.DataFrame) -> pd.DataFrame:
    """Of each house its ratio, averaged over the epsilons with `weight`, the share that it has in the whole."""
    weight = _weights(theirs)
    above, below = ((table[weight.index] @ weight).groupby("house").mean() for table in (ours, theirs))
    return pd.DataFrame({"ratio": above / below.where(below > 0), "weight": below / below.sum()})


def steps(results: Results) -> dict[str, tuple[Estimate[np.ndarray], Estimate[float]]]:
    """What leads from the grid to the house, in units of the grid's damage.

    Returns:
        For each of `STEPS` and the remainder, by epsilon with arrays (epsilons,), and in all.
    """
    linear = {level: _linear(results.levels[level], results.levels[GRID]) for level in (GRID, *STEPS)}
    linear[REMAINDER] = _linear(*results.rows.cared)
    return {now: difference(linear[now], linear[before]) for before, now in itertools.pairwise(linear)}


def at(estimate: Estimate[np.ndarray], epsilon: int) -> Estimate[float]:
    """One of several estimates, by the number of its epsilon."""
    return Estimate(*(float(ends[epsilon]) for ends in estimate))


def alone(results: Results, level: str) -> Estimate[float]:
    """What a level adds to the grid."""
    grid = results.levels[GRID]
    return difference(_linear(results.levels[level], grid), _linear(grid, grid))[1]


def difference(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[Estimate[np.ndarray], Estimate[float]]:
    """The mean difference of two tables (houses, epsilons) at each epsilon, and in all."""
    data = ours - theirs
    return intervals.of_mean(data.to_numpy()), intervals.of_mean(data.mean(axis=1).to_numpy())


def _linear(ours: pd.DataFrame, theirs: pd.DataFrame) -> pd.DataFrame:
    """Numbers (houses, epsilons) whose mean is the ratio of means, and whose chance is that of it (delta method)."""
    y, x = ours.groupby("house").mean(), theirs.groupby("house").mean()
    each = y.mean() / x.mean()
    return each + (y - each * x) / x.mean()


def _weights(theirs: pd.DataFrame) -> pd.Series:
    """What a damage counts at each epsilon at which there is any."""
    mean = theirs.mean()
    mean = mean[mean > 0]
    return 1 / (mean * len(mean))


def _split(values: pd.Series) -> list[np.ndarray]:
    return [part.to_numpy() for _, part in values.groupby("house")]
