"""A knock that brings a candle down before the robot comes."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.house.physics import Physics

_FORCE, _SECONDS, _HEIGHT = (1.2, 2.5), 0.16, 0.07  # newtons, how long, metres above the middle of the candle
_WITHIN = 1.0  # seconds in which it happens


class Knock:
    """Knocks a candle over in the first second of an episode: a push near its top, in any direction."""

    def __init__(self, physics: Physics, candle: int, seed: int):
        self._data = physics.data.ptr
        self._body = physics.model.ptr.body(f"candle_{candle}/candle").id
        random = np.random.default_rng(seed)
        self._start, angle = random.uniform(0.0, _WITHIN - _SECONDS), random.uniform(-math.pi, math.pi)
        force = random.uniform(*_FORCE) * np.array([math.cos(angle), math.sin(angle), 0.0])
        self._wrench = np.concatenate([force, np.cross([0.0, 0.0, _HEIGHT], force)])

    def apply(self) -> None:
        """Pushes, or does not, until the next call."""
        pushes = 0.0 <= self._data.time - self._start < _SECONDS
        self._data.xfrc_applied[self._body] = self._wrench if pushes else 0.0
