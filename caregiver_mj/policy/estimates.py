"""Estimates of the present state from delayed, noisy and incomplete observations, as `Sensing` describes them.

They assume the robot to follow its references, an untouched candle to rest, one in the hand to move with it, and
children to keep their velocity.
"""

from __future__ import annotations

import collections
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.children.walk import BUMP_SPEED
from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.sensing import Blur, Sensing
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.layout import CANDLE_RADIUS, Thing
from caregiver_mj.robot import geometry
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.kinematics import arm_of, is_round
from caregiver_mj.robot.motion import RobotMotion

_SIGMAS = 2.0  # standard deviations of error that safety distances include
_SIGMAS_BESIDE = 2.5  # standard deviations of error that must fit beside a candle in the open hand
Observation = dict[str, np.ndarray]
Posture = tuple[np.ndarray, np.ndarray]  # pose of the base (3,), joint positions (joints,)
_JUMP = 0.05  # m; a reference that moves farther in a control step was reset
_STEADY = 0.002, 0.004  # m, rad; new deviation of the base from its reference in a control step
_SLOWEST = 0.08  # least weight of a new measurement
_UNSTEADY = 0.005  # m; error of a child's predicted position after a control step
_STARTS = 0.05  # m/s; change of a child's velocity in a control step
_LOST = 0.3  # m; prediction error beyond which the estimate restarts at the measurement
_MOST = 50  # most sightings in the mean of a candle at rest
_AFTER_TOUCH = 3  # sightings that count in the mean after a touch; more, and it would keep the old place
_LATEST = 0.25  # weight of a sighting in the fast mean, which detects that a candle was moved
_MOVED, _MOVED_SIGMAS = 0.004, 1.8  # m, and standard deviations; greatest distance of both means at rest
_TILTED, _TILTED_SIGMAS = 0.1, 3.0  # rad, and standard deviations; greatest angle between them
_SLIPS = 0.001  # m; slip of a candle in the hand in a control step
_KEPT = 0.3, 0.002  # standard deviations, and m; smallest change of an estimate that is published
_NEAR = 0.25  # m; distance within which the opening hand may have touched a thing


def hand_error(sensing: Sensing, robot: Embodiment, things: Sequence[Thing]) -> float:
    """Return the error of the hand relative to the thing to grasp, one sigma along each axis, m; 0 if sensing is exact.

    Raises:
        CaregiverError: The error is too large to grasp a candle.
    """
    candle, base = sensing.candle, sensing.base
    turn = robot.postures.reach * math.hypot(base.turn_bias, _error(base.turn_noise, _STEADY[1]))
    error = math.hypot(candle.bias, _error(candle.noise, _SLIPS), base.bias, _error(base.noise, _STEADY[0]), turn)
    room = min((robot.grasp.opened(thing) - thing.radius for thing in things), default=robot.grasp.open - CANDLE_RADIUS)
    most = room / _SIGMAS_BESIDE
    if error > most:
        raise CaregiverError(
            f"sensing must show {robot.name} a candle within {1e3 * most:.1f} mm (one sigma) of its place beside the "
            f"hand, got {1e3 * error:.1f} mm"
        )
    return error


class Senses:
    """Estimates of all observations.

    Attributes:
        age: Delay of observations, s.
        candle_noise: White noise of a candle's place, m, one sigma.
    """

    def __init__(
        self,
        sensing: Sensing,
        robot: RobotMotion,
        control_timestep: float,
        things: Sequence[Thing],
        haste: float = 1.0,
    ):
        self._sensing, self._robot, self._timestep, self._things = sensing, robot, control_timestep, things
        self._comes = haste * BUMP_SPEED  # m/s; a child's speed of approach
        self._steps = sensing.delay_steps(control_timestep)
        self.age, self.candle_noise = self._steps * control_timestep, sensing.candle.noise

    @property
    def unsure(self) -> float:
        """Distance by which a child may be nearer than estimated, m."""
        child, base = self._sensing.child, self._sensing.base
        # A child may have stopped, or turned, during the delay.
        late = self.age + sum(self._timestep * blur.dropout / (1.0 - blur.dropout) for blur in (child, base))
        lasting = math.hypot(child.bias, base.bias)
        white = _error(child.noise, _UNSTEADY), _error(base.noise, _STEADY[0])
        return late * self._comes + _SIGMAS * math.hypot(lasting, *white)

    def reset(self) -> None:
        """Begin an episode, after the reset of the robot's references."""
        self._self = SelfEstimate(self._sensing.base, self._robot, self._steps)
        self._candles, self._batteries = (
            CandleEstimates(self._sensing.candle, self._robot.robot, things) for things in (self._things, ())
        )
        self._children = ChildEstimates(self._sensing.child, self._timestep, self.age)

    def now(self, observation: Observation) -> Observation:
        """Return the observation that is expected at present, given the last one."""
        then, now = self._self.update(observation["base_position"], observation["arm_position"])
        estimate = dict(observation)
        estimate["base_position"], estimate["arm_position"] = now
        position, velocity = self._children.update(observation["toddler_position"], observation["toddler_velocity"])
        estimate["toddler_position"], estimate["toddler_velocity"] = position, velocity
        if "candle_position" in observation:
            fingers = float(observation["finger_position"].sum())
            poses = observation["candle_position"], observation["candle_orientation"]
            estimate["candle_position"], estimate["candle_orientation"] = self._candles.update(
                *poses, fingers, then, now
            )
        if "battery_position" in observation:
            places = observation["battery_position"]
            upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1))
            estimate["battery_position"], _ = self._batteries.update(places, upright, math.inf, then, now)
        return estimate


