"""How close the candle in the robot's hand comes to the children, with its flame and with its wax."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.house.physics import Physics
from caregiver_mj.recording.contacts import FAR, Contacts
from caregiver_mj.robot.view import CHILD_RADIUS

# The candle as in models/candle.xml: spheres along its axis, by their height above its foot, metres.
WAX_RADIUS, FLAME_RADIUS = 0.022, 0.016
_WAX = np.linspace(WAX_RADIUS, 0.16 - WAX_RADIUS, 8)
_FLAME = np.linspace(0.170 + FLAME_RADIUS, 0.246 - FLAME_RADIUS, 3)
_SPHERES = np.concatenate([_WAX, _FLAME])
_BODY = 0.15, 0.68  # metres above the floor between which the axis of a child's body is, as in models/toddler.xml
_IN_HAND = 0.04  # metres between the fingertips' middle and the axis of a candle that they hold
_LENGTH = 0.30  # metres from the fingertips' middle to the farthest of a candle that they hold, and more


def watch_candle(physics: Physics, seconds: float, tally: Contacts) -> None:
    """Takes in where a candle in the hand is, if there is one.

    Args:
        physics: The simulation.
        seconds: Of a control timestep.
        tally: What is counted.
    """
    if not physics.is_gripping():
        return
    pinch, children = physics.pinch_position(), physics.toddler_positions()[:, :2]
    hand = pinch[:2].tolist()
    if min(math.dist(child, hand) for child in children.tolist()) > FAR + _LENGTH + CHILD_RADIUS:
        return  # as if it were nowhere
    poses = physics.candle_poses()
    if not len(poses):
        return
    axes = _upward(poses[:, 3:])
    from_foot = pinch - poses[:, :3]
    along = np.clip((from_foot * axes).sum(axis=1), _WAX[0], _WAX[-1])
    off = np.linalg.norm(from_foot - along[:, None] * axes, axis=1)
    nearest = int(off.argmin())
    if off[nearest] > _IN_HAND:
        return
    distances = _distances(poses[nearest, :3] + _SPHERES[:, None] * axes[nearest], children)
    wax = min(distances[: len(_WAX)]) - CHILD_RADIUS - WAX_RADIUS
    flame = min(distances[len(_WAX) :]) - CHILD_RADIUS - FLAME_RADIUS
    tally.carry(min(FAR, max(0.0, flame)), min(FAR, max(0.0, wax)), seconds)


def _upward(orientations: np.ndarray) -> np.ndarray:
    """Axes of candles, unit vectors (candles, 3), by quaternions (candles, 4)."""
    w, x, y, z = orientations.T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)


def _distances(points: np.ndarray, children: np.ndarray) -> list[float]:
    """From each of points (n, 3) to the axis of the nearest child (children, 2), metres."""
    across = np.linalg.norm(points[:, None, :2] - children, axis=2)  # (n, children)
    low, high = _BODY
    beyond = np.maximum(0.0, np.maximum(points[:, 2] - high, low - points[:, 2]))
    return np.hypot(across, beyond[:, None]).min(axis=1).tolist()
