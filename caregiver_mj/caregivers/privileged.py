"""Caregivers with privileged information, as upper bounds for the others.

The truth bypasses the percept: only a `PrivilegedCaregiver` receives it.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable

import numpy as np


@dataclasses.dataclass(frozen=True)
class Future:
    """The children's next T moves if nobody stands in their way."""

    cell: np.ndarray  # cells after each move, (T, B, K)
    # object that each move bumps into: stairwells first, then tables, or NOTHING, (T, B, K)
    object: np.ndarray


@dataclasses.dataclass(frozen=True)
class Truth:
    """The hidden state of the children."""

    goal: np.ndarray  # index of each child's toy bin, (B, K)
    epsilon: np.ndarray  # share of random moves of each child, (B, K)
    # computes the rest of the episode; None in a world that cannot
    future: Callable[[], Future] | None = None


class PrivilegedCaregiver(abc.ABC):
    """A caregiver that receives the truth."""

    @abc.abstractmethod
    def hear(self, truth: Truth) -> None:
        """Receive the truth after the children's last moves: once a timestep, after `watch`."""
