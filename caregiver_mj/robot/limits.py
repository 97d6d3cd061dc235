"""Bounds of the robot's motion. Commands stay within them at all times; the numbers are each embodiment's own."""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Limits:
    """Bounds of one scalar motion.

    Attributes:
        velocity: units / s.
        acceleration: units / s^2.
        jerk: units / s^3.
    """

    velocity: float
    acceleration: float
    jerk: float


@dataclasses.dataclass(frozen=True, eq=False)
class ArmLimits:
    """Bounds of an arm's joints: as published, and the part of them that is planned for.

    Less is planned for than is published: it is gentler, and rounding cannot carry the arm over.

    Attributes:
        velocity: Of each joint, rad/s.
        acceleration: Of each joint, rad/s^2.
        jerk: Of each joint, rad/s^3.
        velocity_share: The part of the velocity that is planned for.
        acceleration_share: The part of the acceleration that is planned for.
        planned_jerk: rad/s^3, of all joints.
    """

    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray
    velocity_share: float
    acceleration_share: float
    planned_jerk: float


@dataclasses.dataclass(frozen=True, eq=False)
class RobotLimits:
    """Bounds of all that a robot moves.

    Attributes:
        arm: Its joints.
        base: Planned for the base's path, metres.
        yaw: Planned for the base's turns, radians.
        yaw_gentle: The same while a candle that has slipped is in the hand. At every physics step of a turn a candle
            goes on along the tangent of the hand's arc, and friction knows no place to come back to.
        gripper: Planned for each finger, metres.
        base_speed: The highest speed of the base, m/s; what is planned leaves the feedback something to correct with.
        finger_speed: The highest speed of each finger, m/s.
    """

    arm: ArmLimits
    base: Limits
    yaw: Limits
    yaw_gentle: Limits
    gripper: Limits
    base_speed: float
    finger_speed: float