def gain(noise: float, change: float) -> float:
    """Return a filter's gain, given the white noise of a measurement and the change between two, in one unit."""
    return max(_SLOWEST, change / (change + noise))


def _error(noise: float, change: float) -> float:
    """Return the standard deviation of the estimate of a filter with this gain."""
    share = gain(noise, change)
    return noise * math.sqrt(share / (2.0 - share))


def base_jumps(blur: Blur) -> float:
    """Return the standard deviation of the change of the base's estimate by noise in a control step, m."""
    return blur.noise * gain(blur.noise, _STEADY[0])


class SelfEstimate:
    """Estimate of the robot's posture: its references plus a filtered deviation."""

    def __init__(self, blur: Blur, robot: RobotMotion, delay_steps: int):
        self._robot, self._blur = robot, blur
        place, turn = _STEADY
        self._gains = np.array([gain(blur.noise, place)] * 2 + [gain(blur.turn_noise, turn)])
        self._path = np.zeros(3)  # the base's reference without its jumps
        self._before: np.ndarray | None = None
        self._off: np.ndarray | None = None
        self._seen: np.ndarray | None = None
        self._history: collections.deque[Posture] = collections.deque(maxlen=delay_steps + 1)

    def update(self, base: np.ndarray, arm: np.ndarray) -> tuple[Posture, Posture]:
        """Update by the measured, delayed pose of the base (3,) and joint positions (joints,).

        Returns:
            The posture at the time of the measurement, and the present one.
        """
        self._history.append(self._reference())
        (path_then, arm_then), (path_now, arm_now) = self._history[0], self._history[-1]
        if self._off is None:
            self._off = base - path_then
        elif self._seen is None or not (self._blur.dropout and np.array_equal(base, self._seen)):  # else a dropout
            self._off = self._off + self._gains * (base - path_then - self._off)
        self._seen = base
        return (path_then + self._off, arm), (path_now + self._off, arm + (arm_now - arm_then))

    def _reference(self) -> Posture:
        robot = self._robot
        here = np.array([*robot.base_reference()[0], robot.yaw])
        if self._before is not None and math.dist(here[:2], self._before[:2]) < _JUMP:
            self._path = self._path + (here - self._before)
        self._before = here
        return self._path, robot.reach_path.joints(robot.reached)


