"""All that was measured in the grid, and what is estimated from it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.sensitivity.conditions import NONE, OWN_WEIGHTS, Condition
from caregiver_mj.studies.sensitivity.places import Place

if TYPE_CHECKING:
    from caregiver_mj.studies.sensitivity.measure import Figures

Measure = Callable[["Figures"], np.ndarray]  # of the episodes of one job, (episodes,)


@dataclasses.dataclass(frozen=True)
class Results:
    """All that was measured in the grid. Lists have a member for each of `EPSILONS`.

    Attributes:
        places: Where.
        figures: By house, condition and epsilon.
    """

    places: tuple[Place, ...]
    figures: dict[tuple[str, Condition, float], Figures]

    def left(self, place: Place, condition: Condition, weights: str = OWN_WEIGHTS) -> list[Estimate[float]]:
        """Share of the unassisted damage that is left; over several houses, of the mean over them."""
        pairs = self._pairs(place, condition, NONE, _damage(weights))
        if len(place.houses) == 1:
            return [intervals.of_ratio(one, other) for (one,), (other,) in pairs]
        return [two_level.of_ratio(ours, theirs) for ours, theirs in pairs]

    def difference(
        self, place: Place, ours: Condition, theirs: Condition, weights: str = OWN_WEIGHTS
    ) -> list[Estimate[float]]:
        """Damage an episode under one condition less that under another."""
        return self._differences(place, ours, theirs, _damage(weights))

    def toys_difference(self, place: Place, ours: Condition, theirs: Condition) -> list[Estimate[float]]:
        """Toy bins reached in an episode under one condition less those under another."""
        return self._differences(place, ours, theirs, lambda figures: figures.toys)

    def stops(self, place: Place, condition: Condition, reading: str) -> list[float]:
        """Mean timestep of the stop, by the reading "above" or "at"."""
        return [
            float(np.mean([getattr(one, f"stop_{reading}").mean() for one in self._of(place, condition, epsilon)]))
            for epsilon in EPSILONS
        ]

    def other_stops(self, place: Place, condition: Condition) -> float:
        """Share of the episodes, over houses and epsilons, whose stop the reading changes."""
        return self._mean(place, condition, lambda figures: figures.stop_at != figures.stop_above).item()

    def collisions(self, place: Place, condition: Condition) -> np.ndarray:
        """Mean collisions of each kind an episode, over houses and epsilons, (kinds,)."""
        return self._mean(place, condition, lambda figures: figures.collisions)

    def differs(self, place: Place, condition: Condition) -> float:
        """Share of the timesteps at whose end `nearest` would set about something else, over houses and epsilons."""
        return self._mean(place, condition, lambda figures: figures.differs).item()

    def mean_difference(self, house: str, ours: Condition, theirs: Condition) -> Estimate[float]:
        """Damage an episode under one condition less that under another, in one house, averaged over the epsilons."""
        one, other = (
            np.mean([self.figures[house, condition, epsilon].damage(OWN_WEIGHTS) for epsilon in EPSILONS], axis=0)
            for condition in (ours, theirs)
        )
        return intervals.of_difference(one, other)

    def _differences(self, place: Place, ours: Condition, theirs: Condition, measure: Measure) -> list[Estimate[float]]:
        pairs = self._pairs(place, ours, theirs, measure)
        if len(place.houses) == 1:
            return [intervals.of_difference(one, other) for (one,), (other,) in pairs]
        return [two_level.of_difference(one, other) for one, other in pairs]

    def _pairs(
        self, place: Place, ours: Condition, theirs: Condition, measure: Measure
    ) -> Iterator[tuple[list[np.ndarray], list[np.ndarray]]]:
        """For each epsilon what is measured in each house under both conditions."""
        for epsilon in EPSILONS:
            one, other = ([measure(o) for o in self._of(place, condition, epsilon)] for condition in (ours, theirs))
            yield one, other

    def _mean(self, place: Place, condition: Condition, measure: Measure) -> np.ndarray:
        """Over episodes, houses and epsilons."""
        found = [measure(one).mean(axis=0) for epsilon in EPSILONS for one in self._of(place, condition, epsilon)]
        return np.mean(found, axis=0)

    def _of(self, place: Place, condition: Condition, epsilon: float) -> list[Figures]:
        return [self.figures[house, condition, epsilon] for house in place.houses]


def _damage(weights: str) -> Measure:
    return lambda figures: figures.damage(weights)
