"""A round base on steered wheels with an arm of the Franka Research 3's kinematics.

The sources are in `models/README.md`.
"""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.robot.embodiment import Approach, Bends, Clearances, Embodiment, Grasp, Names, Postures, Servos
from caregiver_mj.robot.limits import ArmLimits, Carrying, Limits, NearEnds, RobotLimits
from caregiver_mj.robot.robot_model import RobotModel, own_model

NAMES = Names(
    arm=tuple(f"joint{i}" for i in range(1, 8)),
    fingers=("finger_left", "finger_right"),
    chain=("link2", "link4", "link6", "link7"),
)

_BASE_SPEED = 5.0 / 3.6  # m/s; the caregiver's walking speed in the paper (section V.C)
_FINGER_SPEED = 0.125  # m/s, own design

LIMITS = RobotLimits(
    # Franka Research 3 data sheet ("Robot and interface specifications"). 400 rad/s^3 are 25 ms to full acceleration.
    arm=ArmLimits(
        velocity=np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26]),
        acceleration=np.full(7, 10.0),
        jerk=np.full(7, 5000.0),
        velocity_share=0.9,
        acceleration_share=0.7,  # the rest is for ramps between timesteps, and for a candle that meets its table
        planned_jerk=400.0,
        near_ends=NearEnds(
            low=np.array([-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196]),
            high=np.array([2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196]),
            slope=np.array([12.0, 5.17, 7.0, 8.0, 34.0, 11.0, 34.0]),
            offset=np.array([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35]),
        ),
        # At 2.66 rad/s the simulated servos of joints 5 to 7 are at their 12 N m: see the model. Joint 6, which the
        # other joints' accelerations swing, then has nothing left to accelerate with.
        servo_velocity=np.array([2.62, 2.62, 2.62, 2.62, 2.4, 2.1, 2.4]),
    ),
    # By `models/README.md` a rigid robot would tip over at 6.2 m/s^2, and its wheels would slip at 4.9; but the arm
    # swings, too.
    base=Limits(velocity=0.97 * _BASE_SPEED, acceleration=3.0, jerk=26.0),
    yaw=Limits(velocity=2.8, acceleration=7.6, jerk=36.0),
    # In a half turn with the above a candle slips by 14 mm in the hand, with these by 7; at 30 mm it is lost.
    yaw_gentle=Limits(velocity=1.4, acceleration=7.6, jerk=36.0),
    gripper=Limits(velocity=0.82 * _FINGER_SPEED, acceleration=4.0, jerk=200.0),
    base_speed=_BASE_SPEED,
    base_acceleration=4.6,
    base_jerk=70.0,
    turn=Limits(velocity=3.0, acceleration=8.0, jerk=80.0),
    finger_speed=_FINGER_SPEED,
    # At 2 m/s^2 a drink rises 7 mm at the side of its mug; relocations were measured with these.
    carrying=Carrying(Limits(velocity=0.97 * _BASE_SPEED, acceleration=1.7, jerk=14.0), acceleration=2.0, jerk=35.0),
)


def mobile_fr3() -> Embodiment:
    """Make the robot."""
    return RobotModel(own_model("mobile_fr3"), NAMES).robot(
        limits=LIMITS,
        # Lags by trial; the model's mass and inertia over gain, with the arm tucked, are 20.7 and 5.9 ms.
        servos=Servos(position_gain=5.0, yaw_gain=8.0, base_lag=0.0205, yaw_lag=0.008),
        # Joints 1 and 3 are nearly collinear in these poses; holding joint 3 keeps them from chattering.
        bends=Bends(
            tucked=np.array([0.0, -0.66, 0.0, -2.25, 0.0, 2.55, np.pi / 4]),
            bend=5,
            bends=(1.57, 0.8, 0.0),
            turn=6,
            held=2,
        ),
        postures=Postures(
            carry=(0.42, 1.04),
            reach=0.70,
            hand_pitch=math.radians(35.0),  # a level hand hits the table with the wrist
            lying_reaches=(0.50, 0.55, 0.60, 0.65, 0.70, 0.75),
            lying_pitches=(math.radians(90), math.radians(50)),
            floor_reach=0.50,
        ),
        approach=Approach(turn=0.25, above=0.70, hover=0.77, last_time=0.225),
        # A candle is held with 12 mm more than the depth, and may be lost on the way with 12 mm less: errors of
        # perception may be as large either way.
        grasp=Grasp(open=0.036, closed=0.012, grip_time=0.12, widest=0.0395),
        # A candle in the tucked hand is 0.45 m out.
        clearances=Clearances(turning=0.52, child_turning=0.60, hand=0.16, hand_width=0.13),
    )
