"""The description of a robot: everything that differs from one robot to another.

It is a model file and the numbers that the model does not have. The others (joint ranges, the order of actuators,
footprint, wheels) are read from the model, see `robot_model`. Robots by name: `embodiments`.

A model file holds the robot alone. It faces +x with its origin on the floor, and has

- a body `base` with a collision geom `base_hull`, which moves in three joints: along x, along y, about z; a cylinder
  collides badly with the corners of boxes, and leaves them to a sphere beside it, see `mobile_fr3`;
- a body `hand` with a site `pinch` between the fingertips, whose axes are z ahead, y along which the fingers open;
- two fingers whose joints open at positive positions, with collision geoms `finger_left_pad` and `finger_right_pad`;
- velocity servos of the base, position servos of arm and fingers, in this order;
- a site `tray` on the base for the tray for small things, without which the robot does not pick them up.

Attributes are in metres, radians and seconds unless they say otherwise.
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

DEFAULT = "mobile_fr3"  # name of the default robot
_ROLLS, _STEERS = 0.01, 20.0  # m/s; speed from which on a wheel is steered. 1/s; gain from steering error to rate


@dataclasses.dataclass(frozen=True)
class Names:
    """Names of the parts of a model."""

    arm: tuple[str, ...]  #: joints from the shoulder on
    fingers: tuple[str, str]  #: joints of the left and of the right finger
    chain: tuple[str, ...]  #: bodies of the arm between which it bends, from the shoulder to the wrist
    base: tuple[str, str, str] = ("base_x", "base_y", "base_yaw")  #: joints along x, along y and about z
    #: steering joints: front left and right, then rear left and right
    wheels: tuple[str, str, str, str] = ("wheel_front_left", "wheel_front_right", "wheel_rear_left", "wheel_rear_right")


@dataclasses.dataclass(frozen=True)
class CommandLayout:
    """Places of commands in an array."""

    base: slice  #: velocities along x, along y and about z
    arm: slice  #: joint targets
    gripper: slice  #: distance of fingers from the middle: one number in an action, one a finger in actuators
    size: int  #: length of the array


@dataclasses.dataclass(frozen=True)
class Wheels:
    """Four driven wheels, each steered about its centre."""

    places: tuple[tuple[float, float], ...]  #: place of each: x ahead of the base's centre, y to its left

    def steer(self, headings: Sequence[float], ahead: float, aside: float, turn: float) -> list[float]:
        """Return steering rates of the wheels towards their motion, rad/s, in the order of `Names.wheels`.

        A wheel rolls either way, so that it steers by at most a quarter turn. At rest it keeps its heading.

        Args:
            headings: Heading of each wheel in the base's frame, rad.
            ahead: Velocity of the base along its x axis, m/s.
            aside: Velocity of the base along its y axis, m/s.
            turn: Rate of the base's turn, rad/s.
        """
        rates = []
        for heading, (x, y) in zip(headings, self.places, strict=True):
            along, across = ahead - turn * y, aside + turn * x
            moves = math.hypot(along, across) > _ROLLS
            rates.append(_STEERS * math.remainder(math.atan2(across, along) - heading, math.pi) if moves else 0.0)
        return rates


@dataclasses.dataclass(frozen=True)
class Servos:
    """Gains and lags with which the base follows its reference."""

    position_gain: float  #: 1/s; from position error to velocity
    yaw_gain: float  #: 1/s; from heading error to turning rate
    base_lag: float  #: s; lag behind a commanded velocity, fed forward
    yaw_lag: float  #: s; the same of the turning rate


class Tray(NamedTuple):
    """Interior of the tray for small things, in the base's frame, m."""

    middle: tuple[float, float, float]  #: centre of the box that holds the feet of things in it
    half: tuple[float, float, float]  #: half of that box's sides

    def along(self, spot: float) -> np.ndarray:
        """Return a place in it, (3,), by its position on the longer side, from -1 to 1."""
        way = np.where(np.arange(3) == np.argmax(self.half), self.half, 0.0)
        return np.array(self.middle) + spot * way

    def holds(self, point: Sequence[float], unsure: float = 0.0) -> bool:
        """Return whether a foot (3,), in the base's frame, is in it, or within `unsure` metres of it."""
        return all(abs(p - m) < h + unsure for p, m, h in zip(point, self.middle, self.half, strict=True))


