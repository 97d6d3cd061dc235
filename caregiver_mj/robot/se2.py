"""Poses (x, y, yaw) on the floor: vectors turned, and points as seen from a pose; metres and radians."""

from __future__ import annotations

import math

Vector = tuple[float, float]
Pose = tuple[float, float, float]


def rotate(yaw: float, vector: Vector) -> Vector:
    """A vector turned to the left by an angle."""
    c, s = math.cos(yaw), math.sin(yaw)
    return c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]


def to_world(pose: Pose, point: Vector) -> Vector:
    """Where a point given in the frame of a pose (x ahead, y to the left) lies in the house."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]


def to_local(pose: Pose, point: Vector) -> Vector:
    """The reverse of `to_world`: how far ahead and how far to the left of a pose a point lies."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = point[0] - pose[0], point[1] - pose[1]
    return c * dx + s * dy, c * dy - s * dx


def distance_to_line(point: Vector, start: Vector, end: Vector) -> float:
    """Metres from a point to the straight line from one place to another, ends included."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = dx * dx + dy * dy
    share = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / length if length else 0.0
    share = min(1.0, max(0.0, share))
    return math.hypot(point[0] - start[0] - share * dx, point[1] - start[1] - share * dy)
