"""The robot's references and the actions that follow them: base path, heading, arm and gripper.

Skills set goals here; once a control timestep `RobotMotion.action` samples all references and adds the feedback.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.robot import kinematics, limits
from caregiver_mj.robot.kinematics import ReachPath
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.trajectories import BasePath, PathError, ScalarMotion

OPEN = 0.036  # metres that each finger stands off the middle when open
CLOSED = 0.012  # metres, less than a candle's radius: the difference is what squeezes it

# Feedback of the base: 1/s from position error to velocity. The servos follow a velocity within their lag, in seconds
# (mass over gain of the servo; see models/robot.xml), which is fed forward.
_POSITION_GAIN = 5.0
_YAW_GAIN = 8.0
_GENTLE_SPEED = 0.03  # m/s
_CATCH_UP_SPEED = 0.3  # m/s, the most of the feedback: what holds the base up may let go of it
_HELD_UP = 0.15  # metres off its reference beyond which a base is held up by something
_TOP_SPEED = 0.998 * limits.MAX_BASE_SPEED  # m/s
_BASE_LAG = 0.0205
_YAW_LAG = 0.008

_CORNER_DEVIATIONS = (0.2, 0.12, 0.06)  # metres by which corners of a path are cut, if there is room
_CHECK_INTERVAL = 0.08  # seconds between the points of a path that are checked for room

# The path is played back at a rate of 0 to 1, to slow down on it. The slower the path itself is, the quicker the rate
# may change; below this speed it makes no difference any more.
_SLOW = 0.3  # m/s


class RobotMotion:
    """Where the robot shall be, now and next.

    Times are seconds since the start of the episode, positions metres in the house, angles radians.

    Attributes:
        now: The present time.
        gentle: Whether the base, pushed off its reference, returns to it slowly only: a child may be in between.
    """

    def __init__(self, control_timestep: float):
        self._half_timestep = control_timestep / 2

    def reset(self, base: Sequence[float]) -> None:
        """Begins an episode at rest, with the arm tucked and the gripper open.

        Args:
            base: Pose (x, y, yaw) of the base.
        """
        self.now = 0.0
        self.gentle = self._watched = False
        self._hold((float(base[0]), float(base[1])))
        self._yaw = ScalarMotion(limits.YAW, float(base[2]))
        self.reach_path = kinematics.reach_path(7000)  # all begin with the tucked arm; `plan_reach` aims it
        self._reach = ScalarMotion(self.reach_path.limits, 0.0)
        self._gripper = ScalarMotion(limits.GRIPPER, OPEN)
        self._action = np.empty(11)
        self._posture: tuple[ReachPath, float] | None = None  # path and reach of the arm in the last action

    # -- Goals -----------------------------------------------------------------------------------

    def drive_along(self, points: Sequence[Vector], is_clear: Callable[[np.ndarray], bool]) -> None:
        """Takes a new path, from the motion that is under way now.

        Args:
            points: Polyline to follow.
            is_clear: Tells whether the base has room at points (n, 2). Corners are cut as long as it does.

        Raises:
            PathError: The base is too fast to turn into it, or has no room to; stop first.
        """
        _, velocity, acceleration = self.base_reference()
        moves = math.hypot(*velocity) > 1e-3
        for deviation in _CORNER_DEVIATIONS:
            path = BasePath(points, limits.BASE, velocity, acceleration, deviation)
            times = np.arange(0.0, path.duration, _CHECK_INTERVAL)
            if is_clear(np.array([path.at(time)[0] for time in times]).reshape(-1, 2)):
                break
        else:
            if moves:
                raise PathError("no room to turn into the path")
        self._path = path
        # The path begins with the present velocity, so it is played back at full rate from the first moment; from rest
        # the rate may start anywhere, and starts at nothing until `set_rate` says how much the child allows.
        self._playback = ScalarMotion(_rate_limits(limits.BASE.velocity), 0.0)
        self._rate = 1.0 if moves else 0.0
        self._playback.run_at(self._rate, self.now, at_once=True)

    def set_rate(self, rate: float) -> None:
        """Sets the share, 0 to 1, of its planned speed at which the base moves along its path.

        It holds for one control timestep: a base at which nobody looks any more stops.
        """
        self._watched = True
        if self._path is None:
            return
        if self._rate == 0.0 and self._playback.at(self.now)[0] == 0.0:
            self._rate = rate
            self._playback.run_at(rate, self.now, at_once=True)
        # The solver is asked for worthwhile changes only.
        elif abs(rate - self._rate) > 0.04 or (rate in (0.0, 1.0) and rate != self._rate):
            self._rate = rate
            self._playback.set_limits(_rate_limits(math.hypot(*self.planned_velocity())))
            self._playback.run_at(rate, self.now)

    def turn_to(self, yaw: float) -> None:
        """Sets the heading, by the shorter way round."""
        here = self._yaw.at(self.now)[0]
        self._yaw.move_to(here + math.remainder(yaw - here, math.tau), self.now)

    def turn_gently(self) -> None:
        """Has the base turn slowly, from its next goal on and until the gripper opens: a candle slips in the hand."""
        self._yaw.set_limits(limits.YAW_GENTLE)

    def plan_reach(self, height: float) -> None:
        """Aims the arm at a height above the floor, for the next time that it reaches out."""
        self.reach_along(kinematics.reach_path(round(1e4 * height)))

    def reach_along(self, path: ReachPath) -> None:
        """Gives the arm, which is tucked, the path for the next time that it reaches out."""
        self.reach_path = path
        self._reach.set_limits(path.limits)

    def reach(self, s: float) -> None:
        """Sets how far the hand reaches out: 0 tucked, 1 at the goal, or more where the path has more poses."""
        self._reach.move_to(s, self.now)

    def stop_reaching(self) -> None:
        """Stops the hand where it is, until the next `reach`."""
        self._reach.run_at(0.0, self.now)

    def grip(self, width: float) -> None:
        """Sets how far each finger stands off the middle."""
        self._gripper.move_to(width, self.now)
        if width == OPEN:
            self._yaw.set_limits(limits.YAW)

    # -- State of the references -----------------------------------------------------------------

    def base_reference(self) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration of the base's reference now."""
        return self._base_at(self.now)

    @property
    def time_left(self) -> float:
        """Seconds until the base arrives if it is not slowed down any more."""
        if self._path is None:
            return 0.0
        return self._path.duration - self._playback.at(self.now)[0]

    @property
    def is_driving(self) -> bool:
        """Whether the base has a path to follow, be it that it waits on it."""
        return self._path is not None

    @property
    def rate(self) -> float:
        """The share, 0 to 1, of its planned speed at which the base goes along its path now; 0 without a path."""
        return 0.0 if self._path is None else self._playback.at(self.now)[1]

    @property
    def is_unhindered(self) -> bool:
        """Whether the base goes along its path as fast as planned."""
        return self._path is None or self._playback.at(self.now)[1] > 0.99

    @property
    def moving(self) -> bool:
        """Whether the base's reference is on its way."""
        return self._path is not None and math.hypot(*self.base_reference()[1]) > 1e-3

    def points_ahead(self, seconds: float) -> list[Vector]:
        """Points of the path that the base passes within some seconds."""
        if self._path is None:
            return [self._here]
        begin = self._playback.at(self.now)[0]
        return [self._path.at(begin + seconds * i / 5)[0] for i in range(1, 6)]

    def planned_velocity(self) -> Vector:
        """The velocity that the path would have now at full rate."""
        if self._path is None:
            return (0.0, 0.0)
        # Look a little ahead, so that a base at rest at the start of its path sees where it would go.
        return self._path.at(self._playback.at(self.now)[0] + 0.1)[1]

    @property
    def closes(self) -> bool:
        """Whether the fingers have been told to close."""
        return self._gripper.target == CLOSED

    @property
    def reached(self) -> float:
        """How far the hand reaches out now."""
        return self._reach.at(self.now)[0]

    @property
    def hand_out(self) -> float:
        """How far the hand reaches out, or will before it turns back."""
        position, velocity, _ = self._reach.at(self.now)
        return self._reach.highest() if velocity > 0.0 else position

    @property
    def reach_arrival(self) -> float:
        """When the hand's motion ends."""
        return self._reach.arrival

    @property
    def yaw(self) -> float:
        """The heading's reference now."""
        return self._yaw.at(self.now)[0]

    def turns_to(self, yaw: float) -> bool:
        """Whether the heading is on its way to this one, or there."""
        return abs(math.remainder(yaw - self._yaw.target, math.tau)) < 1e-6

    def turn_left(self, yaw: float) -> float:
        """Seconds until the heading is this one; at most that many if its turn has not begun yet."""
        angle = abs(math.remainder(yaw - self.yaw, math.tau))
        if angle < 1e-3:
            return 0.0
        if self.turns_to(yaw):
            return self._yaw.arrival - self.now
        velocity, acceleration, jerk = dataclasses.astuple(self._yaw.limits)
        return angle / velocity + velocity / acceleration + acceleration / jerk

    # -- Following them --------------------------------------------------------------------------

    def action(self, base: Sequence[float]) -> np.ndarray:
        """The action for the coming control timestep.

        Args:
            base: Measured pose (x, y, yaw) of the base.

        Returns:
            Base velocities (3,), arm joint targets (7,) and gripper target (1,), in one array (11,).
        """
        if not self._watched:
            self.set_rate(0.0)
        self._watched = False
        now = self.now
        (x, y), _, _ = self._base_at(now)
        if math.dist((x, y), base[:2]) > _HELD_UP:  # it must find a new way from where it is
            self._hold((float(base[0]), float(base[1])))
            x, y = self._here
        middle = now + self._half_timestep  # an action is held for a timestep: aim at the middle of it
        _, (vx, vy), (ax, ay) = self._base_at(middle)
        yaw = self._yaw.at(now)[0]
        _, yaw_rate, yaw_acceleration = self._yaw.at(middle)
        back_x, back_y = _POSITION_GAIN * (x - base[0]), _POSITION_GAIN * (y - base[1])
        most = _GENTLE_SPEED if self.gentle else _CATCH_UP_SPEED
        if (push := math.hypot(back_x, back_y)) > most:
            back_x, back_y = back_x * most / push, back_y * most / push
        vx, vy = vx + _BASE_LAG * ax + back_x, vy + _BASE_LAG * ay + back_y
        if (speed := math.hypot(vx, vy)) > _TOP_SPEED:  # held up by something, it must not catch up at any speed
            vx, vy = vx * _TOP_SPEED / speed, vy * _TOP_SPEED / speed
        action = self._action
        action[0], action[1] = vx, vy
        action[2] = yaw_rate + _YAW_LAG * yaw_acceleration + _YAW_GAIN * (yaw - base[2])
        posture = (self.reach_path, self._reach.at(now)[0])
        if posture != self._posture:
            self._posture = posture
            action[3:10] = self.reach_path.joints(posture[1])
        action[10] = self._gripper.at(now)[0]
        return action.copy()

    def _base_at(self, time: float) -> tuple[Vector, Vector, Vector]:
        if self._path is None:
            return self._here, (0.0, 0.0), (0.0, 0.0)
        along, rate, change = self._playback.at(time)
        if along >= self._path.duration:
            self._hold(self._path.goal)
            return self._here, (0.0, 0.0), (0.0, 0.0)
        position, (vx, vy), (ax, ay) = self._path.at(along)
        if rate != 1.0 or change != 0.0:
            vx, vy, ax, ay = rate * vx, rate * vy, rate**2 * ax + change * vx, rate**2 * ay + change * vy
        return position, (vx, vy), (ax, ay)

    def _hold(self, position: Vector) -> None:
        self._here, self._path, self._rate = position, None, 1.0


def _rate_limits(speed: float) -> Limits:
    """Bounds of the rate of playback that keep those of the base, on a path of this speed."""
    speed = max(speed, _SLOW)
    return Limits(1.0, limits.BASE.acceleration / speed, limits.BASE.jerk / speed)