@dataclasses.dataclass(frozen=True, eq=False)
class Embodiment:
    """A robot."""

    name: str  #: its name
    model: Traversable  #: the model file
    names: Names  #: names of its parts
    layout: CommandLayout  #: layout of actions
    actuators: CommandLayout  #: layout of the model's actuators, two of which are fingers
    footprint: float  #: radius of the circle about the base's centre that contains it
    wheels: Wheels  #: the steered wheels
    torque: np.ndarray  #: N m; greatest torque of each arm joint, (joints,)
    limits: RobotLimits  #: bounds of its motion
    servos: Servos  #: the base's servos
    bends: Bends  #: guesses for inverse kinematics
    postures: Postures  #: places of the hand
    approach: Approach  #: extension of the hand while the base drives
    grasp: Grasp  #: grasping of candles
    clearances: Clearances  #: room besides the footprint
    #: half of the length and width of a box-shaped base about its centre; (0, 0) for a round one
    sides: tuple[float, float] = (0.0, 0.0)
    fingertip: float = 0.0  #: extent of the fingers' pads beyond the pinch point
    tray: Tray | None = None  #: the tray for small things; None without one

    @property
    def rounding(self) -> float:
        """Extent of the base beyond its `sides`, m."""
        return self.footprint - math.hypot(*self.sides)


@dataclasses.dataclass(frozen=True, eq=False)
class Bends:
    """Guesses of the arm's joint positions: inverse kinematics finds the solution near its guess."""

    tucked: np.ndarray  #: joint positions near those of the tucked arm
    bend: int  #: index of the joint that pitches the hand
    bends: tuple[float, ...]  #: its guesses for a hand that points down, beyond those of the tucked arm
    turn: int  #: index of the joint that turns the hand about its approach
    held: int | None = None  #: index of a joint to hold at its guess, in a redundant arm


@dataclasses.dataclass(frozen=True)
class Postures:
    """Places of the hand in the base's frame: x ahead of its centre, z above the floor."""

    #: pinch point of the tucked arm, (x, z). A candle there clears a child's head by `WAX_CLEAR` and `FLAME_CLEAR`
    #: (`caregiver_mj.recording.ledger`)
    carry: tuple[float, float]
    reach: float  #: x of a candle on a table at the grip and at the release
    hand_pitch: float  #: of the hand below the horizontal, so that the wrist clears tables
    lying_reaches: tuple[float, ...]  #: possible x of a lying candle at the grip
    lying_pitches: tuple[float, ...]  #: pitches of the hand for a lying candle; later ones reach farther
    floor_reach: float  #: x of a candle laid down on open floor


@dataclasses.dataclass(frozen=True)
class Approach:
    """Extension of the hand while the base drives, as a share of its reach."""

    turn: float  #: greatest while the base turns
    above: float  #: near a table, with all of the hand above a candle
    hover: float  #: nearly in line with the candle, with all but the fingertips above it
    #: s before arrival at which the hand begins the last of its way down; the fingers must reach the candle after the
    #: base has arrived
    last_time: float
    drive: float = 0.62  #: greatest at departure: the hand is clear of the released candle, and of walls
    drive_loaded: float = 0.85  #: greatest at departure with a candle, which is clear of the table
    above_distance: float = 0.60  #: remaining distance from which on `above` is allowed
    above_yaw: float = 0.35  #: remaining turn for the same
    hover_across: float = 0.04  #: remaining distance across for `hover`
    hover_distance: float = 0.30  #: remaining distance ahead for the same
    hover_yaw: float = 0.12  #: remaining turn for the same
    last_distance: float = 0.14  #: remaining distance for the last of the way
    last_yaw: float = 0.08  #: remaining turn for the same


@dataclasses.dataclass(frozen=True)
class Grasp:
    """How the hand grasps a candle."""

    open: float  #: distance of each finger from the middle when open
    closed: float  #: the same when closed; the difference to a candle's radius squeezes it
    grip_time: float  #: s; from closing to a firm grip
    widest: float = 0.0  #: greatest opening, for things thicker than a candle; `open` if that is more
    #: offset of the candle inwards from the fingers' middle: too far out it is lost sooner than too far in
    depth: float = 0.003
    #: s before the hand is down at which the fingers begin to open; much earlier, the candle is not yet pressed upright
    release_time: float = 0.05
    above_lying: float = 0.006  #: height above a lying candle's middle, to keep the fingertips off the ground

    def opened(self, thing: layout.Thing) -> float:
        """Return the distance of each finger from the middle before it grasps a thing."""
        return max(self.open, min(self.widest, self.open + (thing.radius - layout.CANDLE_RADIUS)))

    def squeezed(self, thing: layout.Thing) -> float:
        """Return the command of each finger that squeezes a thing, m from the middle."""
        return self.closed + (thing.radius - layout.CANDLE_RADIUS)


@dataclasses.dataclass(frozen=True)
class Clearances:
    """Room that the robot needs beside its footprint."""

    turning: float  #: from the base's centre to a wall, to turn with a candle in the tucked hand
    child_turning: float  #: from the base's centre to a child's, for the same
    hand: float  #: on both sides of the extended hand's middle: half its width, and the arm's error
    #: from the middle of a candle at the grip or release to the nearest end of another; half of it for a hand that
    #: passes a wall
    hand_width: float
    furniture: float = 0.07  #: between base and furniture on a planned path, for blended corners and tracking
    corner: float = 0.02  #: part of that which a cut corner may use
    standing: float = 0.02  #: part of it which a base at rest may use
