"""The houses in which the robot's skills are measured."""

from __future__ import annotations

import functools

from caregiver_mj.plans.floor_plan import FloorPlan

# Those of the package, and a generated one, by its seed: 13 x 14 cells with four candles and four bare tables.
HOUSES = ("paper", "apartment", "house-20")


@functools.cache  # plans keep what they have worked out
def load_house(name: str) -> FloorPlan:
    """Loads one of them, once in a process."""
    return FloorPlan.load(name)
