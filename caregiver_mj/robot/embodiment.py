"""What a robot is made of and how it is used: everything that differs from one robot to another.

A robot is a model file and the numbers that the model does not have. What the model has (joint ranges, the order of its
actuators, its footprint, its wheels) is read from it, see `robot_model`. Robots by name: `embodiments`.

A model file holds the robot alone. It faces +x with its origin on the floor, and has

- a body `base` with a collision geom `base_hull`, which moves in three joints: along x, along y, about z;
- a body `hand` with a site `pinch` between the fingertips, whose axes are z ahead, y along which the fingers open;
- two fingers whose joints open at positive positions, with collision geoms `finger_left_pad` and `finger_right_pad`;
- velocity servos of the base, position servos of arm and fingers, in this order.
"""

from __future__ import annotations

import dataclasses
import math
from importlib.resources.abc import Traversable

import numpy as np

from caregiver_mj.robot.handling import Approach, Bends, Clearances, Grasp, Postures
from caregiver_mj.robot.limits import RobotLimits

DEFAULT = "mobile_fr3"  # the robot where no other is named


@dataclasses.dataclass(frozen=True)
class Names:
    """What the parts of a model are called.

    Attributes:
        base: Joints along x, along y and about z.
        arm: Joints from the shoulder on.
        fingers: Joints of the left and of the right finger.
        wheels: Joints at the front left and right, then at the rear left and right.
        chain: Bodies of the arm between which it bends, from the shoulder to the wrist.
    """

    base: tuple[str, str, str]
    arm: tuple[str, ...]
    fingers: tuple[str, str]
    wheels: tuple[str, str, str, str]
    chain: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Layout:
    """Where what is in an array of commands.

    Attributes:
        base: Velocities along x, along y and about z.
        arm: Joint targets.
        gripper: How far the fingers stand off the middle: one number in an action, one a finger in the actuators.
        size: Length of the array.
    """

    base: slice
    arm: slice
    gripper: slice
    size: int


@dataclasses.dataclass(frozen=True)
class Wheels:
    """Four wheels that go any way: mecanum wheels in parallel, or omnidirectional ones across the corners.

    Attributes:
        radius: Of the wheels; times the square root of 2 for those across the corners, whose ways are diagonal.
        lever: Half the wheelbase and half the track together.
        places: Where each is, x ahead of the base's middle and y to its left.
    """

    radius: float
    lever: float
    places: tuple[tuple[float, float], ...]

    def rates(self, ahead: float, aside: float, turn: float) -> tuple[float, float, float, float]:
        """Rates of turning, in the order of `Names.wheels`, from the base's velocity in its own axes."""
        ahead, aside, turn = ahead / self.radius, aside / self.radius, turn * self.lever / self.radius
        left, right = ahead - turn, ahead + turn
        return left - aside, right + aside, left + aside, right - aside


@dataclasses.dataclass(frozen=True)
class Servos:
    """How the base follows its reference.

    Attributes:
        position_gain: From error of position to velocity, 1/s.
        yaw_gain: From error of heading to rate of turning, 1/s.
        base_lag: Seconds by which the base follows a velocity later, which is fed forward.
        yaw_lag: The same of its rate of turning.
    """

    position_gain: float
    yaw_gain: float
    base_lag: float
    yaw_lag: float


@dataclasses.dataclass(frozen=True, eq=False)
class Embodiment:
    """A robot.

    Attributes:
        name: Its name.
        model: The model file.
        names: What is what in it.
        layout: Of an action.
        actuators: Of the model's actuators, in which the gripper has two fingers.
        footprint: Radius of the circle about the base's middle in which all of the base is.
        wheels: How the wheels turn as the base moves.
        torque: What the arm's motors can do, of each joint, N m, (joints,).
        limits: Bounds of its motion.
        servos: How the base follows its reference.
        bends: Where to look for the arm's joint positions.
        postures: Where the hand is.
        approach: How far out it is while the base drives.
        grasp: How it takes a candle.
        clearances: Room that it needs.
        sides: Half the length and half the width of a box-shaped base, about its middle, metres; (0, 0) of a round one.
    """

    name: str
    model: Traversable
    names: Names
    layout: Layout
    actuators: Layout
    footprint: float
    wheels: Wheels
    torque: np.ndarray
    limits: RobotLimits
    servos: Servos
    bends: Bends
    postures: Postures
    approach: Approach
    grasp: Grasp
    clearances: Clearances
    sides: tuple[float, float] = (0.0, 0.0)

    @property
    def rounding(self) -> float:
        """Metres by which the base goes beyond its `sides` all round."""
        return self.footprint - math.hypot(*self.sides)
