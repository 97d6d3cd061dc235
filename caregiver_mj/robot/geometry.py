"""Poses (x, y, yaw) on the floor, m and rad, and grips: orientations of the hand with a candle."""

from __future__ import annotations

import math

import numpy as np

Vector = tuple[float, float]
Pose = tuple[float, float, float]
UPRIGHT = math.cos(math.radians(20.0))  # cosine of the tilt up to which a candle counts as standing for grips


def rotate(yaw: float, vector: Vector) -> Vector:
    """Return a vector turned to the left by an angle, rad."""
    c, s = math.cos(yaw), math.sin(yaw)
    return c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]


def to_world(pose: Pose, point: Vector) -> Vector:
    """Return a point in the house, given its place in the frame of a pose, x ahead and y to the left."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]


def to_local(pose: Pose, point: Vector) -> Vector:
    """Return the inverse of `to_world`: a point's distances ahead of a pose and to its left."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = point[0] - pose[0], point[1] - pose[1]
    return c * dx + s * dy, c * dy - s * dx


def distance_to_line(point: Vector, start: Vector, end: Vector) -> float:
    """Return the distance of a point from a line segment, m."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = dx * dx + dy * dy
    share = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / length if length else 0.0
    share = min(1.0, max(0.0, share))
    return math.hypot(point[0] - start[0] - share * dx, point[1] - start[1] - share * dy)


def upwards(orientations: np.ndarray) -> np.ndarray:
    """Return the vertical axis after rotations by quaternions (w, x, y, z), unit vectors (3,) or (n, 3)."""
    w, x, y, z = orientations.T
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]).T


def hand_rotation(heading: float, pitch: float) -> np.ndarray:
    """Return the rotation (3, 3) of a hand that points along a heading and down by a pitch, rad, with level fingers."""
    ahead, up = np.array([math.cos(heading), math.sin(heading), 0.0]), np.array([0.0, 0.0, 1.0])
    approach = math.cos(pitch) * ahead - math.sin(pitch) * up
    sideways = np.array([math.sin(heading), -math.cos(heading), 0.0])
    return np.stack([np.cross(sideways, approach), sideways, approach], axis=1)


def upright_grip(axis: np.ndarray, pitch: float) -> np.ndarray:
    """Return the rotation (3, 3) of the hand for a grip with which the candle is upright in the tucked arm.

    The candle's axis, from foot to top, is a unit vector (3,) in the base's frame. The hand tilts from its usual pitch,
    rad, as the candle does from upright; it comes from above a lying one.
    """
    if axis[2] > UPRIGHT:
        return hand_rotation(0.0, pitch)
    return hand_rotation(math.atan2(axis[1], axis[0]), pitch + math.acos(axis[2]))
