"""The arm: forward and inverse kinematics on a model of the robot alone, and the path on which the hand reaches out.

All poses are in the frame of the base (x to the front, z up, origin on the floor). The hand always keeps one
orientation, pitched down so that the wrist clears a table's top; an upright candle stays upright in it.
"""

from __future__ import annotations

import functools
import importlib.resources

import mink
import mujoco
import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot import limits

ARM_JOINTS = tuple(f"joint{i}" for i in range(1, 8))
HAND_PITCH = np.deg2rad(35.0)  # below the horizontal; a level hand hits the table with the wrist

# The pinch point when the arm is tucked, (x, z) in metres. A candle held here passes over a child's head (0.80 m).
CARRY = (0.42, 0.93)
REACH = 0.70  # metres from the base's centre to a candle on a table

_IK_TOLERANCE = 1e-5  # metres and radians
_IK_ITERATIONS = 100
_SEED = np.array([0.0, -0.66, 0.0, -2.25, 0.0, 2.55, np.pi / 4])  # radians, near the tucked arm


class Arm:
    """Kinematics of the arm, on a model of its own: it knows nothing of the simulation's state."""

    def __init__(self):
        path = importlib.resources.files("caregiver_mj.models") / "robot.xml"
        self._model = mujoco.MjSpec.from_string(path.read_text(encoding="utf-8")).compile()
        self._configuration = mink.Configuration(self._model)
        self._arm = np.array([self._model.joint(name).qposadr[0] for name in ARM_JOINTS])
        self._task = mink.FrameTask("pinch", "site", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
        # Joints 1 and 3 are nearly collinear in these poses; holding joint 3 keeps them from chattering.
        cost = np.zeros(self._model.nv)
        cost[self._arm[2]] = 0.5
        self._posture = mink.PostureTask(self._model, cost=cost)
        still = np.full(self._model.nv, 1e4)
        still[self._arm] = 1e-3
        self._damping = mink.DampingTask(self._model, cost=still)  # base, wheels and fingers stand still
        self._limits = [mink.ConfigurationLimit(self._model)]
        self._rotation = mink.SO3.from_matrix(_hand_rotation())

    def solve(self, x: float, z: float, guess: np.ndarray = _SEED) -> np.ndarray:
        """Inverse kinematics of the hand in the arm's vertical plane.

        Args:
            x: Distance of the pinch point before the base's centre in metres.
            z: Its height above the floor in metres.
            guess: Joint positions (7,) to start from, in radians.

        Returns:
            Joint positions (7,) in radians.

        Raises:
            CaregiverError: The arm cannot reach that point.
        """
        q = np.zeros(self._model.nq)
        q[self._arm] = guess
        self._configuration.update(q)
        self._posture.set_target(q)
        self._task.set_target(mink.SE3.from_rotation_and_translation(self._rotation, np.array([x, 0.0, z])))
        for _ in range(_IK_ITERATIONS):
            if np.abs(self._task.compute_error(self._configuration)).max() < _IK_TOLERANCE:
                return self._configuration.q[self._arm].copy()
            try:
                velocity = mink.solve_ik(
                    self._configuration, [self._task, self._posture, self._damping], 1.0, "daqp", limits=self._limits
                )
            except mink.MinkError:
                break
            self._configuration.integrate_inplace(velocity, 1.0)
        raise CaregiverError(f"the arm cannot reach {x:.3f} m ahead at a height of {z:.3f} m")

    def pinch(self, q: np.ndarray) -> np.ndarray:
        """Forward kinematics: the pinch point (3,) in metres for joint positions (7,) in radians."""
        full = np.zeros(self._model.nq)
        full[self._arm] = q
        self._configuration.update(full)
        return self._configuration.get_transform_frame_to_world("pinch", "site").translation()


class ReachPath:
    """The hand's way from the tucked arm (s = 0) to a point over or on a table (s = 1): a line in joint space.

    In the arm's vertical plane the hand's pitch is a signed sum of joint positions, so that a line between two poses
    of equal pitch keeps it all the way: a candle stays upright. The line has no curvature either, which makes the
    joints' limits simple bounds of s and its derivatives.

    Attributes:
        limits: Bounds of s (per second, ...) under which every joint keeps its limits.
    """

    def __init__(self, arm: Arm, x: float, z: float):
        """Plans the way.

        Args:
            arm: The arm.
            x: Distance of the goal before the base's centre, metres.
            z: Height of the goal above the floor, metres.

        Raises:
            CaregiverError: The arm cannot reach there.
        """
        self._start = arm.solve(*CARRY)
        self._way = arm.solve(x, z, guess=self._start) - self._start
        way = np.abs(self._way) + 1e-12
        self.limits = limits.Limits(
            velocity=float((limits.ARM_VELOCITY * limits.ARM_VELOCITY_SHARE / way).min()),
            acceleration=float((limits.ARM_ACCELERATION * limits.ARM_ACCELERATION_SHARE / way).min()),
            jerk=float(limits.ARM_PLANNED_JERK / way.max()),
        )

    def joints(self, s: float) -> np.ndarray:
        """Joint positions (7,) in radians at s."""
        return self._start + s * self._way


@functools.cache
def shared_arm() -> Arm:
    """One arm for everyone: it is costly to make and remembers nothing between calls."""
    return Arm()


@functools.cache
def reach_path(height_in_tenths_of_mm: int) -> ReachPath:
    """The way to a point `REACH` ahead, at a height in units of 0.1 mm (so that paths can be shared)."""
    return ReachPath(shared_arm(), REACH, height_in_tenths_of_mm * 1e-4)


def _hand_rotation() -> np.ndarray:
    """Rotation (3, 3) of the hand: approach axis z forwards and down, fingers opening along y, sideways."""
    approach = np.array([np.cos(HAND_PITCH), 0.0, -np.sin(HAND_PITCH)])
    sideways = np.array([0.0, -1.0, 0.0])
    return np.stack([np.cross(sideways, approach), sideways, approach], axis=1)


def tucked_joints() -> np.ndarray:
    """Joint positions (7,) of the tucked arm, in radians."""
    return shared_arm().solve(*CARRY)
