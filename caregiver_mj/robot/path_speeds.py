"""How fast the base may be along a polyline with blended corners."""

from __future__ import annotations

import math

from caregiver_mj.robot.limits import Limits


class PathSpeeds:
    """Speeds and lengths within limits: of straight pieces that end at a speed, and of corners."""

    def __init__(self, limits: Limits, deviation: float):
        """Prepares it.

        Args:
            limits: Bounds of speed, acceleration and jerk.
            deviation: Metres by which a blended corner may cut inside of the polyline.
        """
        self._limits, self._deviation = limits, deviation

    def time_to_change(self, change: float) -> float:
        """Seconds for a jerk-limited change of velocity, from and to zero acceleration."""
        a, j = self._limits.acceleration, self._limits.jerk
        return change / a + a / j if change >= a * a / j else 2 * math.sqrt(change / j)

    def distance_to_change(self, speed: float, end: float) -> float:
        """Metres in which the speed changes from one to another."""
        return (speed + end) / 2 * self.time_to_change(abs(speed - end))

    def reachable(self, speed: float, distance: float) -> float:
        """The highest speed to reach from another within a distance (or to brake from to it)."""
        low, high = speed, self._limits.velocity
        if high <= low or self.distance_to_change(speed, high) <= distance:
            return high
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if self.distance_to_change(speed, middle) <= distance else (low, middle)
        return low

    def corner_speed_from(self, speed: float, length: float, turn: float, most: float) -> float:
        """The highest speed, at most that, for the corner at the end of a line that is entered at a speed.

        The base must be able to brake to it before the corner begins, and a quicker corner begins earlier. It can if
        it could stop within the line.
        """

        def fits(end: float) -> bool:
            return self.distance_to_change(speed, min(speed, end)) <= length - self.corner_size(end, turn)

        if fits(most):
            return most
        low, high = 0.0, most
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if fits(middle) else (low, middle)
        return low

    def corner_size(self, speed: float, turn: float) -> float:
        """Length before, and after, the corner point that a blend at this speed takes."""
        return speed * self.time_to_change(2 * speed * math.sin(turn / 2)) / 2

    def corner_speed(self, turn: float, room: float) -> float:
        """The highest speed at which a corner fits into the lines beside it and cuts not too far inside."""
        if turn > 0.9 * math.pi:
            return 0.0
        size = min(0.95 * room, 2 * self._deviation / max(math.sin(turn / 2), 1e-6))
        low, high = 0.0, self._limits.velocity
        if self.corner_size(high, turn) <= size:
            return high
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if self.corner_size(middle, turn) <= size else (low, middle)
        return low
