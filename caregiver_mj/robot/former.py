# ruff: noqa: D103
"""Former names of the default robot's numbers, until every caller says which robot it means."""

from caregiver_mj.robot import grips, kinematics, reach
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.grips import UPRIGHT, hand_rotation  # noqa: F401
from caregiver_mj.robot.reach import ReachPath  # noqa: F401

_ROBOT = find_embodiment()

ARM_JOINTS = _ROBOT.names.arm
HAND_PITCH, CARRY, REACH = _ROBOT.postures.hand_pitch, _ROBOT.postures.carry, _ROBOT.postures.reach
OPEN, CLOSED = _ROBOT.grasp.open, _ROBOT.grasp.closed
BASE, YAW, YAW_GENTLE, GRIPPER = _ROBOT.limits.base, _ROBOT.limits.yaw, _ROBOT.limits.yaw_gentle, _ROBOT.limits.gripper
MAX_BASE_SPEED, GRIPPER_VELOCITY = _ROBOT.limits.base_speed, _ROBOT.limits.finger_speed
ARM_VELOCITY = _ROBOT.limits.arm.velocity
ARM_ACCELERATION = _ROBOT.limits.arm.acceleration
ARM_JERK = _ROBOT.limits.arm.jerk


def shared_arm():
    return kinematics.arm_of(_ROBOT)


def tucked_joints():
    return shared_arm().tucked


def reach_path(height_in_tenths_of_mm):
    return reach.reach_path(shared_arm(), height_in_tenths_of_mm)


def retrieval_path(point, rotation, lift=0.0):
    return reach.retrieval_path(shared_arm(), point, rotation, lift)


def upright_grip(axis):
    return grips.upright_grip(axis, HAND_PITCH)
