"""A square base on steered wheels with an arm of the Universal Robots UR5e's kinematics.

The sources are in `models/README.md`.
"""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.robot.embodiment import Approach, Bends, Clearances, Embodiment, Grasp, Names, Postures, Servos
from caregiver_mj.robot.limits import ArmLimits, Carrying, Limits, RobotLimits
from caregiver_mj.robot.robot_model import RobotModel, own_model

NAMES = Names(
    arm=("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
    fingers=("jaw_left", "jaw_right"),
    chain=("upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"),
)

_BASE_SPEED = 1.0  # m/s, own design
_FINGER_SPEED = 0.15  # m/s, own design

LIMITS = RobotLimits(
    # UR5e data sheet: 180 degrees a second. Acceleration and jerk are not published: own.
    arm=ArmLimits(
        velocity=np.full(6, math.pi),
        acceleration=np.full(6, 8.0),
        jerk=np.full(6, 4000.0),
        velocity_share=0.9,
        acceleration_share=0.9,
        planned_jerk=300.0,
    ),
    base=Limits(velocity=0.97 * _BASE_SPEED, acceleration=2.8, jerk=24.0),
    yaw=Limits(velocity=2.0, acceleration=5.0, jerk=30.0),
    yaw_gentle=Limits(velocity=1.0, acceleration=4.0, jerk=30.0),
    gripper=Limits(velocity=0.82 * _FINGER_SPEED, acceleration=4.0, jerk=200.0),
    base_speed=_BASE_SPEED,
    base_acceleration=4.2,
    base_jerk=62.0,
    turn=Limits(velocity=2.4, acceleration=5.4, jerk=60.0),
    finger_speed=_FINGER_SPEED,
    carrying=Carrying(Limits(velocity=0.97 * _BASE_SPEED, acceleration=1.5, jerk=12.0), acceleration=1.8, jerk=30.0),
)


def mobile_ur5e() -> Embodiment:
    """Make the robot."""
    model = RobotModel(own_model("mobile_ur5e"), NAMES)
    bends = Bends(tucked=np.radians([0.0, -115.0, 99.5, 30.0, 90.0, 0.0]), bend=3, bends=(1.57, 1.0, 0.5, 0.0), turn=5)
    return model.robot(
        limits=LIMITS,
        # The model's lags of the servos with the arm tucked.
        servos=Servos(4.0, 6.0, *(model.lag(joint, bends.tucked) for joint in ("base_x", "base_yaw"))),
        bends=bends,
        postures=Postures(
            carry=(0.38, 1.04),
            reach=0.66,
            hand_pitch=math.radians(15.0),  # its wrist is slender, and above the hand
            lying_reaches=(0.40, 0.45, 0.50, 0.55, 0.60, 0.65, 0.70, 0.75),
            lying_pitches=(math.radians(90), math.radians(60)),
            floor_reach=0.45,
        ),
        approach=Approach(turn=0.24, above=0.69, hover=0.76, last_time=0.29),
        grasp=Grasp(open=0.046, closed=0.011, grip_time=0.25, widest=0.054),
        # A candle in the tucked hand is 0.41 m out.
        clearances=Clearances(turning=0.48, child_turning=0.56, hand=0.18, hand_width=0.15),
    )
