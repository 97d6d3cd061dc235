"""What a robot is made of and how it is used: everything that differs from one robot to another.

A robot is a model file and the numbers that the model does not have. What the model has (joint ranges, the order of its
actuators, its footprint, its wheels) is read from it, see `robot_model`. Robots by name: `embodiments`.

A model file holds the robot alone. It faces +x with its origin on the floor, and has

- a body `base` with a collision geom `base_hull`, which moves in three joints: along x, along y, about z; a cylinder
  does not meet the corners of boxes as it should, and leaves these to a sphere beside it, see `mobile_fr3`;
- a body `hand` with a site `pinch` between the fingertips, whose axes are z ahead, y along which the fingers open;
- two fingers whose joints open at positive positions, with collision geoms `finger_left_pad` and `finger_right_pad`;
- velocity servos of the base, position servos of arm and fingers, in this order;
- a site `tray` on the base, where the tray for small things is put, unless it shall not pick such up.

How a robot handles candles: where its hand is, how far out while the base drives, and how it grips. Its attributes are
in metres, radians and seconds unless they say otherwise.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from importlib.resources.abc import Traversable
from typing import NamedTuple

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.robot.limits import RobotLimits

DEFAULT = "mobile_fr3"  # the robot where no other is named
_ROLLS, _STEERS = 0.01, 20.0  # m/s from which on a wheel is steered, and 1/s: from its error to the rate of its turn


@dataclasses.dataclass(frozen=True)
class Names:
    """What the parts of a model are called."""

    arm: tuple[str, ...]  #: joints from the shoulder on
    fingers: tuple[str, str]  #: joints of the left and of the right finger
    chain: tuple[str, ...]  #: bodies of the arm between which it bends, from the shoulder to the wrist
    base: tuple[str, str, str] = ("base_x", "base_y", "base_yaw")  #: joints along x, along y and about z
    #: joints that steer those at the front left and right, then at the rear left and right
    wheels: tuple[str, str, str, str] = ("wheel_front_left", "wheel_front_right", "wheel_rear_left", "wheel_rear_right")


@dataclasses.dataclass(frozen=True)
class CommandLayout:
    """Where what is in an array of commands."""

    base: slice  #: velocities along x, along y and about z
    arm: slice  #: joint targets
    gripper: slice  #: how far the fingers stand off the middle: one number in an action, one a finger in the actuators
    size: int  #: length of the array


@dataclasses.dataclass(frozen=True)
class Wheels:
    """Four driven wheels, each of which is steered about its middle."""

    places: tuple[tuple[float, float], ...]  #: where each is, x ahead of the base's middle and y to its left

    def steer(self, headings: Sequence[float], ahead: float, aside: float, turn: float) -> list[float]:
        """Return the rates at which wheels turn to where they go, rad/s, in the order of `Names.wheels`.

        A wheel rolls either way, so it turns by a quarter at most; one that stands keeps its heading.

        Args:
            headings: Of each wheel in the base, rad.
            ahead: Velocity of the base along its x axis, m/s.
            aside: The same along its y axis.
            turn: Rate of its turn, rad/s.
        """
        rates = []
        for heading, (x, y) in zip(headings, self.places, strict=True):
            along, across = ahead - turn * y, aside + turn * x
            moves = math.hypot(along, across) > _ROLLS
            off = math.remainder(math.atan2(across, along) - heading, math.pi) if moves else 0.0
            rates.append(_STEERS * off)
        return rates


@dataclasses.dataclass(frozen=True)
class Servos:
    """How the base follows its reference."""

    position_gain: float  #: from error of position to velocity, 1/s
    yaw_gain: float  #: from error of heading to rate of turning, 1/s
    base_lag: float  #: seconds by which the base follows a velocity later, which is fed forward
    yaw_lag: float  #: the same of its rate of turning


class Tray(NamedTuple):
    """Where the tray for small things is on a base: its inside, in the base's frame."""

    middle: tuple[float, float, float]  #: of the box in which what lies in it has its foot, metres
    half: tuple[float, float, float]  #: half that box's sides

    def along(self, spot: float) -> np.ndarray:
        """Return a place in it, (3,), by how far along its longer side that is from the middle, -1 to 1."""
        way = np.where(np.arange(3) == np.argmax(self.half), self.half, 0.0)
        return np.array(self.middle) + spot * way

    def holds(self, point: Sequence[float], unsure: float = 0.0) -> bool:
        """Return whether a foot (3,), in the base's frame, is in it, or may be by some metres more."""
        return all(abs(p - m) < h + unsure for p, m, h in zip(point, self.middle, self.half, strict=True))


