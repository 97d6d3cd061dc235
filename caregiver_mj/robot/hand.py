"""Where the hand is, and what it has got."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.robot import se2
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.view import CANDLE_HEIGHT, CANDLE_RADIUS, View

ATTEMPTS = 3  # at a grasp

_LOOSE = 0.004  # metres by which they are farther from each other when they have let go of it
_GIVES = 0.01  # metres by which the fingers, both together, may be nearer to each other than a candle is thick


def hand_position(view: View, robot: Embodiment) -> np.ndarray:
    """The pinch point between a robot's fingers, in the house, (3,)."""
    x, y, z = arm_of(robot).pinch(view.arm).tolist()
    return np.array([*se2.to_world(view.base, (x, y)), z])


def hand_offset(view: View, robot: Embodiment) -> Vector:
    """Where that is from the base's middle, along the house's axes, (x, y)."""
    x, y, _ = hand_position(view, robot).tolist()
    return x - view.base[0], y - view.base[1]


def has_in_hand(view: View, robot: Embodiment, candle: int) -> bool:
    """Whether a candle is between the fingers, and they have closed on it."""
    if hand_is_empty(view):
        return False
    return math.dist(view.candles[candle].tolist(), hand_position(view, robot).tolist()) < CANDLE_HEIGHT


def is_round_candle(fingers: float) -> bool:
    """Whether fingers, so far off the middle both together, have closed on a candle."""
    return 2 * CANDLE_RADIUS - _GIVES <= fingers < 2 * CANDLE_RADIUS + _LOOSE


def hand_is_empty(view: View) -> bool:
    """Whether the fingers have closed on nothing: they are nearer to the middle than they can be round a candle."""
    return view.fingers < 2 * CANDLE_RADIUS - _GIVES
