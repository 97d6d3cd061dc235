"""Rotations of the hand. Its axes are: z its approach, y the one along which the fingers open, and x their normal."""

from __future__ import annotations

import math

import numpy as np

UPRIGHT = math.cos(math.radians(20.0))  # of a candle's tilt up to which it is gripped as one that stands


def hand_rotation(heading: float, pitch: float) -> np.ndarray:
    """Rotation (3, 3) of the hand that points along a heading, and below the horizontal by a pitch, in radians.

    Its fingers open sideways, level.
    """
    ahead, up = np.array([math.cos(heading), math.sin(heading), 0.0]), np.array([0.0, 0.0, 1.0])
    approach = math.cos(pitch) * ahead - math.sin(pitch) * up
    sideways = np.array([math.sin(heading), -math.cos(heading), 0.0])
    return np.stack([np.cross(sideways, approach), sideways, approach], axis=1)


def upright_grip(axis: np.ndarray, pitch: float) -> np.ndarray:
    """Rotation (3, 3) of the hand for a grip in which a candle stands upright once the arm is tucked.

    Where the candle is tilted from upright, the hand is tilted alike from its usual pitch; it comes from above one
    that lies.

    Args:
        axis: Unit vector from the candle's foot to its top in the base's frame, (3,).
        pitch: The hand's usual pitch, radians.
    """
    if axis[2] > UPRIGHT:
        return hand_rotation(0.0, pitch)
    return hand_rotation(math.atan2(axis[1], axis[0]), pitch + math.acos(axis[2]))
