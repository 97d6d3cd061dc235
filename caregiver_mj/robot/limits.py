"""Bounds of the robot's motion. Commands stay within them at all times; the numbers are each embodiment's own."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

CREEP = 0.03  # m/s, of base and hand beside a child: with what they may go beyond that slower than a strike, 0.05 m/s
_ACCELERATION_SHARE, _JERK_SHARE = 0.9, 0.72  # of the base's highest, see `RobotLimits.together`
_TOP_SHARE = 0.99  # of the base's highest speed, for reference and feedback together
_COMMANDED_SHARE, _COMMANDED_JERK_SHARE = 0.92, 0.88  # of the same, see `RobotLimits.as_commanded`
_LEAST_BRAKING = 0.2  # of that acceleration: a corner gets tighter nowhere, and gentler as soon as the base slows down
_CORNER_DELAYS = 0.2  # seconds, by a corner that leaves nothing to brake with
_DELAYED = 0.05  # seconds by which a corner, or the path's own braking, may delay it, by trial


@dataclasses.dataclass(frozen=True)
class Limits:
    """Bounds of one scalar motion.

    Attributes:
        velocity: units / s.
        acceleration: units / s^2.
        jerk: units / s^3.
    """

    velocity: float
    acceleration: float
    jerk: float

    def slowing(self, seconds: float) -> float:
        """Return by how much a steady velocity can be brought down to another steady one within a time; 0 in none."""
        seconds = max(0.0, seconds)
        if seconds < 2 * self.acceleration / self.jerk:
            return self.jerk * seconds**2 / 4
        return self.acceleration * (seconds - self.acceleration / self.jerk)


@dataclasses.dataclass(frozen=True, eq=False)
class NearEnds:
    """How joints must slow down towards the ends of their ranges: to sqrt(slope * way left) - offset.

    Attributes:
        low: Where the way down ends, of each joint, rad.
        high: Where the way up ends, rad.
        slope: rad/s^2.
        offset: rad/s.
    """

    low: np.ndarray
    high: np.ndarray
    slope: np.ndarray
    offset: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class ArmLimits:
    """Bounds of an arm's joints: as published, and the part of them that is planned for.

    Less is planned for than is published: it is gentler, and rounding cannot carry the arm over.

    Attributes:
        velocity: Of each joint, rad/s, in the middle of its range.
        acceleration: Of each joint, rad/s^2.
        jerk: Of each joint, rad/s^3.
        velocity_share: The part of the velocity that is planned for.
        acceleration_share: The part of the acceleration that is planned for.
        planned_jerk: rad/s^3, of all joints.
        near_ends: Limits of the velocity near the ends of the joints' ranges; None if there are none.
        servo_velocity: Of each joint, rad/s, beyond which nothing is planned either: faster its servo lags behind.
    """

    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray
    velocity_share: float
    acceleration_share: float
    planned_jerk: float
    near_ends: NearEnds | None = None
    servo_velocity: np.ndarray | float = math.inf

    def velocity_at(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return bounds of the joints' speeds at positions, in the directions of velocities (..., joints), rad/s."""
        if (ends := self.near_ends) is None:
            return np.broadcast_to(self.velocity, position.shape)
        left = np.maximum(0.0, np.where(velocity > 0, ends.high - position, position - ends.low))
        return np.minimum(self.velocity, np.maximum(0.0, np.sqrt(ends.slope * left) - ends.offset))


class Carrying(NamedTuple):
    """Bounds of the base's motion while something is in the hand, which would slip, tip or spill with more.

    Attributes:
        base: Planned for the base's path, metres.
        acceleration: The base's highest acceleration, m/s^2.
        jerk: The same of its jerk, m/s^3.
    """

    base: Limits
    acceleration: float
    jerk: float


@dataclasses.dataclass(frozen=True, eq=False)
class RobotLimits:
    """Bounds of all that a robot moves.

    Attributes:
        arm: Its joints.
        base: Planned for the base's path, metres.
        yaw: Planned for the base's turns, radians.
        yaw_gentle: The same while a candle that has slipped is in the hand. At every physics step of a turn a candle
            goes on along the tangent of the hand's arc, and friction knows no place to come back to.
        gripper: Planned for each finger, metres.
        base_speed: The highest speed of the base, m/s; what is planned leaves the feedback something to correct with.
        base_acceleration: Its highest acceleration, m/s^2, of path and changes of rate together.
        base_jerk: Its highest jerk, m/s^3, of both together.
        turn: The highest of the base's turns, feedback and all.
        finger_speed: The highest speed of each finger, m/s.
        carrying: What the base's are with something in the hand; None if they are the same.
    """

    arm: ArmLimits
    base: Limits
    yaw: Limits
    yaw_gentle: Limits
    gripper: Limits
    base_speed: float
    base_acceleration: float
    base_jerk: float
    turn: Limits
    finger_speed: float
    carrying: Carrying | None = None

    @functools.cached_property
    def loaded(self) -> RobotLimits:
        """The limits with something in the hand."""
        if self.carrying is None:
            return self
        base, acceleration, jerk = self.carrying
        return dataclasses.replace(self, base=base, base_acceleration=acceleration, base_jerk=jerk, carrying=None)

    @functools.cached_property
    def together(self) -> Limits:
        """What the base's path and a change of its rate on it may have together, metres; of the jerk, the rate alone.

        What is left of the highest is for the feedback, and for the jerk of a change of rate on a path that speeds up.
        """
        jerk = _JERK_SHARE * self.base_jerk - self.base.jerk
        return Limits(self.base_speed, _ACCELERATION_SHARE * self.base_acceleration, jerk)

    @functools.cached_property
    def as_commanded(self) -> Limits:
        """Limits of the base's commands, in metres: its highest less what drives and arm add.

        An arm that speeds up or slows down at the same time adds up to 0.15 m/s^2.
        """
        acceleration, jerk = _COMMANDED_SHARE * self.base_acceleration, _COMMANDED_JERK_SHARE * self.base_jerk
        return Limits(_TOP_SHARE * self.base_speed, acceleration, jerk)

    @functools.cached_property
    def turn_as_commanded(self) -> Limits:
        """Limits of the commands of the base's turns, in radians: the highest less what drives and arm add."""
        velocity, acceleration, jerk = dataclasses.astuple(self.turn)
        return Limits(_TOP_SHARE * velocity, _TOP_SHARE * acceleration, _COMMANDED_JERK_SHARE * jerk)

    def braking(self, velocity: tuple[float, float], acceleration: tuple[float, float]) -> tuple[float, float]:
        """Return how a base can brake on a path.

        Args:
            velocity: Planned there, m/s, not zero.
            acceleration: Planned there, m/s^2.

        Returns:
            The deceleration that a corner leaves, m/s^2, and the seconds to build it up, which are more on a path
            that speeds up. A corner that comes while it brakes can make the way to stop 3 cm longer, of 20 cm to 1 m.
        """
        together = self.together
        (vx, vy), (ax, ay), speed = velocity, acceleration, math.hypot(*velocity)
        ahead, across = (vx * ax + vy * ay) / speed, (vx * ay - vy * ax) / speed
        most = together.acceleration
        left = math.sqrt(max(most**2 - across**2, (_LEAST_BRAKING * most) ** 2))
        return left, (left + max(0.0, ahead)) / together.jerk + _DELAYED + _CORNER_DELAYS * (1.0 - left / most)

    def slowing(self, seconds: float) -> float:
        """Return by how much a base on its way can slow down within a time, m/s."""
        return self.together.slowing(seconds - _DELAYED)
