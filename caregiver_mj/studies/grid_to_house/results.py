"""All that was measured."""

from __future__ import annotations

import dataclasses

import pandas as pd

from caregiver_mj.studies.grid_to_house.handicap import Handicap
from caregiver_mj.studies.grid_to_house.phases import DONE
from caregiver_mj.studies.grid_to_house.rows import Rows

GOAL = 0.15  # the house may leave this much more damage than the grid, relative, averaged over the epsilons


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured.

    Attributes:
        rows: The episodes in both worlds.
        aside: Those in a house that does not count, if any.
        levels: Damage in the grid at each level of the breakdown: a row a house and episode, a column an epsilon.
        handicaps: The handicap of each level.
        phases: The house's phases.
        seconds: What the time of the watched episodes went into, a row an episode.
        same: How many watched episodes have the damage that their row has, and how many there are.
        delays: At the first and last level, mean seconds by which a phase takes longer than on the shortest way.
    """

    rows: Rows
    aside: Rows | None
    levels: dict[str, pd.DataFrame]
    handicaps: dict[str, Handicap]
    phases: pd.DataFrame
    seconds: pd.DataFrame
    same: tuple[int, int]
    delays: dict[str, float]

    @property
    def done(self) -> pd.DataFrame:
        """The house's completed phases."""
        return self.phases[self.phases.end == DONE]

    @property
    def many(self) -> int:
        """Episodes in each house with each novice at each level."""
        return len(next(iter(self.levels.values()))) // len(self.rows.houses)
