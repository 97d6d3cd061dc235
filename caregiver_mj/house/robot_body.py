"""The robot in the simulation of the house: where its joints are, and what its actuators are told."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_env import specs

from caregiver_mj.robot import kinematics
from caregiver_mj.robot.motion import OPEN

BASE_JOINTS = ("robot/base_x", "robot/base_y", "robot/base_yaw")
ARM_JOINTS = tuple(f"robot/{name}" for name in kinematics.ARM_JOINTS)
FINGER_JOINTS = ("robot/finger_left", "robot/finger_right")
WHEELS = tuple(f"robot/wheel_{where}" for where in ("front_left", "front_right", "rear_left", "rear_right"))
_WHEEL_RADIUS, _WHEEL_TRACK = 0.075, 0.33  # metres: radius; half length plus half width between the wheels
ACTION_SIZE = 11  # base velocities, arm joints, and one value for both fingers

_LOOSE = 0.024  # metres of each finger off the middle above which it does not touch a candle


class RobotBody:
    """The robot's joints and actuators, as views of the simulation's state.

    Attributes:
        base: Positions x, y (m) and yaw (rad) of the base, and their rates, (3,) each.
        arm: Positions and velocities of the arm's joints, (7,) each, rad.
        fingers: How far each finger stands off the middle, and how fast that changes, (2,) each, m.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        self.base = joint_views(model, data, BASE_JOINTS)
        self.arm = joint_views(model, data, ARM_JOINTS)
        self.fingers = joint_views(model, data, FINGER_JOINTS)
        self._wheels = joint_views(model, data, WHEELS)
        self._ctrl = data.ctrl

    @staticmethod
    def is_in(model: mujoco.MjModel) -> bool:
        """Whether there is a robot in a house."""
        return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, BASE_JOINTS[0]) >= 0

    @staticmethod
    def action_spec(model: mujoco.MjModel) -> specs.BoundedArray:
        """Base velocities (m/s, rad/s), arm joint targets (rad), gripper target (m): 11 values, 0 without a robot."""
        low, high = model.actuator_ctrlrange.T
        count = max(model.nu - 1, 0)  # the two fingers share one action
        names = [model.actuator(i).name.removeprefix("robot/") for i in range(model.nu)]
        names[-2:] = ["gripper"] if count else []
        return specs.BoundedArray((count,), float, low[:count], high[:count], name="\t".join(names))

    def is_gripping(self) -> bool:
        """Whether the fingers are as close together as round a candle, or closer."""
        return bool(self.fingers[0].sum() < 2 * _LOOSE)

    def set_action(self, action: np.ndarray) -> None:
        """Sets what the actuators shall do, (11,); both fingers get the last value."""
        self._ctrl[:ACTION_SIZE], self._ctrl[ACTION_SIZE] = action, action[-1]

    def place(self, base: np.ndarray, arm: np.ndarray | None = None) -> None:
        """Puts the robot somewhere, its hand open: base pose (3,) and arm joints (7,), tucked if not given."""
        self.base[0][:], self.fingers[0][:] = base, OPEN
        self.arm[0][:] = kinematics.tucked_joints() if arm is None else arm

    def roll_wheels(self) -> None:
        """Turns the wheels as the base moves: mecanum kinematics. They bear no load."""
        x, y, turn = self.base[1].tolist()
        yaw = float(self.base[0][2])
        c, s = math.cos(yaw), math.sin(yaw)
        ahead, aside, turn = (c * x + s * y) / _WHEEL_RADIUS, (c * y - s * x) / _WHEEL_RADIUS, turn * _WHEEL_TRACK
        turn /= _WHEEL_RADIUS
        left, right = ahead - turn, ahead + turn
        self._wheels[1][:] = left - aside, right + aside, left + aside, right - aside


def joint_views(model: mujoco.MjModel, data: mujoco.MjData, joints: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of scalar joints that follow one another, as views of the simulation's state."""
    first = model.joint(joints[0])
    q, v = int(first.qposadr[0]), int(first.dofadr[0])
    return data.qpos[q : q + len(joints)], data.qvel[v : v + len(joints)]
