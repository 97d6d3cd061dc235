"""An arm that lets itself be pushed away, and comes back slowly."""

from __future__ import annotations

import numpy as np

_PUSHED = 0.002  # radians off its reference beyond which a joint has been pushed
_COMING_BACK = 0.15  # rad/s


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

    def follow(self, arm: np.ndarray, wanted: np.ndarray, at_rest: bool, seconds: float) -> None:
        """Takes in where the arm has been pushed, or brings it back.

        Args:
            arm: Measured joint positions (joints,), radians.
            wanted: Those that it reaches to.
            at_rest: Whether these do not change.
            seconds: Since the last time.
        """
        if not self.yields:
            self.offset -= np.clip(self.offset, -_COMING_BACK * seconds, _COMING_BACK * seconds)
        elif at_rest:
            off = arm - wanted
            self.offset[:] = np.where(np.abs(off) < _PUSHED, 0.0, off)
