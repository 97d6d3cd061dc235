"""Episodes as samples, for the intervals: those of one house, or those of each of several houses."""

from __future__ import annotations

import types
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, two_level

CELL = ["world", "family", "epsilon"]  # episodes that differ in one of these are not put together


class Sample:
    """Episodes of one caregiver with the same children, in one house or in several.

    Attributes:
        rows: A row an episode, ordered by house and by episode.
        houses: In how many houses.
    """

    def __init__(self, rows: pd.DataFrame):
        codes, names = pd.factorize(rows["house"], sort=True)
        order = np.lexsort((rows["episode"].to_numpy(), codes))
        self.rows, self.houses = rows.iloc[order], len(names)
        self._starts = np.searchsorted(codes[order], np.arange(1, len(names)))

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def estimators(self) -> types.ModuleType:
        """Where `of_mean`, `of_difference` and `of_ratio` of its values are."""
        return intervals if self.houses == 1 else two_level

    def values(self, columns: Sequence[str]) -> np.ndarray | list[np.ndarray]:
        """What was measured in each episode, (episodes, columns); of several houses a list of that."""
        data = self.rows[list(columns)].to_numpy(float)
        return data if self.houses == 1 else np.split(data, self._starts)

    def units(self, columns: Sequence[str]) -> np.ndarray:
        """What chance is over: each episode in one house, else the mean of each house; (units, columns)."""
        values = self.values(columns)
        return values if isinstance(values, np.ndarray) else two_level.house_means(values)


def samples(episodes: pd.DataFrame) -> Iterator[tuple[dict[str, object], str, Sample]]:
    """What makes a cell, the name of a caregiver, and its sample; all in order of appearance."""
    for (*values, caregiver), rows in episodes.groupby([*CELL, "caregiver"], sort=False):
        yield dict(zip(CELL, values, strict=True)), caregiver, Sample(rows)


def pairs(episodes: pd.DataFrame, caregiver: str, baseline: str) -> Iterator[tuple[dict[str, object], Sample, Sample]]:
    """What makes a cell, and the samples of two caregivers, unit i of one belonging to unit i of the other.

    Raises:
        CaregiverError: There is no such caregiver, or an episode of one has no counterpart with the other.
    """
    names = episodes["caregiver"].unique()
    for name in (caregiver, baseline):
        if name not in names:
            raise CaregiverError(f"no episodes with the caregiver '{name}': there are {', '.join(names)}")
    for values, rows in episodes[episodes.caregiver.isin((caregiver, baseline))].groupby(CELL, sort=False):
        ours, theirs = (Sample(rows[rows.caregiver == name]) for name in (caregiver, baseline))
        key = dict(zip(CELL, values, strict=True))
        _check_paired(ours.rows, theirs.rows, f"'{caregiver}' or '{baseline}'", key)
        yield key, ours, theirs


def _check_paired(ours: pd.DataFrame, theirs: pd.DataFrame, who: str, key: dict[str, object]) -> None:
    keys = ["house", "episode"]
    if len(ours) == len(theirs) and (ours[keys].to_numpy() == theirs[keys].to_numpy()).all():
        return
    lone = int((pd.concat([ours[keys], theirs[keys]]).value_counts() != 2).sum())
    which = ", ".join(f"{name} {value}" for name, value in key.items())
    raise CaregiverError(f"{lone} episodes of {who} have no counterpart ({which})")
