"""Draws that are the same on every machine.

NumPy promises that the stream of a `RandomState` never changes, and whole numbers are rounded nowhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Thing = TypeVar("Thing")


def draw(random: np.random.RandomState, below: int) -> int:
    """A whole number from 0 on, below another one."""
    return int(random.randint(below, dtype=np.int64))


def pick(random: np.random.RandomState, things: Sequence[Thing], weights: Sequence[int]) -> Thing:
    """One of several things, by whole weights."""
    totals = np.cumsum(weights)
    return things[int(np.searchsorted(totals, draw(random, int(totals[-1])), side="right"))]
