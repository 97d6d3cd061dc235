"""Feedback on the references: velocity commands within bounds, and an arm that yields to a push."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.scalar_motion import NOTHING, highest

GENTLY = 0.5  # share of the jerk with which a velocity approaches the wanted one; beyond, it may overshoot
_HALVINGS = 20  # steps of the search for the part of a change of acceleration that fits
_PUSHED = 0.002  # rad; deviation from its reference beyond which a joint has been pushed
_SETTLING = 0.1  # s; time in which an arm comes to rest, after which a deviation is due to a push
# Return after a push, exponential at its end: greatest rate, rad/s; its increase, rad/s^2; deviation that counts as
# none, rad.
_COMING_BACK, _EASING, _GONE = 0.15, 1.5, 1e-4


class FollowedVelocity:
    """A velocity command that follows a wanted velocity within limits.

    References keep these limits by themselves; feedback, and the removal and return of a part of the reference, do not.

    Attributes:
        limits: Bounds of velocity, acceleration and jerk.
        commanded: Last commanded velocity, m/s.
        acceleration: Last change of the command, m/s^2; zero after a change at once.
    """

    def __init__(self, limits: Limits, control_timestep: float):
        self.limits, self._timestep = limits, control_timestep
        self._wanted: Vector = (0.0, 0.0)
        self.commanded: Vector = (0.0, 0.0)
        self.acceleration: Vector = (0.0, 0.0)

    def follow(self, wanted: Vector, at_once: bool = False, goes_on: bool = True) -> Vector:
        """Return the velocity for the coming control step, m/s.

        Args:
            wanted: Velocity to follow, m/s.
            at_once: Whether to slow down to it without limits; limits of speeding up stay.
            goes_on: Whether the wanted velocity goes on changing as before; a bounded one does not.
        """
        if not goes_on:
            self._wanted = wanted
        before, bounded = self.commanded, self._towards(wanted)
        self.commanded = shortened(math.hypot(*bounded), *wanted) if at_once else bounded
        changed = (self.commanded[0] - before[0]) / self._timestep, (self.commanded[1] - before[1]) / self._timestep
        if at_once and (self.commanded == wanted or math.hypot(*changed) >= self.limits.acceleration + NOTHING):
            changed = (0.0, 0.0)  # it does not go on
        self.acceleration, self._wanted = changed, wanted
        return self.commanded

    def _towards(self, wanted: Vector) -> Vector:
        limits, step, (before_x, before_y) = self.limits, self._timestep, self.acceleration
        off_x, off_y = wanted[0] - self.commanded[0], wanted[1] - self.commanded[1]
        with_x, with_y = (wanted[0] - self._wanted[0]) / step, (wanted[1] - self._wanted[1]) / step
        x, y, most = off_x / step, off_y / step, limits.jerk * step
        if (
            math.hypot(x, y) <= limits.acceleration
            and math.hypot(x - before_x, y - before_y) <= most
            and math.hypot(x - with_x, y - with_y) <= most  # so that it can keep up with its change
            and self._fits(x, y)
        ):
            return wanted
        # Change with the wanted velocity, and approach it no faster than the approach can end on the way.
        off_x, off_y = self._wanted[0] - self.commanded[0], self._wanted[1] - self.commanded[1]  # without that change
        off = math.hypot(off_x, off_y)
        nearer = min(1.0 / step, math.sqrt(2 * GENTLY * limits.jerk / off)) if off else 0.0
        x, y = with_x + nearer * off_x, with_y + nearer * off_y
        x, y = shortened(limits.acceleration, x, y)
        x, y = shortened(most, x - before_x, y - before_y)
        x, y = self._fitting(*shortened(limits.acceleration, before_x + x, before_y + y))
        # This cuts only after a change at once, which may have left no room to end within the jerk.
        return shortened(limits.velocity + NOTHING, self.commanded[0] + step * x, self.commanded[1] + step * y)

    def _fits(self, x: float, y: float) -> bool:
        """Return whether an acceleration can end within the jerk before the top speed; a cut there would jerk more."""
        change, size = self.limits.jerk * self._timestep, math.hypot(x, y)
        steps = int(size / change)  # after this one until it has ended, less by one change at each
        times = self._timestep * (steps + 1) * (1.0 - steps * change / (2.0 * size)) if size else 0.0
        then = self.commanded[0] + times * x, self.commanded[1] + times * y
        return math.hypot(*then) <= self.limits.velocity + NOTHING

    def _fitting(self, x: float, y: float) -> Vector:
        """Return an acceleration, or the part that fits of the change to it from an ending one."""
        if self._fits(x, y):
            return x, y
        (before_x, before_y), change = self.acceleration, self.limits.jerk * self._timestep
        less_x, less_y = shortened(max(0.0, math.hypot(before_x, before_y) - change), before_x, before_y)

        def way(share: float) -> Vector:
            return less_x + share * (x - less_x), less_y + share * (y - less_y)

        return way(highest(lambda share: self._fits(*way(share)), 0.0, 1.0, _HALVINGS))


def shortened(most: float, x: float, y: float) -> Vector:
    """Return a vector, shortened to a greatest length."""
    length = math.hypot(x, y)
    return (x * most / length, y * most / length) if length > most else (x, y)


class GivingWay:
    """Compliance of an arm: its deviation from the reference under a push.

    Stiff servos would press on a child that walks into the arm, and follow a child that leaves: a strike. So an arm at
    rest stays where it is pushed, as a real one with contact sensing does, and returns slowly.

    Attributes:
        yields: Whether the arm yields to a push, because a child may be at it.
        offset: Deviation of each joint, rad, (joints,).
        is_off: Whether any joint deviates.
    """

    def __init__(self, joints: int):
        self.yields = self.is_off = False
        self.offset = np.zeros(joints)
        self._rate = 0.0  # rad/s; greatest rate of the return

    def follow(self, arm: np.ndarray, wanted: np.ndarray, rested: float, seconds: float) -> None:
        """Update the offset: to the measured deviation if the arm yields, else towards zero.

        Args:
            arm: Measured joint positions (joints,), rad.
            wanted: Reference joint positions (joints,), rad.
            rested: Time since the reference came to rest, s; not above 0 while it moves.
            seconds: Time since the last update, s.
        """
        if not self.yields:
            self._rate = min(_COMING_BACK, self._rate + _EASING * seconds)
            self.offset -= seconds * np.clip(self.offset / _SETTLING, -self._rate, self._rate)
            self.offset[np.abs(self.offset) < _GONE] = 0.0
        else:
            self._rate = 0.0
            if rested > _SETTLING:
                off = arm - wanted
                self.offset[:] = np.where(np.abs(off) < _PUSHED, 0.0, off)
        self.is_off = bool(self.offset.any())
