"""What a caregiver answers with: a verb, its hazard and, where it has one, its destination."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from caregiver_mj.plans.hazards import NOTHING

# Names of the verbs that come with the package; each is a module of its own beside this one.
BLOCK, RELOCATE, STAND_ASIDE, DO_NOTHING = "block", "relocate", "stand aside", "nothing"


@dataclasses.dataclass(frozen=True)
class Intervention:
    """One intervention.

    Attributes:
        verb: Name of what to do, one of `VERBS`.
        hazard: Number in the house's table of hazards of what it is about, or NOTHING.
        destination: Where to, as the verb understands it (for a candle the index of a table), or NOTHING.
    """

    verb: str = STAND_ASIDE
    hazard: int = NOTHING
    destination: int = NOTHING


@dataclasses.dataclass(frozen=True)
class Interventions(Sequence[Intervention]):
    """An intervention for each of B worlds.

    Attributes:
        verb: Names of the verbs, (B,).
        hazard: Numbers of the hazards, (B,).
        destination: Destinations, (B,).
    """

    verb: np.ndarray
    hazard: np.ndarray
    destination: np.ndarray

    @classmethod
    def of(cls, interventions: Sequence[Intervention]) -> Interventions:
        """Makes a batch of single interventions."""
        verbs = np.array([one.verb for one in interventions], object)
        hazards = np.array([one.hazard for one in interventions], int)
        return cls(verbs, hazards, np.array([one.destination for one in interventions], int))

    @classmethod
    def idle(cls, batch: int) -> Interventions:
        """To stand aside, in B worlds."""
        return cls.of([Intervention()] * batch)

    def __len__(self) -> int:
        return len(self.verb)

    def __getitem__(self, world: int) -> Intervention:  # type: ignore[override]  # no slices
        return Intervention(str(self.verb[world]), int(self.hazard[world]), int(self.destination[world]))

    def where(self, mask: np.ndarray, other: Interventions) -> Interventions:
        """These where a mask (B,) holds, others elsewhere."""
        return Interventions(
            np.where(mask, self.verb, other.verb),
            np.where(mask, self.hazard, other.hazard),
            np.where(mask, self.destination, other.destination),
        )

    def begins_after(self, other: Interventions) -> np.ndarray:
        """Whether each is another one than before, (B,). A new destination alone does not make it another one."""
        return (self.verb != other.verb) | (self.hazard != other.hazard)
