"""An arm that lets itself be pushed away, and comes back slowly."""

from __future__ import annotations

import numpy as np

_PUSHED = 0.002  # radians off its reference beyond which a joint has been pushed
_SETTLED = 0.1  # seconds of rest after which it is off for that reason only
# How it comes back: no faster than this, rad/s; getting as fast, rad/s^2; and slower and slower within so many seconds,
# until so little is left, radians.
_COMING_BACK, _EASING, _SETTLING, _GONE = 0.15, 1.5, 0.1, 1e-4


class GivingWay:
    """How far an arm is off where it reaches to, because somebody pushes it.

    Stiff servos would keep pressing on a child that walks into an arm, and follow one that goes away again: that is a
    strike. So an arm at rest stays where it is pushed, as real ones do that feel a contact, and takes its time after.

    Attributes:
        yields: Whether it lets itself be pushed away: a child may be at it.
        offset: How far each joint has been, radians, (joints,).
    """

    def __init__(self, joints: int):
        self.yields = False
        self.offset = np.zeros(joints)
        self._rate = 0.0  # at which it comes back at most, rad/s

    def follow(self, arm: np.ndarray, wanted: np.ndarray, rested: float, seconds: float) -> None:
        """Takes in where the arm has been pushed, or brings it back.

        Args:
            arm: Measured joint positions (joints,), radians.
            wanted: Those that it reaches to.
            rested: Seconds for which these have not changed; not above 0 while they do.
            seconds: Since the last time.
        """
        if not self.yields:
            self._rate = min(_COMING_BACK, self._rate + _EASING * seconds)
            self.offset -= seconds * np.clip(self.offset / _SETTLING, -self._rate, self._rate)
            self.offset[np.abs(self.offset) < _GONE] = 0.0
            return
        self._rate = 0.0
        if rested > _SETTLED:
            off = arm - wanted
            self.offset[:] = np.where(np.abs(off) < _PUSHED, 0.0, off)
