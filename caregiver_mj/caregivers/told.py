"""Caregivers that are told what nobody can see, to compare others with.

What is told goes past the percept, to a `ToldCaregiver` and nobody else, so that whoever is not one has seen nothing.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable

import numpy as np


@dataclasses.dataclass(frozen=True)
class Future:
    """What children will do in the next T timesteps if nobody stands in their way."""

    cell: np.ndarray  # their cells after each of their moves, (T, B, K)
    # number of the object that each move bumps into, the stairwells first, then the tables, or NOTHING, (T, B, K)
    object: np.ndarray


@dataclasses.dataclass(frozen=True)
class Truth:
    """What a world knows of its children."""

    goal: np.ndarray  # index of the toy bin that each goes to, (B, K)
    epsilon: np.ndarray  # share of random moves of each, (B, K)
    # works out what will come, to the end of the episode; None in a world that cannot
    future: Callable[[], Future] | None = None


class ToldCaregiver(abc.ABC):
    """A caregiver that is told the truth."""

    @abc.abstractmethod
    def hear(self, truth: Truth) -> None:
        """Take in the truth as it is after the children's last moves: called once a novice timestep, after `watch`."""
