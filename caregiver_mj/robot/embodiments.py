"""The robots by name: the package's own, and those of other packages.

The sources of their numbers are in `models/README.md`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.registry import Registry, check_call, errors_of
from caregiver_mj.robot.embodiment import (
    DEFAULT,
    Approach,
    Bends,
    Clearances,
    Embodiment,
    Grasp,
    Names,
    Postures,
    Servos,
)
from caregiver_mj.robot.limits import ArmLimits, Carrying, Limits, NearEnds, RobotLimits

# -- An arm on a round base ------------------------------------------------------------------------

_FR3_NAMES = Names(
    arm=tuple(f"joint{i}" for i in range(1, 8)),
    fingers=("finger_left", "finger_right"),
    chain=("link2", "link4", "link6", "link7"),
)

_FR3_SPEED = 5.0 / 3.6  # m/s; the caregiver's walking speed in the paper (section V.C)
_FR3_FINGERS = 0.125  # m/s, own design

_FR3_LIMITS = RobotLimits(
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
    base=Limits(velocity=0.97 * _FR3_SPEED, acceleration=3.0, jerk=26.0),
    yaw=Limits(velocity=2.8, acceleration=7.6, jerk=36.0),
    # In a half turn with the above a candle slips by 14 mm in the hand, with these by 7; at 30 mm it is lost.
    yaw_gentle=Limits(velocity=1.4, acceleration=7.6, jerk=36.0),
    gripper=Limits(velocity=0.82 * _FR3_FINGERS, acceleration=4.0, jerk=200.0),
    base_speed=_FR3_SPEED,
    base_acceleration=4.6,
    base_jerk=70.0,
    turn=Limits(velocity=3.0, acceleration=8.0, jerk=80.0),
    finger_speed=_FR3_FINGERS,
    # At 2 m/s^2 a drink rises 7 mm at the side of its mug; relocations were measured with these.
    carrying=Carrying(Limits(velocity=0.97 * _FR3_SPEED, acceleration=1.7, jerk=14.0), acceleration=2.0, jerk=35.0),
)


def mobile_fr3() -> Embodiment:
    """A base on steered wheels with an arm of the Franka Research 3's kinematics, of seven joints."""
    from caregiver_mj.robot.robot_model import RobotModel, own_model  # here, for it imports MuJoCo

    return RobotModel(own_model("mobile_fr3"), _FR3_NAMES).robot(
        limits=_FR3_LIMITS,
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


# -- An arm on a square base -----------------------------------------------------------------------

_UR5E_NAMES = Names(
    arm=("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
    fingers=("jaw_left", "jaw_right"),
    chain=("upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"),
)

_UR5E_SPEED = 1.0  # m/s, own design
_UR5E_FINGERS = 0.15  # m/s, own design

_UR5E_LIMITS = RobotLimits(
    # UR5e data sheet: 180 degrees a second. Acceleration and jerk are not published: own.
    arm=ArmLimits(
        velocity=np.full(6, math.pi),
        acceleration=np.full(6, 8.0),
        jerk=np.full(6, 4000.0),
        velocity_share=0.9,
        acceleration_share=0.9,
        planned_jerk=300.0,
    ),
    base=Limits(velocity=0.97 * _UR5E_SPEED, acceleration=2.8, jerk=24.0),
    yaw=Limits(velocity=2.0, acceleration=5.0, jerk=30.0),
    yaw_gentle=Limits(velocity=1.0, acceleration=4.0, jerk=30.0),
    gripper=Limits(velocity=0.82 * _UR5E_FINGERS, acceleration=4.0, jerk=200.0),
    base_speed=_UR5E_SPEED,
    base_acceleration=4.2,
    base_jerk=62.0,
    turn=Limits(velocity=2.4, acceleration=5.4, jerk=60.0),
    finger_speed=_UR5E_FINGERS,
    carrying=Carrying(Limits(velocity=0.97 * _UR5E_SPEED, acceleration=1.5, jerk=12.0), acceleration=1.8, jerk=30.0),
)


def mobile_ur5e() -> Embodiment:
    """A square base on omnidirectional wheels with an arm of the UR5e's kinematics, of six joints."""
    from caregiver_mj.robot.robot_model import RobotModel, own_model  # here, for it imports MuJoCo

    model = RobotModel(own_model("mobile_ur5e"), _UR5E_NAMES)
    bends = Bends(tucked=np.radians([0.0, -115.0, 99.5, 30.0, 90.0, 0.0]), bend=3, bends=(1.57, 1.0, 0.5, 0.0), turn=5)
    return model.robot(
        limits=_UR5E_LIMITS,
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


# -- By name ---------------------------------------------------------------------------------------


class _Makers(Registry[Callable[[], Embodiment]]):
    """Functions that make embodiments, and read their models when called."""

    def check(self, name: str, value: str, found: Any) -> None:
        if not callable(found):
            raise CaregiverError(
                f"{self.what} '{name}' ({value}) must be a function that makes an Embodiment, got {found!r}"
            )
        check_call(f"{self.what} '{name}'", found)


EMBODIMENTS = _Makers(
    "robot",
    "caregiver_mj.embodiments",
    "caregiver_mj.robot.embodiment.Embodiment",
    {"mobile_fr3": mobile_fr3, "mobile_ur5e": mobile_ur5e},
)


def find_embodiment(which: Embodiment | str | None = None) -> Embodiment:
    """Return a robot by name, cached; the default robot for None; an embodiment as it is.

    Raises:
        CaregiverError: There is no such robot, or it cannot be made.
    """
    if not isinstance(which, Embodiment | str | None):
        names = ", ".join(EMBODIMENTS)
        raise CaregiverError(f"robot must be a name ({names}) or an Embodiment, got {which!r}")
    return which if isinstance(which, Embodiment) else _made(DEFAULT if which is None else which)


@functools.cache
def _made(name: str) -> Embodiment:
    with errors_of(f"robot '{name}'", "as it was made"):
        made = EMBODIMENTS[name]()
    if not isinstance(made, Embodiment):
        raise CaregiverError(f"robot '{name}' must be an Embodiment, got {type(made).__name__}")
    return made
