"""A quantity for several novices or families."""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Series:
    """A quantity for each novice or family; all arrays have that length, NaN where there is no number.

    Attributes:
        label: What it is called in the legend.
        mean: Means.
        low: Lower ends of their intervals.
        high: Upper ends, NaN also where an interval has none.
        sd: Standard deviations, if they are to be shown.
        published: The paper's means, if it has any.
    """

    label: str
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    sd: np.ndarray | None = None
    published: np.ndarray | None = None