@dataclasses.dataclass(frozen=True, eq=False)
class Embodiment:
    """A robot."""

    name: str  #: its name
    model: Traversable  #: the model file
    names: Names  #: what is what in it
    layout: CommandLayout  #: of an action
    actuators: CommandLayout  #: of the model's actuators, in which the gripper has two fingers
    footprint: float  #: radius of the circle about the base's middle in which all of the base is
    wheels: Wheels  #: where the wheels are, which turn to where the base moves
    torque: np.ndarray  #: what the arm's motors can do, of each joint, N m, (joints,)
    limits: RobotLimits  #: bounds of its motion
    servos: Servos  #: how the base follows its reference
    bends: Bends  #: where to look for the arm's joint positions
    postures: Postures  #: where the hand is
    approach: Approach  #: how far out it is while the base drives
    grasp: Grasp  #: how it takes a candle
    clearances: Clearances  #: room that it needs
    #: half the length and half the width of a box-shaped base, about its middle, metres; (0, 0) of a round one
    sides: tuple[float, float] = (0.0, 0.0)
    fingertip: float = 0.0  #: how far the fingers' pads go beyond the pinch point
    tray: Tray | None = None  #: the tray for small things; None if it has none, and does not pick such up

    @property
    def rounding(self) -> float:
        """Metres by which the base goes beyond its `sides` all round."""
        return self.footprint - math.hypot(*self.sides)


@dataclasses.dataclass(frozen=True, eq=False)
class Bends:
    """Where to look for the arm's joint positions, as inverse kinematics finds what is near its guess."""

    tucked: np.ndarray  #: joint positions near those of the tucked arm
    bend: int  #: index of the joint that pitches the hand
    bends: tuple[float, ...]  #: guesses for a hand that points to the ground: so much more than in the tucked arm
    turn: int  #: index of the joint that turns the hand about its approach
    held: int | None = None  #: index of a joint to hold where the guess has it, in an arm with one more than it needs


@dataclasses.dataclass(frozen=True)
class Postures:
    """Where the hand is, in the base's frame: x ahead of its middle, z above the floor."""

    #: the pinch point when the arm is tucked, (x, z). A candle held there passes over a child's head, clear of it by
    #: `WAX_CLEAR` and `FLAME_CLEAR` (`caregiver_mj.recording.contacts`)
    carry: tuple[float, float]
    reach: float  #: how far ahead a candle on a table is gripped, and put down
    hand_pitch: float  #: of the hand below the horizontal, so that the wrist clears a table's top
    lying_reaches: tuple[float, ...]  #: how far ahead a candle that lies may be gripped
    lying_pitches: tuple[float, ...]  #: of a hand that takes a candle up level; the later ones reach farther
    floor_reach: float  #: how far ahead a candle is laid on open floor


@dataclasses.dataclass(frozen=True)
class Approach:
    """How far out the hand may be, as a share of its reach, while the base drives."""

    turn: float  #: when the base turns
    above: float  #: when it nears a table: all of the hand is higher than a candle
    hover: float  #: when it is nearly in line with the candle: only the fingertips are not higher
    #: seconds before the base has arrived at which the last of the way down begins, such that the base is there before
    #: the fingers are beside the candle
    last_time: float
    drive: float = 0.62  #: when it sets off: the hand is clear of a candle that it has let go, and meets no wall
    drive_loaded: float = 0.85  #: when it sets off with a candle that is clear of the table
    above_distance: float = 0.60  #: metres to go from which on it may be out like that
    above_yaw: float = 0.35  #: radians to go for the same
    hover_across: float = 0.04  #: metres to go across for the same
    hover_distance: float = 0.30  #: metres to go ahead for the same
    hover_yaw: float = 0.12  #: radians to go for the same
    last_distance: float = 0.14  #: metres to go for the same
    last_yaw: float = 0.08  #: radians to go for the same


@dataclasses.dataclass(frozen=True)
class Grasp:
    """How the hand takes a candle."""

    open: float  #: how far each finger stands off the middle when open
    closed: float  #: the same when closed: less than a candle's radius, and the difference is what squeezes it
    grip_time: float  #: seconds from closing to a firm grip
    widest: float = 0.0  #: the same at most, for what is thicker than a candle; `open` if that is more
    #: how much nearer the candle shall be than the middle of the fingers: too far out it is lost sooner than too far in
    depth: float = 0.003
    #: seconds before the hand is down at which the fingers begin to give way: they squeeze less and less. Much earlier,
    #: and the candle is not yet pressed upright
    release_time: float = 0.05
    above_lying: float = 0.006  #: above the middle of a candle that lies, to keep the fingertips off the ground

    def opened(self, thing: layout.Thing) -> float:
        """Return how far each finger stands off the middle before it takes a thing."""
        return max(self.open, min(self.widest, self.open + (thing.radius - layout.CANDLE_RADIUS)))

    def squeezed(self, thing: layout.Thing) -> float:
        """Return the command of each finger that squeezes a thing, m from the middle."""
        return self.closed + (thing.radius - layout.CANDLE_RADIUS)


@dataclasses.dataclass(frozen=True)
class Clearances:
    """Room that the robot needs besides its footprint."""

    turning: float  #: from the middle of the base to a wall, so that a candle in the tucked hand can be swung round
    child_turning: float  #: from the middle of the base to that of a child, for the same reason
    hand: float  #: to both sides of the hand's middle when it is out: half its width, and what the arm may be off
    #: from the middle of a candle that is put down, or taken, to the nearest end of another one; half of it counts for
    #: a hand that passes a wall
    hand_width: float
    furniture: float = 0.07  #: between the base and furniture on a planned path; blended corners and tracking need it
    corner: float = 0.02  #: how much of that a cut corner may use up
    standing: float = 0.02  #: how much of it the base may use up where it stands still
