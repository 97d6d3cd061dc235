"""The robot's references and the actions that follow them: base path, heading, arm and gripper.

Skills set goals here; once a control step `RobotMotion.action` samples all references and adds the feedback.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot.base_motion import NO_SPEED, BaseMotion
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.feedback import FollowedVelocity, GivingWay, shortened
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.limits import CREEP, Limits
from caregiver_mj.robot.reach import ReachPath, reach_path
from caregiver_mj.robot.scalar_motion import ScalarMotion

_LEAST_TURN = 0.03  # rad/s; least bound of the base's turns
_GENTLE_TURN = 0.02  # rad/s; greatest feedback of the heading with a child at the arm
_CATCH_UP_SPEED = 0.3  # m/s; greatest feedback of the base, which an obstacle may release suddenly
_RELEASE = 0.4  # m/s^2; increase of that bound after a child has lowered it
# The same of the heading, which a push at the arm turns: rad/s, rad/s^2. Share of `catch_up` for the turn of the base's
# surface: with a creep along a child, the sum stays below a strike.
_CATCH_UP_TURN, _RELEASE_TURN, _TURN_SHARE = 0.5, 1.0, 1 / 3
_MOST_LATE = 0.5  # greatest gain times delay of feedback; above, it oscillates (without end from pi / 2)
_JOLTS = 4.0  # m/s^3; one sigma of the jerk by which feedback answers position noise
_HELD_UP = 0.15  # m; deviation from the reference beyond which something holds the base up
_HELD_UP_SHARE = 0.5  # share of the commanded speed below which something is in the base's way
_LED_OFF = 0.05  # m; the same deviation of a base commanded off its path, which has room only so near to it

# Delay of the actuators beyond the control timestep, as a share of it: smoothing commands over its four physics steps
# (`caregiver_mj.house.robot_body`) costs one and a half.
_SMOOTHING = 3 / 8

# By the error of their positions, the hand meets a candle, or a candle in it the table, before the end of its path. At
# this share of its speed, over the root of two sigmas, m^0.5, it keeps its limits nevertheless.
_LANDS = 0.023
_GRIPS = 0.5  # share of the fingers' speed with such an error: one may meet the candle before the other

_ANY_HEIGHT = 7000  # 0.1 mm; height until `plan_reach` sets it: all reaches begin with the tucked arm

#: Takes the wanted and the last commanded velocity of the base, m/s; returns the allowed one, and whether to brake to
#: it at once.
Restrain = Callable[[Vector, Vector], tuple[Vector, bool]]


class RobotMotion(BaseMotion):
    """The robot's references, present and future.

    Times are in s since the start of the episode, positions in m in the house, angles in rad.

    Attributes:
        robot: The robot.
        catch_up: Greatest speed, m/s, of the base's return to a reference that it was pushed off: a child may be in
            between. It bounds the turn of the base's edge, too.
        reach_path: Path of the hand.
        giving_way: Compliance of the arm to a child's push.
    """

    def __init__(
        self,
        robot: Embodiment,
        control_timestep: float,
        delay: float = 0.0,
        hand_error: float = 0.0,
        base_jumps: float = 0.0,
    ):
        """Prepare the references.

        Args:
            robot: The robot.
            control_timestep: Time between actions, s.
            delay: Delay of the base's measured position, s.
            hand_error: Error of the hand's position relative to a candle or a table, one sigma, m.
            base_jumps: Noise of the base's measured position between control steps, one sigma, m.
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
            base: Pose (x, y, yaw) of the base, m and rad.
        """
        limits = self.robot.limits
        self.now = 0.0
        self.catch_up, self.drives = _CATCH_UP_SPEED, 0.0
        self.giving_way = GivingWay(len(arm_of(self.robot).tucked))
        self._feedback, self._turn_feedback = _CATCH_UP_SPEED, _CATCH_UP_TURN
        self._seen_at = float(base[0]), float(base[1])
        self.led_off, self.stops, self._comes_to_rest = 0, False, False
        self._is_free = True  # whether the command follows the references, unbounded
        self.limits = limits
        self._velocity = FollowedVelocity(limits.as_commanded, self._timestep)
        self._turn_rate = FollowedVelocity(limits.turn_as_commanded, self._timestep)
        self._hold((float(base[0]), float(base[1])))
        self._turning, self._turn_bound = limits.yaw, math.inf  # rad/s; lower near children
        self._yaw = ScalarMotion(limits.yaw, float(base[2]), brakes=True)
        self.reach_path = reach_path(arm_of(self.robot), _ANY_HEIGHT)
        self._reach = ScalarMotion(self.reach_path.limits(0, 0), 0.0)
        self._lands_at: float | None = None  # place on the path to approach slowly, once the hand has stopped
        self._crept = math.inf  # time at which it began to creep
        self._gripper = ScalarMotion(limits.gripper, self.robot.grasp.open)
        self._action = np.empty(self.robot.layout.size)
        self._posture: tuple[ReachPath, float] | None = None  # path and place on it in the last action

    # -- Goals -----------------------------------------------------------------------------------

    def turn_to(self, yaw: float) -> None:
        """Turn to a heading, the shorter way round."""
        here = self._yaw.at(self.now)[0]
        self._yaw.move_to(here + math.remainder(yaw - here, math.tau), self.now)

    def stop_turning(self) -> None:
        """Stop turning as soon as possible, until the next `turn_to`."""
        self._yaw.stop(self.now)

    def turn_gently(self, rate: float = math.inf) -> None:
        """Limit turns from the next goal until the gripper opens: a candle slips in the hand.

        Args:
            rate: Greatest rate, rad/s, for something that slips sooner; until then it only falls.
        """
        gentle = self.robot.limits.yaw_gentle
        limits = dataclasses.replace(gentle, velocity=min(rate, gentle.velocity, self._turning.velocity))
        if limits != self._turning:
            self._turn_within(limits)

    def bound_turning(self, rate: float) -> None:
        """Limit the present rate of turns near a child, rad/s."""
        full, present = self._turning.velocity, self._yaw.limits.velocity
        rate = min(full, max(rate, _LEAST_TURN))
        if rate == present:  # the usual case
            return
        # Solve only for worthwhile changes. A turn that slows down continues to until there is room again.
        speed, acceleration = self.turning
        turns = abs(speed)
        most = max(present, turns)
        # While a turn above its bound accelerates, keep the bound: beside a child it would alternate at every timestep.
        may_speed_up = rate > most and (turns <= present or speed * acceleration <= 0.0)
        if rate < 0.9 * present or (may_speed_up and (rate == full or rate > 1.3 * most)):
            within = turns if turns <= rate else _LEAST_TURN  # just below its speed, the solver would nearly stop
            self._turn_bound = math.inf if rate == full else max(0.9 * rate, within)
            self._turn_within(self._turning)
            self._yaw.set_limits(self._yaw.limits, self.now)

    def _turn_within(self, limits: Limits) -> None:
        """Set the limits of turns from the next goal on, within the present bound."""
        self._turning = limits
        self._yaw.set_limits(dataclasses.replace(limits, velocity=min(limits.velocity, self._turn_bound)))

    def plan_reach(self, height: float) -> None:
        """Set the height of the next reach, m above the floor."""
        self.reach_along(reach_path(arm_of(self.robot), round(1e4 * height)))

    def reach_along(self, path: ReachPath) -> None:
        """Set the arm's path for its next motion; the arm must be tucked, or in a pose common to both paths."""
        if self.reach_path.returns and self.reached == self.reach_path.goal:
            self._reach = ScalarMotion(self._reach.limits, 0.0)
        self.reach_path = path
        self._reach.set_limits(path.limits(self.reached, self.reached))

    def reach(self, s: float, creeps: bool = False, speed: float = math.inf) -> None:
        """Move the hand to a place on its path.

        Args:
            s: Place on the path: 0 tucked, 1 at its first pose, and so on.
            creeps: Whether the hand stays slower than a strike.
            speed: Greatest speed of s, 1/s; a faster motion stops first.

        Raises:
            CaregiverError: A pose lies in between; the hand must stop there first.
        """
        self._lands_at = None
        self._crept = min(self._crept, self.now) if creeps else math.inf
        if self._reach.rests_at(s, self.now) and speed == math.inf and not (creeps or self.may_be_off):
            return  # the usual case
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
            # A slow motion speeds up at once.
            self._reach.set_limits(limits, self.now if limits.velocity > self._reach.limits.velocity else math.inf)
        else:
            share = self._landing if s >= self.reach_path.goal else 1.0
            moves = self._reach.arrival > self.now
            if share < 1.0 and moves and self._reach.target != s:  # it cannot slow down to that on the way
                self.stop_reaching()
                self._lands_at = s
                return
            self._reach.set_limits(
                Limits(min(share * limits.velocity, speed), share**2 * limits.acceleration, share**3 * limits.jerk)
            )
        self._reach.move_to(s, self.now)

    def stop_reaching(self) -> None:
        """Stop the hand until the next `reach`; one at rest keeps its time of arrival."""
        self._lands_at, self._crept = None, math.inf
        if self._reach.arrival > self.now and not self._reach.stops:
            self._reach.run_at(0.0, self.now)

    def grip(self, width: float) -> None:
        """Move each finger to a distance from the middle, m."""
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
        """Whether the hand's position may be wrong, so that it lands and closes slowly."""
        return self._landing < 1.0

    @property
    def grip_time(self) -> float:
        """Time from closing to a firm grip, s."""
        return self.robot.grasp.grip_time / (_GRIPS if self.may_be_off else 1.0)

    @property
    def closes(self) -> bool:
        """Whether the fingers close, or are closed."""
        return self._gripper.target < self.robot.grasp.open

    @property
    def reached(self) -> float:
        """Present place `s` of the hand on its path, see `reach`."""
        return self._reach.at(self.now)[0]

    @property
    def hand_out(self) -> float:
        """Greatest place `s` in the present motion if the hand extends, else the present one."""
        position, velocity, _ = self._reach.at(self.now)
        return self._reach.highest() if velocity > 0.0 else position

    @property
    def reach_arrival(self) -> float:
        """Time at which the hand's motion ends."""
        return self._reach.arrival if self._lands_at is None else math.inf

    @property
    def yaw(self) -> float:
        """Present reference of the heading."""
        return self._yaw.at(self.now)[0]

    @property
    def turning(self) -> tuple[float, float]:
        """Present velocity, rad/s, and acceleration, rad/s^2, of the heading's reference."""
        return self._yaw.at(self.now)[1:]

    def turns_to(self, yaw: float) -> bool:
        """Return whether a heading is the goal of the present or last turn."""
        return abs(math.remainder(yaw - self._yaw.target, math.tau)) < 1e-6

    def turn_left(self, yaw: float) -> float:
        """Return the time until a heading is reached, s; an upper bound before its turn has begun."""
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
        """Return the action for the coming control step.

        Args:
            base: Measured pose (x, y, yaw) of the base, m and rad.
            arm: Measured joint positions (joints,), rad; None if they are as commanded.
            restrain: Bounds the base's velocity near children; None for no bound.

        Returns:
            Base velocities, and arm joint and gripper targets for the end of the timestep, in the robot's layout.
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
        if arm is not None and (self.giving_way.yields or self.giving_way.is_off):
            wanted = self.reach_path.joints(posture[1])
            rested, here = self.now - self._reach.arrival, wanted
            if rested < 0.0:  # a creeping arm yields, too: else it would spring back at a child that steps off
                rested, here = self.now - self._crept, self.reach_path.joints(self.reached)
            self.giving_way.follow(arm, here, rested, self._timestep)
            action[layout.arm] = wanted + self.giving_way.offset
        action[layout.gripper] = self._gripper.at(end)[0]
        return action.copy()

    def _let_go_at(self, position: Vector, moved: float) -> None:
        """Give up the path of a base that has left it, or is held up on it, and `moved` at a speed, m/s.

        The base comes to rest from the commanded motion, or from standstill if it is held up.
        """
        (vx, vy), (ax, ay) = self._velocity.commanded, self._velocity.acceleration
        if moved < _HELD_UP_SHARE * math.hypot(vx, vy):
            vx = vy = ax = ay = 0.0
        lag = self.robot.servos.base_lag  # s; commands are early by it
        self.let_go(position, (vx - lag * ax, vy - lag * ay), (ax, ay))

    def _base_action(self, base: Sequence[float], restrain: Restrain | None) -> tuple[float, float, float]:
        """Return the base's velocities: the references' with the servos' lag fed forward, and the feedback."""
        servos, now = self.robot.servos, self.now
        (x, y), _, _ = self._base_at(now)
        before, here = self._seen_at, (float(base[0]), float(base[1]))
        self._seen_at = here
        is_led_off = self.is_driving and not self._is_free
        came_to_rest, self._comes_to_rest = self._comes_to_rest, self.stops and self.is_driving
        if self._comes_to_rest or (came_to_rest and self.stops):  # in any place: beside a child nothing leads back
            x, y = here
            if not self._comes_to_rest:
                self._hold(here)
        elif math.dist((x, y), here) > (_LED_OFF if is_led_off else _HELD_UP):  # it must plan anew from there
            x, y = here
            self._let_go_at(here, math.dist(here, before) / self._timestep)
        end = now + self._lead
        # Feed the base's lag forward as time: as acceleration, commands would jump with it.
        _, (vx, vy), _ = self._base_at(end + servos.base_lag)
        yaw = self._yaw.at(now)[0]
        _, yaw_rate, yaw_acceleration = self._yaw.at(end)
        self._feedback = min(self.catch_up, _CATCH_UP_SPEED, self._feedback + _RELEASE * self._timestep)
        gain = self._position_gain
        back_x, back_y = shortened(self._feedback, gain * (x - here[0]), gain * (y - here[1]))
        wanted = shortened(self.limits.as_commanded.velocity, vx + back_x, vy + back_y)
        left, at_once = restrain(wanted, self._velocity.commanded) if restrain else (wanted, False)
        vx, vy = self._velocity.follow(left, at_once, goes_on=math.dist(left, wanted) < NO_SPEED)
        self._is_free = math.dist((vx, vy), wanted) < NO_SPEED
        # A push at the arm turns the base as well.
        released = min(_CATCH_UP_TURN, self._turn_feedback + _RELEASE_TURN * self._timestep)
        released = min(released, _TURN_SHARE * self.catch_up / self.robot.footprint)
        self._turn_feedback = most = _GENTLE_TURN if self.giving_way.yields else released
        back_yaw = min(most, max(-most, self._yaw_gain * (yaw - base[2])))
        # The reference is sampled beyond the next timestep, at which its bound may change: alone, it may jolt the base.
        turn, _ = self._turn_rate.follow((yaw_rate + servos.yaw_lag * yaw_acceleration + back_yaw, 0.0))
        return vx, vy, turn
