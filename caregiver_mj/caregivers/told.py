"""Caregivers that are told what nobody can see: bounds to compare with, which no real one can reach by merit.

What is told goes past the percept, to a `ToldCaregiver` and nobody else, so that whoever is not one has seen nothing.
"""

from __future__ import annotations

import abc
import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Truth:
    """What a world knows of its children.

    Attributes:
        goal: Index of the toy bin that each goes to, (B, K).
        epsilon: Share of random moves of each, (B, K).
    """

    goal: np.ndarray
    epsilon: np.ndarray


class ToldCaregiver(abc.ABC):
    """A caregiver that is told the truth."""

    @abc.abstractmethod
    def hear(self, truth: Truth) -> None:
        """Takes in the truth as it is after the children's last moves: called once a novice timestep, after `watch`."""
