"""Pieces of the base's path, and the plane geometry of polylines. Points and vectors are (x, y), metres."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ruckig import Trajectory

from caregiver_mj.robot.se2 import Vector


@dataclasses.dataclass(frozen=True)
class Piece:
    """A part of a path: a ruckig trajectory in a frame of its own, from `begin` on."""

    begin: float
    origin: Vector
    axis: Vector  # direction of the first coordinate; the second is a quarter turn to its left
    trajectory: Trajectory

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration at a time since the start of the path."""
        position, velocity, acceleration = self.trajectory.at_time(time - self.begin)
        c, s = self.axis
        if len(position) == 1:
            p, v, a = position[0], velocity[0], acceleration[0]
            return (self.origin[0] + c * p, self.origin[1] + s * p), (c * v, s * v), (c * a, s * a)
        (p, q), (v, w), (a, b) = position, velocity, acceleration
        x, y = self.origin
        return (x + c * p - s * q, y + s * p + c * q), (c * v - s * w, s * v + c * w), (c * a - s * b, s * a + c * b)


def without_repeats(points: Sequence[Vector]) -> list[Vector]:
    """A polyline without points that are where the one before them is."""
    kept = [(float(points[0][0]), float(points[0][1]))]
    for x, y in points[1:]:
        if math.hypot(x - kept[-1][0], y - kept[-1][1]) > 1e-4:
            kept.append((float(x), float(y)))
    return kept


def direction(a: Vector, b: Vector) -> tuple[Vector, float]:
    """Unit vector from one point to another, and their distance."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return ((b[0] - a[0]) / length, (b[1] - a[1]) / length), length


def in_frame(vector: Vector, axis: Vector) -> Vector:
    """Components of a vector along an axis, and along its quarter turn to the left."""
    return vector[0] * axis[0] + vector[1] * axis[1], -vector[0] * axis[1] + vector[1] * axis[0]


def angle(a: Vector, b: Vector) -> float:
    """By how much one turns from one direction into another, 0 to pi radians."""
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))
