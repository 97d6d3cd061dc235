"""Which candles tip over on the way, whether or not they stand again in the end."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.house.physics import Physics

_TIPPED = math.cos(math.radians(30.0))  # of a candle's tilt


class Falls:
    """The candles of one relocation."""

    def __init__(self, physics: Physics):
        self._physics = physics
        self._tipped = np.zeros(len(physics.candle_upright()), bool)

    def look(self) -> None:
        """Call at every control timestep."""
        self._tipped |= self._physics.candle_upright() < _TIPPED

    @property
    def tipped(self) -> int:
        """How many have leaned by more than 30 degrees at some time."""
        return int(self._tipped.sum())
