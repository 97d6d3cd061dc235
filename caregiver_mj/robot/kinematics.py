"""The arm: forward and inverse kinematics on a model of the robot alone, and the path on which the hand reaches out.

All poses are in the frame of the base (x to the front, z up, origin on the floor). The hand always keeps one
orientation, pitched down so that the wrist clears a table's top; an upright candle stays upright in it.
"""

from __future__ import annotations

import functools
import importlib.resources
import itertools
import math
from collections.abc import Sequence

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
UPRIGHT = math.cos(math.radians(20.0))  # of a candle's tilt up to which it is gripped as one that stands

_HOVER = 0.10  # metres over a candle that lies, at which the hand stops
# Bounds of what can be reached at all, from the arm's dimensions: shoulder (in the base's frame) to wrist, both elbow
# offsets included, and 0.088 m by which the last axis may be off.
_SHOULDER, _WRIST_TO_PINCH = np.array([-0.06, 0.0, 0.603]), 0.2204
_LONGEST = math.hypot(0.316, 0.0825) + math.hypot(0.384, 0.0825) + 0.088
_WRIST_BENDS = (1.57, 0.8, 0.0)  # radians, of joint 6 from the tucked arm's: guesses for the inverse kinematics

_IK_TOLERANCE = 1e-5  # metres and radians
_IK_ITERATIONS = 40
_IK_STEP = 0.5  # radians, the most that a joint goes in an iteration
_SEED = np.array([0.0, -0.66, 0.0, -2.25, 0.0, 2.55, np.pi / 4])  # radians, near the tucked arm


