"""Bounds of the robot's motion, which commands keep at all times. Their values are the embodiment's."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

CREEP = 0.03  # m/s; speed of base and hand beside a child, with overshoot below a strike (0.05 m/s)
_ACCELERATION_SHARE, _JERK_SHARE = 0.9, 0.72  # shares of the base's greatest, see `RobotLimits.together`
_TOP_SHARE = 0.99  # share of the base's greatest speed, for reference and feedback together
_COMMANDED_SHARE, _COMMANDED_JERK_SHARE = 0.92, 0.88  # shares of the base's greatest, see `RobotLimits.as_commanded`
_LEAST_BRAKING = 0.2  # share of that acceleration; corners are no tighter, and ease as the base slows down
_CORNER_DELAYS = 0.2  # s; delay of braking by a corner that leaves nothing to brake with
_DELAYED = 0.05  # s; delay by a corner or the path's own braking, by trial


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
        """Return the greatest decrease of a steady velocity to another steady one within a time; 0 in none."""
        seconds = max(0.0, seconds)
        if seconds < 2 * self.acceleration / self.jerk:
            return self.jerk * seconds**2 / 4
        return self.acceleration * (seconds - self.acceleration / self.jerk)


@dataclasses.dataclass(frozen=True, eq=False)
class NearEnds:
    """Velocity bound of joints near the ends of their ranges: sqrt(slope * way left) - offset.

    Attributes:
        low: Lower end, rad, (joints,).
        high: Upper end, rad, (joints,).
        slope: rad/s^2, (joints,).
        offset: rad/s, (joints,).
    """

    low: np.ndarray
    high: np.ndarray
    slope: np.ndarray
    offset: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class ArmLimits:
    """Bounds of an arm's joints, as published, and the part of them used in plans.

    Plans use less to be gentle, and so that rounding cannot exceed the bounds.

    Attributes:
        velocity: rad/s, in the middle of each joint's range.
        acceleration: rad/s^2, of each joint.
        jerk: rad/s^3, of each joint.
        velocity_share: Planned share of the velocity.
        acceleration_share: Planned share of the acceleration.
        planned_jerk: rad/s^3, of all joints.
        near_ends: Velocity bounds near the ends of the joints' ranges; None if there are none.
        servo_velocity: rad/s, of each joint; also a bound of plans, because beyond it the servo lags.
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
        """Return bounds of joint speeds at positions, rad/s, in the directions of velocities, (..., joints) each."""
        if (ends := self.near_ends) is None:
            return np.broadcast_to(self.velocity, position.shape)
        left = np.maximum(0.0, np.where(velocity > 0, ends.high - position, position - ends.low))
        return np.minimum(self.velocity, np.maximum(0.0, np.sqrt(ends.slope * left) - ends.offset))


class Carrying(NamedTuple):
    """Bounds of the base's motion with something in the hand, which could slip, tip or spill beyond them.

    Attributes:
        base: Planned bounds of the base's path, m.
        acceleration: Greatest acceleration of the base, m/s^2.
        jerk: Greatest jerk of the base, m/s^3.
    """

    base: Limits
    acceleration: float
    jerk: float


@dataclasses.dataclass(frozen=True, eq=False)
class RobotLimits:
    """Bounds of all motions of a robot.

    Attributes:
        arm: The arm's joints.
        base: Planned bounds of the base's path, m.
        yaw: Planned bounds of the base's turns, rad.
        yaw_gentle: The same with a slipped candle in the hand. At every physics step of a turn a candle moves on along
            the tangent of the hand's arc, and friction does not return it.
        gripper: Planned bounds of each finger, m.
        base_speed: Greatest speed of the base, m/s; the rest beyond plans is for feedback.
        base_acceleration: Greatest acceleration of the base, m/s^2, of path and changes of rate together.
        base_jerk: Greatest jerk of the base, m/s^3, of both together.
        turn: Greatest values of the base's turns, feedback included.
        finger_speed: Greatest speed of each finger, m/s.
        carrying: Bounds of the base with something in the hand; None for the same.
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
        """Bounds, m, of the base's path and changes of its rate together; the jerk is that of the rate alone.

        The rest of the greatest values is for feedback, and for the jerk of a change of rate on an accelerating path.
        """
        jerk = _JERK_SHARE * self.base_jerk - self.base.jerk
        return Limits(self.base_speed, _ACCELERATION_SHARE * self.base_acceleration, jerk)

    @functools.cached_property
    def as_commanded(self) -> Limits:
        """Bounds of the base's commands, m: the greatest values less the contributions of drives and arm.

        A simultaneously accelerating arm contributes up to 0.15 m/s^2.
        """
        acceleration, jerk = _COMMANDED_SHARE * self.base_acceleration, _COMMANDED_JERK_SHARE * self.base_jerk
        return Limits(_TOP_SHARE * self.base_speed, acceleration, jerk)

    @functools.cached_property
    def turn_as_commanded(self) -> Limits:
        """Bounds of the commanded turns, rad: the greatest values less the contributions of drives and arm."""
        velocity, acceleration, jerk = dataclasses.astuple(self.turn)
        return Limits(_TOP_SHARE * velocity, _TOP_SHARE * acceleration, _COMMANDED_JERK_SHARE * jerk)

    def braking(self, velocity: tuple[float, float], acceleration: tuple[float, float]) -> tuple[float, float]:
        """Return how a base can brake on a path.

        Args:
            velocity: Planned velocity, m/s, not zero.
            acceleration: Planned acceleration, m/s^2.

        Returns:
            The deceleration that a corner leaves, m/s^2, and the time to build it up, s, which is longer on an
            accelerating path. A corner during braking can lengthen the stopping distance, 20 cm to 1 m, by 3 cm.
        """
        together = self.together
        (vx, vy), (ax, ay), speed = velocity, acceleration, math.hypot(*velocity)
        ahead, across = (vx * ax + vy * ay) / speed, (vx * ay - vy * ax) / speed
        most = together.acceleration
        left = math.sqrt(max(most**2 - across**2, (_LEAST_BRAKING * most) ** 2))
        return left, (left + max(0.0, ahead)) / together.jerk + _DELAYED + _CORNER_DELAYS * (1.0 - left / most)

    def slowing(self, seconds: float) -> float:
        """Return the greatest decrease of a driving base's speed within a time, m/s."""
        return self.together.slowing(seconds - _DELAYED)
