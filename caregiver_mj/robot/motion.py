"""The robot's references and the actions that follow them: base path, heading, arm and gripper.

Skills set goals here; once a control timestep `RobotMotion.action` samples all references and adds the feedback.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot.base_motion import NO_SPEED, BaseMotion
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.feedback import FollowedVelocity, GivingWay
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.limits import CREEP, Limits
from caregiver_mj.robot.reach import ReachPath, reach_path
from caregiver_mj.robot.scalar_motion import ScalarMotion

_LEAST_TURN = 0.03  # rad/s, of the bound of its turns
_GENTLE_TURN = 0.02  # rad/s, the most of the heading's feedback where a child may be at the arm
_CATCH_UP_SPEED = 0.3  # m/s, the most of the base's feedback: what holds it up may let go of it
_RELEASE = 0.4  # m/s^2, how quickly that comes back when a child has gone that bounded it
# The same of its heading, where a child has pushed it away at its arm: rad/s, and rad/s^2. Beside a child its surface
# turns so at this share of that speed, for it may creep along the child as well: both together are to be no strike.
_CATCH_UP_TURN, _RELEASE_TURN, _TURN_SHARE = 0.5, 1.0, 1 / 3
_MOST_LATE = 0.5  # of gain times delay, above which feedback by what is seen late begins to swing (at pi / 2 for good)
_JOLTS = 4.0  # m/s^3 by which feedback may jolt a base that seems to jump, one sigma
_HELD_UP = 0.15  # metres off its reference beyond which a base is held up by something
_HELD_UP_SHARE = 0.5  # of the commanded speed: slower than that, something is in its way
_LED_OFF = 0.05  # metres, the same of one whose command differs from its path: so near to that it has room

# The actuators get to their targets in the course of a control timestep, and later by this share of it: commands
# are made smooth over its four physics steps (`caregiver_mj.house.robot_body`), which costs one and a half.
_SMOOTHING = 3 / 8

# The hand comes down onto a candle, or with one onto a table, as far from the end of its way as the two may be off: the
# slower, the less it jolts. By this over the root of two sigmas, m^0.5, it keeps its limits.
_LANDS = 0.023
_GRIPS = 0.5  # share of their speed with which the fingers then close: one may meet the candle before the other

_ANY_HEIGHT = 7000  # tenths of mm: all reaches begin with the tucked arm, and `plan_reach` aims it

#: From a velocity of the base and the last commanded one, m/s, to what is left of it, and whether at once.
Restrain = Callable[[Vector, Vector], tuple[Vector, bool]]


class RobotMotion(BaseMotion):
    """References of the robot, now and in future.

    Times are seconds since the start of the episode, positions metres in the house, angles radians.

    Attributes:
        robot: The robot.
        now: The present time.
        catch_up: How fast the base, pushed off its reference, returns to it at most, m/s, and its edge as it turns back
            to it: a child may be in between.
        reach_path: On which the hand reaches out.
        giving_way: Whether, and how far, the arm lets itself be pushed away: a child may be at it.
    """

    def __init__(
        self,
        robot: Embodiment,
        control_timestep: float,
        delay: float = 0.0,
        hand_error: float = 0.0,
        base_jumps: float = 0.0,
    ):
        """Prepare it.

        Args:
            robot: The robot.
            control_timestep: Seconds between two actions.
            delay: Seconds by which it is seen late where the base is.
            hand_error: Metres by which the hand may be off a candle or a table, one sigma.
            base_jumps: Metres by which the base seems to be elsewhere from one control timestep to the next, one sigma.
        """
        limits, servos = robot.limits, robot.servos
        super().__init__(limits)
        self.robot = robot
        most = _MOST_LATE / delay if delay else math.inf
        self._position_gain, self._yaw_gain = min(servos.position_gain, most), min(servos.yaw_gain, most)
        if base_jumps:
            self._position_gain = min(self._position_gain, _JOLTS * control_timestep**2 / base_jumps)
        self._landing = min(1.0, _LANDS / math.sqrt(2 * hand_error)) if hand_error else 1.0  # share of its speed
        self._timestep, self._lead = control_timestep, (1.0 + _SMOOTHING) * control_timestep

    def reset(self, base: Sequence[float]) -> None:
        """Begin an episode at rest, with the arm tucked and the gripper open.

        Args:
            base: Pose (x, y, yaw) of the base.
        """
        limits = self.robot.limits
        self.now = 0.0
        self.catch_up, self.drives = _CATCH_UP_SPEED, 0.0
        self.giving_way = GivingWay(len(arm_of(self.robot).tucked))
        self._feedback, self._turn_feedback = _CATCH_UP_SPEED, _CATCH_UP_TURN
        self._seen_at = float(base[0]), float(base[1])
        self.led_off, self.stops, self._comes_to_rest = 0, False, False
        self._is_free = True  # whether the command is what the references want
        self.limits = limits
        self._velocity = FollowedVelocity(limits.as_commanded, self._timestep)
        self._turn_rate = FollowedVelocity(limits.turn_as_commanded, self._timestep)
        self._hold((float(base[0]), float(base[1])))
        self._turning, self._turn_bound = limits.yaw, math.inf  # rad/s: lower while children are near
        self._yaw = ScalarMotion(limits.yaw, float(base[2]), brakes=True)
        self.reach_path = reach_path(arm_of(self.robot), _ANY_HEIGHT)
        self._reach = ScalarMotion(self.reach_path.limits(0, 0), 0.0)
        self._lands_at: float | None = None  # to go there slowly, once the hand has stopped
        self._crept = math.inf  # since when it creeps
        self._gripper = ScalarMotion(limits.gripper, self.robot.grasp.open)
        self._action = np.empty(self.robot.layout.size)
        self._posture: tuple[ReachPath, float] | None = None  # path and reach of the arm in the last action

    # -- Goals -----------------------------------------------------------------------------------

    def turn_to(self, yaw: float) -> None:
        """Set the heading, by the shorter way round."""
        here = self._yaw.at(self.now)[0]
        self._yaw.move_to(here + math.remainder(yaw - here, math.tau), self.now)

    def stop_turning(self) -> None:
        """Stop the heading as soon as it can, until the next `turn_to`."""
        self._yaw.stop(self.now)

    def turn_gently(self, rate: float = math.inf) -> None:
        """Limit turns, from the next goal on and until the gripper opens: a candle slips in the hand.

        Args:
            rate: At most, rad/s, for something that slips sooner; it turns no faster again before that.
        """
        gentle = self.robot.limits.yaw_gentle
        limits = dataclasses.replace(gentle, velocity=min(rate, gentle.velocity, self._turning.velocity))
        if limits != self._turning:
            self._turn_within(limits)

    def bound_turning(self, rate: float) -> None:
        """Limit the rate of turns from now on, rad/s, because a child is near."""
        full, present = self._turning.velocity, self._yaw.limits.velocity
        rate = min(full, max(rate, _LEAST_TURN))
        if rate == present:  # most of the time
            return
        # The solver is asked for worthwhile changes only. What slows down goes on doing so until there is room again.
        speed, acceleration = self.turning
        turns = abs(speed)
        most = max(present, turns)
        # Nor does it speed up again before it has ceased to: beside a child its bound came and went at every timestep.
        may_speed_up = rate > most and (turns <= present or speed * acceleration <= 0.0)
        if rate < 0.9 * present or (may_speed_up and (rate == full or rate > 1.3 * most)):
            within = turns if turns <= rate else _LEAST_TURN  # to slow down a little the solver nearly stops first
            self._turn_bound = math.inf if rate == full else max(0.9 * rate, within)
            self._turn_within(self._turning)
            self._yaw.set_limits(self._yaw.limits, self.now)

    def _turn_within(self, limits: Limits) -> None:
        """Set limits of turns from the next goal on, within the bound in force."""
        self._turning = limits
        self._yaw.set_limits(dataclasses.replace(limits, velocity=min(limits.velocity, self._turn_bound)))

    def plan_reach(self, height: float) -> None:
        """Aim the arm at a height above the floor, for the next time that it reaches out."""
        self.reach_along(reach_path(arm_of(self.robot), round(1e4 * height)))

    def reach_along(self, path: ReachPath) -> None:
        """Give the arm, which is tucked or in a pose that both have, the path for the next time that it moves."""
        if self.reach_path.returns and self.reached == self.reach_path.goal:
            self._reach = ScalarMotion(self._reach.limits, 0.0)
        self.reach_path = path
        self._reach.set_limits(path.limits(self.reached, self.reached))

    def reach(self, s: float, creeps: bool = False, speed: float = math.inf) -> None:
        """Set how far the hand reaches out: 0 tucked, 1 at the goal, or more where the path has more poses.

        Args:
            s: So far.
            creeps: Whether it goes there more slowly than what counts as a strike.
            speed: At most, of s, per second; a faster one stops first.

        Raises:
            CaregiverError: There is a pose in between, at which the hand must stop first.
        """
        self._lands_at = None
        self._crept = min(self._crept, self.now) if creeps else math.inf
        if self._reach.rests_at(s) and speed == math.inf and not (creeps or self.may_be_off):
            return  # most of the time
        first, last = self.reach_path.span(self.reached, s)
        if last - first > 1:
            raise CaregiverError(
                f"reach must be a pose next to the hand, at {self.reached:.2f}, or short of it, got {s:g}: "
                "stop at every pose on the way"
            )
        limits = self.reach_path.limits(self.reached, s)
        if creeps:
            speed = CREEP / self.reach_path.longest(arm_of(self.robot), 0.0, self.reach_path.goal)
        if abs(self._reach.at(self.now)[1]) > 1.1 * speed:
            self.stop_reaching()
            return
        if creeps or not self.may_be_off:
            slower = speed < limits.velocity
            limits = dataclasses.replace(limits, velocity=speed) if slower else limits
            # One that has been slow goes on faster at once.
            self._reach.set_limits(limits, self.now if limits.velocity > self._reach.limits.velocity else math.inf)
        else:
            share = self._landing if s >= self.reach_path.goal else 1.0
            moves = self._reach.arrival > self.now
            if share < 1.0 and moves and self._reach.target != s:  # it could not slow down to that on the way
                self.stop_reaching()
                self._lands_at = s
                return
            self._reach.set_limits(
                Limits(min(share * limits.velocity, speed), share**2 * limits.acceleration, share**3 * limits.jerk)
            )
        self._reach.move_to(s, self.now)

    def stop_reaching(self) -> None:
        """Stop the hand where it is, until the next `reach`; one at rest has arrived when it came to that."""
        self._lands_at, self._crept = None, math.inf
        if self._reach.arrival > self.now and not self._reach.stops:
            self._reach.run_at(0.0, self.now)

    def grip(self, width: float) -> None:
        """Set how far each finger stands off the middle."""
        limits, closes = self.robot.limits.gripper, width < self.robot.grasp.open
        if closes and self.may_be_off:
            limits = dataclasses.replace(limits, velocity=_GRIPS * limits.velocity)
        self._gripper.set_limits(limits)
        self._gripper.move_to(width, self.now)
        self.limits = self.robot.limits.loaded if closes else self.robot.limits
        self._velocity.limits = self.limits.as_commanded
        if not closes and self._turning is not self.robot.limits.yaw:
            self._turn_within(self.robot.limits.yaw)

    # -- State of the references -----------------------------------------------------------------

    @property
    def may_be_off(self) -> bool:
        """Whether the hand may be off a candle or a table, so that it comes down, and closes, slowly."""
        return self._landing < 1.0

    @property
    def grip_time(self) -> float:
        """Seconds from closing to a grip that holds."""
        return self.robot.grasp.grip_time / (_GRIPS if self.may_be_off else 1.0)

    @property
    def closes(self) -> bool:
        """Whether the fingers are closing, or closed."""
        return self._gripper.target < self.robot.grasp.open

    @property
    def has_given_way(self) -> bool:
        """Whether the arm is not where it reaches to, because it has been pushed away."""
        return self.giving_way.is_off

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
        return self._reach.arrival if self._lands_at is None else math.inf

    @property
    def yaw(self) -> float:
        """The heading's reference now."""
        return self._yaw.at(self.now)[0]

    @property
    def turning(self) -> tuple[float, float]:
        """Velocity, rad/s, and acceleration, rad/s^2, of the heading's reference now."""
        return self._yaw.at(self.now)[1:]

    def turns_to(self, yaw: float) -> bool:
        """Return whether the heading is on its way to this one, or there."""
        return abs(math.remainder(yaw - self._yaw.target, math.tau)) < 1e-6

    def turn_left(self, yaw: float) -> float:
        """Return the seconds until the heading is this one; at most that many if its turn has not begun yet."""
        angle = abs(math.remainder(yaw - self.yaw, math.tau))
        if angle < 1e-3:
            return 0.0
        if self.turns_to(yaw):
            return self._yaw.arrival - self.now
        velocity, acceleration, jerk = dataclasses.astuple(self._yaw.limits)
        return angle / velocity + velocity / acceleration + acceleration / jerk

    # -- Following them --------------------------------------------------------------------------

    def action(
        self, base: Sequence[float], arm: np.ndarray | None = None, restrain: Restrain | None = None
    ) -> np.ndarray:
        """Return the action for the coming control timestep.

        Args:
            base: Measured pose (x, y, yaw) of the base.
            arm: Measured joint positions (joints,), radians; None if they are as commanded.
            restrain: What is left of the base's velocity for the children's sake.

        Returns:
            Base velocities, arm joint targets and gripper target at its end in one array, laid out as the robot's.
        """
        if self._lands_at is not None:
            self.reach(self._lands_at)
        action, layout = self._action, self.robot.layout
        action[layout.base] = self._base_action(base, restrain)
        end = self.now + self._lead
        posture = (self.reach_path, self._reach.at(end)[0])
        if posture != self._posture:
            self._posture = posture
            action[layout.arm] = self.reach_path.joints(posture[1])
        if arm is not None and (self.giving_way.yields or self.has_given_way):
            wanted = self.reach_path.joints(posture[1])
            rested, here = self.now - self._reach.arrival, wanted
            if rested < 0.0:  # at a creep it gives way as it goes: else it would spring back at who steps off
                rested, here = self.now - self._crept, self.reach_path.joints(self.reached)
            self.giving_way.follow(arm, here, rested, self._timestep)
            action[layout.arm] = wanted + self.giving_way.offset
        action[layout.gripper] = self._gripper.at(end)[0]
        return action.copy()

    def _let_go_at(self, position: Vector, moved: float) -> None:
        """Let go of a path off which the base has been led, or on which it is held up, at a speed, m/s.

        It comes to rest from the commanded motion, if it does move so.
        """
        (vx, vy), (ax, ay) = self._velocity.commanded, self._velocity.acceleration
        if moved < _HELD_UP_SHARE * math.hypot(vx, vy):
            vx = vy = ax = ay = 0.0
        lag = self.robot.servos.base_lag  # by which commands are early
        self.let_go(position, (vx - lag * ax, vy - lag * ay), (ax, ay))

    def _base_action(self, base: Sequence[float], restrain: Restrain | None) -> tuple[float, float, float]:
        """Velocities of the base: those of the references with the servos' lag fed forward, and the feedback."""
        servos, now = self.robot.servos, self.now
        (x, y), _, _ = self._base_at(now)
        moved, self._seen_at = math.dist(base[:2], self._seen_at) / self._timestep, (float(base[0]), float(base[1]))
        is_led_off = self.is_driving and not self._is_free
        came_to_rest, self._comes_to_rest = self._comes_to_rest, self.stops and self.is_driving
        if self._comes_to_rest or (came_to_rest and self.stops):  # wherever that is: beside a child nothing leads back
            x, y = self._seen_at
            if not self._comes_to_rest:
                self._hold((x, y))
        elif math.dist((x, y), base[:2]) > (_LED_OFF if is_led_off else _HELD_UP):  # it must find a new way from there
            x, y = self._seen_at
            self._let_go_at((x, y), moved)
        end = now + self._lead
        # The base's lag is fed forward as time: as acceleration, it would make commands jump where that changes.
        _, (vx, vy), _ = self._base_at(end + servos.base_lag)
        yaw = self._yaw.at(now)[0]
        _, yaw_rate, yaw_acceleration = self._yaw.at(end)
        back_x, back_y = self._position_gain * (x - base[0]), self._position_gain * (y - base[1])
        self._feedback = min(self.catch_up, _CATCH_UP_SPEED, self._feedback + _RELEASE * self._timestep)
        most = self._feedback
        if (push := math.hypot(back_x, back_y)) > most:
            back_x, back_y = back_x * most / push, back_y * most / push
        vx, vy = vx + back_x, vy + back_y
        top = self.limits.as_commanded.velocity
        if (speed := math.hypot(vx, vy)) > top:  # held up by something, it must not catch up at any speed
            vx, vy = vx * top / speed, vy * top / speed
        wanted = vx, vy
        left, at_once = restrain(wanted, self._velocity.commanded) if restrain else (wanted, False)
        vx, vy = self._velocity.follow(left, at_once, goes_on=math.dist(left, wanted) < NO_SPEED)
        self._is_free = math.dist((vx, vy), wanted) < NO_SPEED
        # Pushed at its arm, the base has been turned as well.
        released = min(_CATCH_UP_TURN, self._turn_feedback + _RELEASE_TURN * self._timestep)
        released = min(released, _TURN_SHARE * self.catch_up / self.robot.footprint)
        self._turn_feedback = most = _GENTLE_TURN if self.giving_way.yields else released
        back_yaw = min(most, max(-most, self._yaw_gain * (yaw - base[2])))
        # Looked up beyond the next timestep, at which its bound may change, the reference alone may jolt the base.
        turn, _ = self._turn_rate.follow((yaw_rate + servos.yaw_lag * yaw_acceleration + back_yaw, 0.0))
        return vx, vy, turn