class Arm:
    """Kinematics of the arm, on a model of its own: it knows nothing of the simulation's state.

    Attributes:
        ranges: Lowest and highest joint positions, (7,) each, in radians.
    """

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
        self.ranges = tuple(np.array([self._model.joint(name).range for name in ARM_JOINTS]).T)

    def solve(self, x: float, z: float, guess: np.ndarray = _SEED) -> np.ndarray:
        """Inverse kinematics of the hand in the arm's vertical plane, as for a candle that stands.

        Args:
            x: Distance of the pinch point before the base's centre in metres.
            z: Its height above the floor in metres.
            guess: Joint positions (7,) to start from, in radians.

        Returns:
            Joint positions (7,) in radians.

        Raises:
            CaregiverError: The arm cannot reach that point.
        """
        return self.solve_pose(np.array([x, 0.0, z]), hand_rotation(0.0, HAND_PITCH), guess)

    def solve_pose(self, position: np.ndarray, rotation: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Inverse kinematics of any pose of the hand.

        Args:
            position: Of the pinch point, (3,), metres.
            rotation: Of the hand, (3, 3), see `hand_rotation`.
            guess: Joint positions (7,) to start from, in radians.

        Returns:
            Joint positions (7,) in radians.

        Raises:
            CaregiverError: The arm cannot reach that pose, or not from that guess.
        """
        q = np.zeros(self._model.nq)
        q[self._arm] = guess
        self._configuration.update(q)
        self._posture.set_target(q)
        self._task.set_target(mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(rotation), position))
        for _ in range(_IK_ITERATIONS):
            if np.abs(self._task.compute_error(self._configuration)).max() < _IK_TOLERANCE:
                return self._configuration.q[self._arm].copy()
            try:
                velocity = mink.solve_ik(
                    self._configuration, [self._task, self._posture, self._damping], 1.0, "daqp", limits=self._limits
                )
            except mink.MinkError:
                break
            step = min(1.0, _IK_STEP / np.abs(velocity).max())
            self._configuration.integrate_inplace(velocity, step)
        raise CaregiverError(f"the arm cannot reach {position[0]:.3f} m ahead at a height of {position[2]:.3f} m")

    def pinch(self, q: np.ndarray) -> np.ndarray:
        """Forward kinematics: the pinch point (3,) in metres for joint positions (7,) in radians."""
        full = np.zeros(self._model.nq)
        full[self._arm] = q
        self._configuration.update(full)
        return self._configuration.get_transform_frame_to_world("pinch", "site").translation()


class ReachPath:
    """The hand's way from the tucked arm (s = 0) through poses (s = 1, 2, ...): lines in joint space.

    In the arm's vertical plane the hand's pitch is a signed sum of joint positions, so that a line between two poses
    of equal pitch keeps it all the way: a candle stays upright. A line has no curvature either, which makes the
    joints' limits simple bounds of s and its derivatives; they hold as long as the hand stops at every pose.

    Attributes:
        goal: s at the last of them.
        limits: Bounds of s (per second, ...) under which every joint keeps its limits.
    """

    def __init__(self, poses: Sequence[np.ndarray]):
        """Plans the way.

        Args:
            poses: Joint positions (7,) in radians, two or more of them, the tucked arm first.
        """
        self._poses = np.array(poses)
        self._ways = np.diff(self._poses, axis=0)
        self.goal = len(self._ways)
        way = np.abs(self._ways).max(axis=0) + 1e-12
        self.limits = limits.Limits(
            velocity=float((limits.ARM_VELOCITY * limits.ARM_VELOCITY_SHARE / way).min()),
            acceleration=float((limits.ARM_ACCELERATION * limits.ARM_ACCELERATION_SHARE / way).min()),
            jerk=float(limits.ARM_PLANNED_JERK / way.max()),
        )

    def joints(self, s: float) -> np.ndarray:
        """Joint positions (7,) in radians at s."""
        i = min(int(s), self.goal - 1)
        return self._poses[i] + (s - i) * self._ways[i]


@functools.cache
def shared_arm() -> Arm:
    """One arm for everyone: it is costly to make and remembers nothing between calls."""
    return Arm()


@functools.cache
def reach_path(height_in_tenths_of_mm: int) -> ReachPath:
    """The way to a point `REACH` ahead, at a height in units of 0.1 mm (so that paths can be shared).

    Raises:
        CaregiverError: The arm cannot reach there.
    """
    arm, tucked = shared_arm(), tucked_joints()
    return ReachPath([tucked, arm.solve(REACH, height_in_tenths_of_mm * 1e-4, guess=tucked)])


def retrieval_path(point: np.ndarray, rotation: np.ndarray, lift: float = 0.0) -> ReachPath:
    """The way to something that lies about: to a pose over it, then straight down to it.

    Args:
        point: Where to grip it, in the base's frame, (3,), metres.
        rotation: Of the hand there, (3, 3), see `hand_rotation`.
        lift: Metres above the first pose of one more, by way of which the hand comes and goes; 0 for none.

    Raises:
        CaregiverError: The arm cannot reach there.
    """
    arm, tucked = shared_arm(), tucked_joints()
    above = np.array([*point[:2], point[2] + _HOVER])
    wrist = point - _WRIST_TO_PINCH * rotation[:, 2]
    heading = math.atan2(rotation[0, 1], -rotation[1, 1])
    # The nearer of the two ways to turn the hand, and bends of the wrist from the usual one on.
    guesses = itertools.product(_WRIST_BENDS, (heading, -heading, 0.0))
    for bend, turn in guesses if math.dist(wrist, _SHOULDER) < _LONGEST else ():
        guess = tucked + np.array([0.0, 0.0, 0.0, 0.0, 0.0, bend, turn])
        try:
            down = arm.solve_pose(point, rotation, guess.clip(*arm.ranges))
            over = [arm.solve_pose(above, rotation, down)]
            if lift:
                over.insert(0, arm.solve_pose(above + np.array([0.0, 0.0, lift]), rotation, over[0]))
        except CaregiverError:
            continue
        return ReachPath([tucked, *over, down])
    x, y, z = point
    raise CaregiverError(f"the arm cannot grip what lies {x:.2f} m ahead and {y:.2f} m aside, {z:.2f} m high")


def hand_rotation(heading: float, pitch: float) -> np.ndarray:
    """Rotation (3, 3) of the hand that points along a heading, and below the horizontal by a pitch, in radians.

    The hand's axes are: z its approach, y the one along which the fingers open, level, and x their normal.
    """
    ahead, up = np.array([math.cos(heading), math.sin(heading), 0.0]), np.array([0.0, 0.0, 1.0])
    approach = math.cos(pitch) * ahead - math.sin(pitch) * up
    sideways = np.array([math.sin(heading), -math.cos(heading), 0.0])
    return np.stack([np.cross(sideways, approach), sideways, approach], axis=1)


def upright_grip(axis: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of the hand for a grip in which a candle stands upright once the arm is tucked.

    Where the candle is tilted from upright, the hand is tilted alike from its usual pitch; it comes from above one
    that lies.

    Args:
        axis: Unit vector from the candle's foot to its top in the base's frame, (3,).
    """
    if axis[2] > UPRIGHT:
        return hand_rotation(0.0, HAND_PITCH)
    return hand_rotation(math.atan2(axis[1], axis[0]), HAND_PITCH + math.acos(axis[2]))


@functools.cache
def tucked_joints() -> np.ndarray:
    """Joint positions (7,) of the tucked arm, in radians."""
    joints = shared_arm().solve(*CARRY)
    joints.flags.writeable = False
    return joints
