"""Tables that are higher or lower than that of the model."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.fittings import read_model
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import TABLE

LOWEST, HIGHEST = 0.45, 0.75  # metres; from a coffee table to a dining table, and within the arms' reach

_ON_THE_FLOOR = ("leg_ne", "leg_nw", "leg_sw", "leg_se", "top")  # parts that reach from there up to the board
_SHELF = "shelf"  # stays where it is


def table_model(height: float) -> mujoco.MjSpec:
    """Return the model of a table whose top is at a height in metres."""
    model = read_model(TABLE.model)
    higher = height - layout.TABLE_HEIGHT
    for geom in model.geoms if higher else ():
        if geom.name in _ON_THE_FLOOR:
            geom.pos[2] += higher / 2
            geom.size[2] += higher / 2
        elif geom.name != _SHELF:
            geom.pos[2] += higher
    return model


def draw_heights(height: float | Sequence[float] | None, tables: int, random: np.random.RandomState) -> np.ndarray:
    """Return the heights of the tops of tables, (tables,), metres.

    Args:
        height: That of all of them; or the lowest and the highest, and each is drawn in between; or None for that of
            the model.
        tables: How many.
        random: What they are drawn with.

    Raises:
        CaregiverError: They are out of range.
    """
    if height is None:
        return np.full(tables, layout.TABLE_HEIGHT)
    heights: list[Any] = [height] if isinstance(height, (float, numbers.Real, str)) else list(height)
    good = all(isinstance(one, numbers.Real) and LOWEST <= float(one) <= HIGHEST for one in heights)
    if not good or len(heights) not in (1, 2) or heights[0] > heights[-1]:
        raise CaregiverError(
            f"table_height must be a height in {LOWEST:g} to {HIGHEST:g} m, or the lowest and the highest, "
            f"got {height!r}"
        )
    lowest, highest = heights[0], heights[-1]
    return np.full(tables, float(lowest)) if len(heights) == 1 else random.uniform(lowest, highest, tables)
