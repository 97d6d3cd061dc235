"""All that was measured, and what is worked out from it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pandas as pd
from scipy import stats

from caregiver_mj.experiments.statistics import CONFIDENCE
from caregiver_mj.studies.grid_to_house.phases import DONE

EPSILONS = (1.0, 0.75, 0.5)
GOAL = 0.15  # the house may leave this much more damage than the grid, relative, averaged over the epsilons


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured.

    Attributes:
        episodes: How many, for each epsilon.
        alone: Damage without the caregiver in the grid and in the house, by epsilon, (episodes,) each.
        grid: The grid's episodes with the caregiver, by epsilon.
        house: The house's, likewise.
        many: How many episodes in the grid `reference` is from.
        reference: Damage left in the grid over that many, by epsilon.
        phases: The house's phases.
        seconds: What the time of the house's episodes went into, a row an episode.
        grid_delays: By how many seconds the grid's caregiver is slower than on the shortest way, by phase.
    """

    episodes: int
    alone: dict[float, tuple[np.ndarray, np.ndarray]]
    grid: dict[float, pd.DataFrame]
    house: dict[float, pd.DataFrame]
    many: int
    reference: dict[float, float]
    phases: pd.DataFrame
    seconds: pd.DataFrame
    grid_delays: dict[str, float]

    @property
    def done(self) -> pd.DataFrame:
        """The house's completed phases."""
        return self.phases[self.phases.end == DONE]

    def ratio(self) -> tuple[float, float, float]:
        """House over grid, averaged over the epsilons, with its interval."""
        return mean_ratio([(self.house[e].damage.to_numpy(), self.grid[e].damage.to_numpy()) for e in EPSILONS])


def mean_ratio(pairs: list[tuple[np.ndarray, np.ndarray]]) -> tuple[float, float, float]:
    """The mean of several ratios of means, and its bootstrap interval over episodes; NaN for a single one.

    Args:
        pairs: Samples of what is above and of what is below, (n,) each. Episode i has the same novice in all.
    """

    def statistic(*samples: np.ndarray, axis: int) -> np.ndarray:
        means = [sample.mean(axis) for sample in samples]
        return np.mean([a / b for a, b in zip(means[::2], means[1::2], strict=True)], axis=0)

    samples = tuple(values for pair in pairs for values in pair)
    mean = float(statistic(*(sample[None] for sample in samples), axis=-1)[0])
    if len(samples[0]) < 2:
        return mean, math.nan, math.nan
    interval = stats.bootstrap(
        samples, statistic, paired=True, vectorized=True, method="percentile", confidence_level=CONFIDENCE,
        rng=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return mean, float(interval.low), float(interval.high)
