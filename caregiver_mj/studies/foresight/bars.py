"""What a run over many houses says of foresight; the house is the unit of chance."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pandas as pd

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.verdicts import (
    LEVEL,
    MARGINS,
    Comparison,
    Verdict,
    compare_means,
    holm,
    judge,
    not_inferior,
    sign_flip_p,
)

OURS, RULE, TOLD, FLOOR = "foresight", "paper", "knows-goal", "floor"


@dataclasses.dataclass(frozen=True, eq=False)
class Bars:
    """Episodes of a run.

    Attributes:
        name: What the run is called.
        rows: A row an episode, with the columns of `episodes.parquet`.
    """

    name: str
    rows: pd.DataFrame

    @functools.cached_property
    def caregivers(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.rows.caregiver.unique())

    @functools.cached_property
    def families(self) -> tuple[str, ...]:
        """The children, in order of appearance."""
        return tuple(self.rows.family.unique())

    @functools.cached_property
    def houses(self) -> tuple[str, ...]:
        """Names of the houses."""
        return tuple(sorted(self.rows.house.unique()))

    @functools.cached_property
    def _values(self) -> dict[tuple[str, str], pd.DataFrame]:
        ordered = self.rows.sort_values(["house", "episode"])
        return dict(iter(ordered.groupby(["caregiver", "family"], sort=False)))

    def of(self, caregiver: str, family: str, column: str = "damage") -> list[np.ndarray]:
        """What was measured in each house, a list of (episodes,)."""
        rows = self._values[caregiver, family]
        return [part.to_numpy(float) for _, part in rows.groupby("house")[column]]

    def mean(self, caregiver: str, family: str) -> float:
        """Damage of an episode, the mean over houses."""
        return float(two_level.house_means(self.of(caregiver, family)).mean())

    def left(self, caregiver: str, family: str) -> Estimate[float]:
        """Share of the unassisted damage that is left, of means over houses."""
        return two_level.of_ratio(self.of(caregiver, family), self.of("none", family))

    def shares(self, caregiver: str, families: tuple[str, ...]) -> list[np.ndarray]:
        """Damage in each house, as that of several kinds of children added up, each over its unassisted mean."""
        total = np.zeros(())
        for family in families:
            alone = two_level.house_means(self.of("none", family)).mean()
            total = total + np.array(self.of(caregiver, family)) / alone
        return list(total / len(families))

    def against(self, other: str, families: tuple[str, ...], caregiver: str = OURS) -> Comparison:
        """Damage less that with another caregiver, as a share of the unassisted damage."""
        ours, theirs = (self.shares(name, families) for name in (caregiver, other))
        difference = two_level.house_means(ours) - two_level.house_means(theirs)
        return judge(two_level.of_difference(ours, theirs), difference)

    def summed(self, caregiver: str) -> list[np.ndarray]:
        """Damage of an episode in each house, that of all children added up: episode i of each has the same chance."""
        return [np.sum(house, axis=0) for house in zip(*(self.of(caregiver, f) for f in self.families), strict=True)]

    def reduction(self, other: str, caregiver: str = OURS) -> tuple[Comparison, Comparison]:
        """The summed damage less that with another caregiver; by houses, and by episodes."""
        ours, theirs = self.summed(caregiver), self.summed(other)
        difference = two_level.house_means(ours) - two_level.house_means(theirs)
        by_houses = judge(two_level.of_difference(ours, theirs), difference)
        return by_houses, compare_means(np.concatenate(ours), np.concatenate(theirs))

    def gone(self, other: str, below: str | None = None, caregiver: str = OURS) -> Estimate[float]:
        """The share of the summed damage with another caregiver that is gone, or of that above a third's."""
        ours, theirs = self.summed(caregiver), self.summed(other)
        if below is not None:
            least = self.summed(below)
            ours, theirs = _less(ours, least), _less(theirs, least)
        value, low, high = two_level.of_ratio(ours, theirs)
        return Estimate(1 - value, 1 - high, 1 - low)

    def closed(self, families: tuple[str, ...], caregiver: str = OURS) -> Estimate[float]:
        """Share of the damage between the rule and who is told bin and epsilon that is gone."""
        rule, told, ours = (self.shares(name, families) for name in (RULE, TOLD, caregiver))
        return two_level.of_ratio(_less(rule, ours), _less(rule, told))

    def removed(self, families: tuple[str, ...], caregiver: str = OURS) -> Estimate[float]:
        """Share of the damage between the rule and the floor that is gone."""
        rule, floor, ours = (self.shares(name, families) for name in (RULE, FLOOR, caregiver))
        value, low, high = two_level.of_ratio(_less(ours, floor), _less(rule, floor))
        return Estimate(1 - value, 1 - high, 1 - low)

    def houses_with(self, other: str, family: str, caregiver: str = OURS) -> tuple[int, int, int]:
        """In how many houses there is less damage than with another caregiver, as much, and more."""
        ours, theirs = (two_level.house_means(self.of(name, family)) for name in (caregiver, other))
        return int((ours < theirs).sum()), int((ours == theirs).sum()), int((ours > theirs).sum())

    def clear(self, other: str, family: str, caregiver: str = OURS) -> tuple[int, int]:
        """In how many houses episodes show less damage, and more: by sign flips, at 5 % after Holm's correction."""
        gaps = np.stack(_less(self.of(caregiver, family), self.of(other, family)), axis=1)  # (episodes, houses)
        shown, means = holm(np.asarray(sign_flip_p(gaps))) <= LEVEL, gaps.mean(axis=0)
        return int((shown & (means < 0)).sum()), int((shown & (means > 0)).sum())

    def toys(self, family: str, caregiver: str = OURS) -> tuple[Estimate[float], Verdict]:
        """Toys reached over those without a caregiver, and whether that is no worse by the margin."""
        ours, alone = (self.of(name, family, "toys_reached") for name in (caregiver, "none"))
        ratio = two_level.of_ratio(ours, alone)
        kept, whole = (two_level.house_means(values) for values in (ours, alone))
        return ratio, not_inferior(kept, whole, MARGINS["toys_reached"], more_is_better=True, ratio=ratio)

    def denied(self, family: str, caregiver: str = OURS) -> tuple[float, Estimate[float]]:
        """Free moves denied in an episode, and how many more that are than with the rule."""
        ours, rule = (self.of(name, family, "moves_blocked_free") for name in (caregiver, RULE))
        return float(two_level.house_means(ours).mean()), two_level.of_difference(ours, rule)


def _less(ours: list[np.ndarray], theirs: list[np.ndarray]) -> list[np.ndarray]:
    return [a - b for a, b in zip(ours, theirs, strict=True)]
