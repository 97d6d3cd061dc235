"""All that was measured, and what is worked out from it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd

from caregiver_mj.experiments.intervals import Estimate, of_mean_ratio
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

    def ratio(self) -> Estimate:
        """House over grid, averaged over the epsilons, with its interval."""
        house, grid = (np.stack([world[e].damage for e in EPSILONS], axis=1) for world in (self.house, self.grid))
        return of_mean_ratio(house, grid)
