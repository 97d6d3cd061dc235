"""What the robot and candles touch that they should not."""

from __future__ import annotations

import numpy as np

from caregiver_mj.house.physics import Physics

# Whose touch is not worth telling.
_FINE = {"robot": ("candle", "toddler"), "candle": ("robot", "table", "candle")}
_GROUND = "floor"


class Touches:
    """What the robot touches, save candles and the toddler, and candles, save tables, at every physics step.

    Attributes:
        pairs: Names of those that have touched: part of the robot, or of a candle, and the other thing.
    """

    def __init__(self, physics: Physics):
        model, self._contact = physics.model.ptr, physics.data.ptr.contact
        self._names = [model.geom(i).name for i in range(model.ngeom)]
        kinds = [name.rstrip("0123456789").split("/")[0].rstrip("_0123456789") for name in self._names]
        self._tell = np.array([[b not in _FINE.get(a, kinds) for b in kinds] for a in kinds])
        self.pairs: set[tuple[str, str]] = set()

    def look(self) -> None:
        """Call after every physics step."""
        for pair in self._contact.geom.tolist():
            for one, two in (pair, pair[::-1]):
                if self._tell[one, two] and self._names[two] != _GROUND:
                    self.pairs.add((self._names[one], self._names[two]))
