"""Limits of the robot, with their sources. Commands stay within them at all times."""

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


# Franka Research 3 data sheet ("Robot and interface specifications"): joint velocity in rad/s, acceleration in
# rad/s^2, jerk in rad/s^3.
ARM_VELOCITY = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
ARM_ACCELERATION = np.full(7, 10.0)
ARM_JERK = np.full(7, 5000.0)
# The arm is planned for less than is published: gentler, and rounding cannot carry it over.
ARM_VELOCITY_SHARE = 0.9
ARM_ACCELERATION_SHARE = 0.97
ARM_PLANNED_JERK = 400.0  # rad/s^3, 25 ms to full acceleration

MAX_BASE_SPEED = 5.0 / 3.6  # m/s: the walking speed that the paper gives the caregiver (section V.C)
# References keep 3 % below that, which leaves the feedback something to correct with. At 3.5 m/s^2 the base is well
# within what its servos can do (400 N for 83 kg) and from tipping over (5.2 m/s^2, see models/README.md).
BASE = Limits(velocity=0.97 * MAX_BASE_SPEED, acceleration=3.5, jerk=35.0)  # m
YAW = Limits(velocity=2.8, acceleration=8.0, jerk=80.0)  # rad
# A candle in the hand slides outwards as the base turns: at every physics step it goes on along the tangent of the
# hand's arc, and friction knows no place to come back to. A half turn with the above costs 14 mm, one with this 7, and
# at 30 mm the candle is lost. One that has slipped is turned no faster.
YAW_GENTLE = Limits(velocity=1.4, acceleration=8.0, jerk=80.0)  # rad
GRIPPER_VELOCITY = 0.125  # m/s, each finger: own design, see models/README.md
GRIPPER = Limits(velocity=0.97 * GRIPPER_VELOCITY, acceleration=4.0, jerk=200.0)  # m
