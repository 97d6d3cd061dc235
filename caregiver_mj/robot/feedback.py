"""What feedback adds to references: a base's velocity within bounds, and an arm that gives way where it is pushed."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.scalar_motion import NOTHING, highest

GENTLY = 0.5  # share of its jerk with which a velocity comes to what it is to be: it must not overshoot that
_HALVINGS = 20  # of a change of acceleration of which there is only room for a part
_PUSHED = 0.002  # radians off its reference beyond which a joint has been pushed
_SETTLING = 0.1  # seconds in which an arm that moves comes to rest; later it is off for that reason only
# How it comes back: no faster than this, rad/s; getting as fast, rad/s^2; and, slower and slower as it settles, until
# so little is left, radians.
_COMING_BACK, _EASING, _GONE = 0.15, 1.5, 1e-4


class FollowedVelocity:
    """The velocity commanded to a base that cannot have the wanted one at once.

    References keep these bounds by themselves; feedback does not, nor what is taken away from them or comes back.

    Attributes:
        limits: Its bounds.
        commanded: The last commanded velocity, m/s.
        acceleration: What it did to the one before, m/s^2; zero if it was commanded at once.
    """

    def __init__(self, limits: Limits, control_timestep: float):
        self.limits, self._timestep = limits, control_timestep
        self._wanted: Vector = (0.0, 0.0)
        self.commanded: Vector = (0.0, 0.0)
        self.acceleration: Vector = (0.0, 0.0)

    def follow(self, wanted: Vector, at_once: bool = False, goes_on: bool = True) -> Vector:
        """Return the velocity for the coming control timestep, m/s.

        Args:
            wanted: It shall come to this.
            at_once: Whatever that takes to slow down; it does not become faster than within the bounds.
            goes_on: Whether the wanted one goes on as it has changed; one that is kept within a bound stays there.
        """
        if not goes_on:
            self._wanted = wanted
        before, bounded = self.commanded, self._towards(wanted)
        speed, most = math.hypot(*wanted), math.hypot(*bounded)
        if not at_once:
            self.commanded = bounded
        else:
            self.commanded = (wanted[0] * most / speed, wanted[1] * most / speed) if speed > most else wanted
        changed = (self.commanded[0] - before[0]) / self._timestep, (self.commanded[1] - before[1]) / self._timestep
        # It does not go on with what it had to do at once.
        is_bounded = self.commanded != wanted and math.hypot(*changed) < self.limits.acceleration + NOTHING
        self.acceleration = changed if is_bounded or not at_once else (0.0, 0.0)
        self._wanted = wanted
        return self.commanded

    def _towards(self, wanted: Vector) -> Vector:
        limits, step, (before_x, before_y) = self.limits, self._timestep, self.acceleration
        off_x, off_y = wanted[0] - self.commanded[0], wanted[1] - self.commanded[1]
        with_x, with_y = (wanted[0] - self._wanted[0]) / step, (wanted[1] - self._wanted[1]) / step
        x, y, most = off_x / step, off_y / step, limits.jerk * step
        if (
            math.hypot(x, y) <= limits.acceleration
            and math.hypot(x - before_x, y - before_y) <= most
            and math.hypot(x - with_x, y - with_y) <= most  # that it can go on with what is wanted
            and self._fits(x, y)
        ):
            return wanted
        # As the wanted one changes, and nearer to it: no faster than this can be brought to nothing on the way there.
        off_x, off_y = self._wanted[0] - self.commanded[0], self._wanted[1] - self.commanded[1]  # without that change
        off = math.hypot(off_x, off_y)
        nearer = min(1.0 / step, math.sqrt(2 * GENTLY * limits.jerk / off)) if off else 0.0
        x, y = with_x + nearer * off_x, with_y + nearer * off_y
        x, y = _within(limits.acceleration, x, y)
        x, y = _within(most, x - before_x, y - before_y)
        x, y = self._fitting(*_within(limits.acceleration, before_x + x, before_y + y))
        # This cuts nothing but after what was at once, which may have left no room for its end.
        return _within(limits.velocity + NOTHING, self.commanded[0] + step * x, self.commanded[1] + step * y)

    def _fits(self, x: float, y: float) -> bool:
        """Whether an acceleration can cease within the jerk before the highest speed: cut there, it would jerk."""
        change, size = self.limits.jerk * self._timestep, math.hypot(x, y)
        steps = int(size / change)  # after this one until it has ceased, by one change less at each
        times = self._timestep * (steps + 1) * (1.0 - steps * change / (2.0 * size)) if size else 0.0
        then = self.commanded[0] + times * x, self.commanded[1] + times * y
        return math.hypot(*then) <= self.limits.velocity + NOTHING

    def _fitting(self, x: float, y: float) -> Vector:
        """An acceleration, or as much of the way there from one that ceases as fits."""
        if self._fits(x, y):
            return x, y
        (before_x, before_y), change = self.acceleration, self.limits.jerk * self._timestep
        less_x, less_y = _within(max(0.0, math.hypot(before_x, before_y) - change), before_x, before_y)

        def way(share: float) -> Vector:
            return less_x + share * (x - less_x), less_y + share * (y - less_y)

        return way(highest(lambda share: self._fits(*way(share)), 0.0, 1.0, _HALVINGS))


def _within(most: float, x: float, y: float) -> Vector:
    """A vector, shortened if need be."""
    length = math.hypot(x, y)
    return (x * most / length, y * most / length) if length > most else (x, y)


class GivingWay:
    """How far an arm is off where it reaches to, because something pushes it.

    Stiff servos would keep pressing on a child that walks into an arm, and follow one that goes away again: that is a
    strike. So an arm at rest stays where it is pushed, as real ones do that feel a contact, and takes its time after.

    Attributes:
        yields: Whether it lets itself be pushed away: a child may be at it.
        offset: How far each joint has been, radians, (joints,).
        is_off: Whether any has.
    """

    def __init__(self, joints: int):
        self.yields = self.is_off = False
        self.offset = np.zeros(joints)
        self._rate = 0.0  # at which it comes back at most, rad/s

    def follow(self, arm: np.ndarray, wanted: np.ndarray, rested: float, seconds: float) -> None:
        """Take in where the arm has been pushed, or bring it back.

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
        else:
            self._rate = 0.0
            if rested > _SETTLING:
                off = arm - wanted
                self.offset[:] = np.where(np.abs(off) < _PUSHED, 0.0, off)
        self.is_off = bool(self.offset.any())
