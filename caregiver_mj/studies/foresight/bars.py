"""What a run over many houses says of foresight; the house is the unit of chance."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pandas as pd

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.verdicts import MARGINS, Comparison, Verdict, compare_means, judge, not_inferior

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

    def pooled(self, other: str, caregiver: str = OURS) -> tuple[Comparison, Comparison]:
        """Damage of an episode less that with another caregiver, over all children; by houses, and by episodes."""
        ours, theirs = ([np.concatenate(h) for h in zip(*self._all(name), strict=True)] for name in (caregiver, other))
        difference = two_level.house_means(ours) - two_level.house_means(theirs)
        by_houses = judge(two_level.of_difference(ours, theirs), difference)
        return by_houses, compare_means(np.concatenate(ours), np.concatenate(theirs))

    def _all(self, caregiver: str) -> list[list[np.ndarray]]:
        return [self.of(caregiver, family) for family in self.families]

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
        """In how many houses a 95 % interval over episodes has less damage, and more."""
        gaps = [a - b for a, b in zip(self.of(caregiver, family), self.of(other, family), strict=True)]
        t = [gap.mean() / max(gap.std(ddof=1) / len(gap) ** 0.5, 1e-9) for gap in gaps]
        return int((np.array(t) < -1.96).sum()), int((np.array(t) > 1.96).sum())

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