class ChildEstimates:
    """Estimates of the children's poses: predicted with constant velocity, corrected by measurements."""

    def __init__(self, blur: Blur, timestep: float, age: float):
        self._gain, self._velocity_gain = gain(blur.noise, _UNSTEADY), gain(blur.velocity_noise, _STARTS)
        self._timestep, self._age = timestep, age
        self._position: np.ndarray | None = None
        self._velocity: np.ndarray | None = None
        self._seen: np.ndarray | None = None  # poses and velocities

    def update(self, poses: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Update by measured poses x, y, yaw (..., 3) and velocities (..., 3); return the present ones."""
        seen = np.concatenate([poses, velocities], axis=-1)
        if self._position is None:
            self._position, self._velocity = poses.copy(), velocities.copy()
        else:
            new = (seen != self._seen).any(axis=-1, keepdims=True)  # else a dropout
            self._velocity = self._velocity + new * self._velocity_gain * (velocities - self._velocity)
            expected = self._position + self._timestep * self._velocity
            off = poses - expected
            lost = np.linalg.norm(off[..., :2], axis=-1, keepdims=True) > _LOST
            self._position = expected + new * np.where(lost, 1.0, self._gain) * off
            self._position[..., 2] = poses[..., 2]
        self._seen = seen
        now = self._position.copy()
        now[..., :2] += self._age * self._velocity[..., :2]
        return now, self._velocity


class CandleEstimates:
    """Estimates of the poses of all candles."""

    def __init__(self, blur: Blur, robot: Embodiment, things: Sequence[Thing]):
        self._blur, self._arm, self._things = blur, arm_of(robot), things
        self._keeps = max(_KEPT[0] * blur.noise, _KEPT[1]) if blur.noise else 0.0
        self._published: np.ndarray | None = None  # published positions, (candles, 3)
        self._held = NOTHING
        self._in_hand = self._in_hand_published = np.zeros(3)  # offset from the pinch point, base frame

    def update(
        self, positions: np.ndarray, orientations: np.ndarray, fingers: float, then: Posture, now: Posture
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the present positions, (candles, 3), and quaternions, (candles, 4), from measured ones.

        `fingers` is the opening of the hand, m; `then` is the robot's posture at the time of the measurement.
        """
        if self._published is None:
            published = self._published = positions.copy()
            self._begin(positions, orientations)
        else:
            published = self._published
            self._average(published, positions, orientations)
        self._follow_hand(published, positions, fingers, then)
        self._seen = positions
        places = published.copy()
        if self._held != NOTHING:
            places[self._held] = self._to_house(self._in_hand_published, now)
        return places, self._turned

    def _begin(self, positions: np.ndarray, orientations: np.ndarray) -> None:
        self._mean, self._latest = positions.copy(), positions.copy()
        self._turned, self._latest_turned = orientations.copy(), orientations.copy()
        self._count = np.ones(len(positions))

    def _average(self, published: np.ndarray, positions: np.ndarray, orientations: np.ndarray) -> None:
        """Update the means of all candles, as if none were held."""
        blur = self._blur
        new = (positions != self._seen).any(axis=1) if blur.dropout else np.ones(len(positions), bool)
        latest = _LATEST if blur.noise else 1.0
        self._latest = self._latest + np.where(new, latest, 0.0)[:, None] * (positions - self._latest)
        latest_turned = _LATEST if blur.turn_noise else 1.0
        self._latest_turned = _mixed(self._latest_turned, orientations, np.where(new, latest_turned, 0.0))
        off = np.linalg.norm(self._latest - self._mean, axis=1)
        moved = off > (_MOVED + _MOVED_SIGMAS * blur.noise if blur.noise else 0.0)
        angle = 2 * np.arccos(np.abs((self._latest_turned * self._turned).sum(axis=1)).clip(0.0, 1.0))
        moved |= angle > _TILTED + _TILTED_SIGMAS * blur.turn_noise
        self._count = np.where(moved, 1 / latest, np.minimum(self._count + new, _MOST))
        share = np.where(new, 1 / self._count, 0.0)
        self._mean = self._mean + share[:, None] * (positions - self._mean)
        self._turned = _mixed(self._turned, orientations, share if blur.turn_noise else np.where(new, 1.0, 0.0))
        self._mean[moved], self._turned[moved] = self._latest[moved], self._latest_turned[moved]
        tell = moved | (np.linalg.norm(self._mean - published, axis=1) > self._keeps)
        published[tell] = self._mean[tell]

    def _follow_hand(self, published: np.ndarray, positions: np.ndarray, fingers: float, then: Posture) -> None:
        """Update the candle in the hand, and its offset there. Without candles, as for batteries, nothing is held."""
        if not self._things:
            return
        if self._held != NOTHING and not is_round(self._things[self._held], fingers):
            self._let_go(published, then)
            return
        if self._held == NOTHING:
            distances = np.linalg.norm(published - self._to_house(np.zeros(3), then), axis=1)
            nearest = int(distances.argmin())
            if is_round(self._things[nearest], fingers) and distances[nearest] < self._things[nearest].height:
                self._held = nearest
                self._in_hand = self._in_hand_published = self._to_hand(published[nearest], then)
        elif not (self._blur.dropout and np.array_equal(positions[self._held], self._seen[self._held])):
            off = self._to_hand(positions[self._held], then) - self._in_hand
            self._in_hand = self._in_hand + gain(self._blur.noise, _SLIPS) * off
            if math.dist(self._in_hand, self._in_hand_published) > self._keeps:
                self._in_hand_published = self._in_hand

    def _let_go(self, published: np.ndarray, then: Posture) -> None:
        """Place the candle where the hand opened; things nearby may have been touched."""
        here = self._to_house(self._in_hand, then)
        near = np.linalg.norm(published - here, axis=1) < _NEAR
        self._mean[self._held] = self._latest[self._held] = published[self._held] = here
        near[self._held] = True
        self._count[near] = np.minimum(self._count[near], _AFTER_TOUCH)
        self._held = NOTHING

    def _to_house(self, offset: np.ndarray, posture: Posture) -> np.ndarray:
        """Return a point (3,) in the house's frame, given its offset from the pinch point in the base's frame."""
        base, arm = posture
        x, y, z = (self._arm.pinch(arm) + offset).tolist()
        return np.array([*geometry.to_world(tuple(base.tolist()), (x, y)), z])

    def _to_hand(self, point: np.ndarray, posture: Posture) -> np.ndarray:
        """Return the inverse of `_to_house`."""
        base, arm = posture
        ahead, aside = geometry.to_local(tuple(base.tolist()), (float(point[0]), float(point[1])))
        return np.array([ahead, aside, point[2]]) - self._arm.pinch(arm)


def _mixed(quaternions: np.ndarray, others: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return weighted means of pairs of similar quaternions, (n, 4); the others have weights `share`, (n,)."""
    opposite = (quaternions * others).sum(axis=1, keepdims=True) < 0.0
    mixed = quaternions + share[:, None] * (np.where(opposite, -others, others) - quaternions)
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
