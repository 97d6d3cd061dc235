"""Paths of the hand: from the tucked arm to candles, to small things on the floor, and to the tray."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.robot.geometry import hand_rotation
from caregiver_mj.robot.kinematics import Arm
from caregiver_mj.robot.limits import ArmLimits, Limits
from caregiver_mj.robot.scalar_motion import NOTHING, ScalarMotion, highest

_SLOWEST = 0.25  # poses per second; speed below which a path to a candle on the floor takes too long
_CHECKS = 25  # poses sampled on a line or a path
_SHARES = 33  # places on the path that `as_high` tries
_HOVER = 0.10  # m; height above a lying candle at which the hand stops first
_BEYOND = 0.004  # m; depth below the floor to which the fingertips may feel for it
UP = 1.0  # place of the pose in mid air, on the path to a small thing and on that to the tray
LOW = 0.015  # m; height above the floor at which the fingertips begin to feel for it
_QUICK, _HALVINGS = 0.6, 14  # the same of a path to a small thing or the tray; steps of the search for a height
_UP = 0.42, 0.0, 0.85  # m; pinch point in mid air, above a child's head
_OVER_TRAY = 0.03  # m; height of the fingertips above the tray's walls
TRAY_SPOTS = (0.0, 0.6, -0.6)  # places to let go along the tray, as shares of its half length, so that things fit
_TRAY_PITCHES = np.radians((90, 110, 125, 140)).tolist()  # rad; the hand's there: the tray is near the arm's foot


class ReachPath:
    """A path from the tucked arm (place s = 0) through poses (s = 1, 2, ...): lines in joint space.

    A pose is joint positions (joints,), rad; there are two or more, the tucked arm first. On the lines in `gently` the
    hand is as slow as on the slowest line.

    In the arm's vertical plane the hand's pitch is a signed sum of joint positions, so a line between two poses of
    equal pitch keeps it: a candle stays upright. A line has no curvature, so the joints' limits are bounds of s and its
    derivatives, as long as the hand stops at every pose.

    Attributes:
        goal: s of the last pose.
        returns: Whether the last pose is the tucked arm again.
    """

    def __init__(self, poses: Sequence[np.ndarray], arm: ArmLimits, gently: slice = slice(0)):
        self._poses = np.array(poses)
        self._ways = np.diff(self._poses, axis=0)
        self.goal = len(self._ways)
        self.returns = bool((self._poses[0] == self._poses[-1]).all())
        way = np.abs(self._ways) + 1e-12
        # Joints must be slower nearer to the ends of their ranges, and positions are extreme at the poses.
        ends = np.min([arm.velocity_at(self._poses, sign * np.ones_like(self._poses)) for sign in (1, -1)], axis=0)
        velocity = np.minimum(np.minimum(ends[:-1], ends[1:]) * arm.velocity_share, arm.servo_velocity)
        acceleration, jerk = arm.acceleration * arm.acceleration_share, np.full_like(way, arm.planned_jerk)
        self._limits = np.stack([(most / way).min(axis=1) for most in (velocity, acceleration, jerk)])
        self._limits[:, gently] = self._limits.min(axis=1, keepdims=True)

    def joints(self, s: float) -> np.ndarray:
        """Return the joint positions (joints,) at s, rad."""
        i = min(int(s), self.goal - 1)
        return self._poses[i] + (s - i) * self._ways[i]

    def limits(self, start: float, end: float) -> Limits:
        """Return bounds of s (1/s, ...) under which every joint keeps its limits between two values of s."""
        return Limits(*self._limits[:, slice(*self.span(start, end))].min(axis=1).tolist())

    def seconds(self, speeds: Sequence[float] = ()) -> float:
        """Return the time of the path with a stop at every pose, s; `speeds` bounds that of s on the first lines."""
        motion = ScalarMotion(self.limits(0, 1), 0.0)
        for line in range(self.goal):
            limits = self.limits(line, line + 1)
            motion.set_limits(dataclasses.replace(limits, velocity=min([limits.velocity, *speeds[line : line + 1]])))
            motion.move_to(line + 1.0, motion.arrival)
        return motion.arrival

    def longest(self, arm: Arm, start: float, end: float) -> float:
        """Return the greatest travel of the hand per unit of s on the lines between two values of s, m."""
        first, last = self.span(start, end)
        shares = np.linspace(first, last, _CHECKS * (last - first))
        places = np.array([arm.pinch(self.joints(s)) for s in shares])
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).max() / (shares[1] - shares[0]))

    def span(self, start: float, end: float) -> tuple[int, int]:
        """Return the last pose before, and the first one after, two values of s.

        The limits of the lines between these poses apply. A hand at a pose, up to rounding, counts as on the line that
        it moves along, and on no other.
        """
        first = min(int(min(start, end) + NOTHING), self.goal - 1)
        return first, min(self.goal, max(first + 1, math.ceil(max(start, end) - NOTHING)))


@functools.cache
def reach_path(arm: Arm, height_in_tenths_of_mm: int) -> ReachPath:
    """Return the path to a point as far ahead as the arm reaches, at a height in 0.1 mm, so that paths are shared.

    Raises:
        CaregiverError: The arm cannot reach there.
    """
    robot = arm.embodiment
    goal = arm.solve(robot.postures.reach, height_in_tenths_of_mm * 1e-4, guess=arm.tucked)
    return ReachPath([arm.tucked, goal], robot.limits.arm)


@functools.cache
def as_high(arm: Arm, usual: int, other: int, share: float) -> float:
    """Return the place at which the hand is as high above another goal as above the usual one at the place `share`.

    The heights of both goals are in mm.
    """
    above = arm.pinch(reach_path(arm, 10 * usual).joints(share))[2] - 1e-3 * usual
    path = reach_path(arm, 10 * other)
    shares = np.linspace(share, 0.0, _SHARES)  # the hand only descends as s grows
    return next((float(s) for s in shares if arm.pinch(path.joints(s))[2] - 1e-3 * other >= above), 0.0)


def retrieval_paths(arm: Arm, point: np.ndarray, rotation: np.ndarray, lift: float = 0.0) -> Iterator[ReachPath | None]:
    """Yield paths to a lying candle: to a pose above it, then straight down.

    The hand grips at a point (3,), m, in the base's frame, with a rotation (3, 3), see `hand_rotation`. If `lift` is
    not 0, it passes a pose so much higher, m. Each guess at the joints, slow to solve, yields a path, or None if the
    arm cannot reach from it, would come near the robot itself, or would have to creep. A point too far away yields
    nothing.
    """
    above = np.array([*point[:2], point[2] + _HOVER])
    for guess in guesses(arm, rotation) if arm.may_reach(point, rotation) else ():
        try:
            down = arm.solve_pose(point, rotation, guess)
            over = [arm.solve_pose(above, rotation, down)]
            if lift:
                over.insert(0, arm.solve_pose(above + np.array([0.0, 0.0, lift]), rotation, over[0]))
        except CaregiverError:
            yield None
            continue
        path = ReachPath([arm.tucked, *over, down], arm.embodiment.limits.arm)
        # Near the end of a joint's range the arm would creep for minutes.
        quick = path.limits(0, path.goal).velocity > _SLOWEST
        clear = quick and all(arm.clears_itself(path.joints(s)) for s in np.linspace(path.goal, 0.0, _CHECKS))
        yield path if clear else None


@functools.cache
def pick_up_path(arm: Arm, ahead: float, heading: float) -> ReachPath | None:
    """Return the quickest path of the fingertips down to a small thing, and on until they touch the floor.

    Its poses are in mid air (1), and with the fingertips just below the floor (2). The thing lies `ahead` m in front of
    the base's middle; the fingers open across the `heading`, rad. Return None if the arm meets robot or tray on every
    path.
    """
    hand = np.array([ahead, 0.0, arm.embodiment.fingertip - _BEYOND]), hand_rotation(heading, math.pi / 2)
    ways = _ways(arm, tray_path(arm).joints(UP), *hand) if arm.may_reach(*hand) else ()
    return min(ways, key=ReachPath.seconds, default=None)


def share_at(arm: Arm, path: ReachPath, height: float) -> float:
    """Return the place on a `pick_up_path` at which the fingertips descend to a height above the floor, m."""

    def is_above(share: float) -> bool:
        return bool(arm.pinch(path.joints(share))[2] - arm.embodiment.fingertip > height)

    return highest(is_above, UP, float(path.goal), _HALVINGS)


@functools.cache
def tray_path(arm: Arm, spot: float = 0.0) -> ReachPath:
    """Return the path through the same pose in mid air (1) to one above the tray (2), where the hand lets go.

    The spot is one of `TRAY_SPOTS`. The hand turns little on the path, for a thing between fingertips slips in turns.

    Raises:
        CaregiverError: The robot has no tray, or its arm cannot get there.
    """
    robot, down = arm.embodiment, math.pi / 2
    if robot.tray is not None:
        over = robot.tray.along(spot) + np.array([0.0, 0.0, robot.tray.half[2] + robot.fingertip + _OVER_TRAY])
        up = arm.solve_nearest(np.array(_UP), hand_rotation(0.0, down), guesses(arm, hand_rotation(0.0, down)))
        for heading, pitch in itertools.product((0.0, down, -down), _TRAY_PITCHES):
            if ways := _ways(arm, up, over, hand_rotation(heading, pitch)):
                return min(ways, key=ReachPath.seconds)
    raise CaregiverError(f"robot '{robot.name}' must have a tray within its arm's reach to pick up small things")


def _ways(arm: Arm, up: np.ndarray, place: np.ndarray, rotation: np.ndarray) -> list[ReachPath]:
    """Return quick paths through a pose in mid air to one of the hand, clear of robot and tray."""
    found = []
    for guess in (up, *guesses(arm, rotation)):
        try:
            path = ReachPath([arm.tucked, up, arm.solve_pose(place, rotation, guess)], arm.embodiment.limits.arm)
        except CaregiverError:
            continue
        shares, quick = np.linspace(path.goal, 0.0, _CHECKS * path.goal), path.limits(0, path.goal).velocity > _QUICK
        if quick and all(arm.clears_itself(path.joints(s), tray=True) for s in shares):
            found.append(path)
    return found


def guesses(arm: Arm, rotation: np.ndarray) -> list[np.ndarray]:
    """Return joint positions to start a search for the hand's rotation from, (joints,), rad each."""
    bends = arm.embodiment.bends
    heading = math.atan2(rotation[0, 1], -rotation[1, 1])
    guesses = []
    # The wrist's bends, the usual one first, and turns of the hand.
    for bend, turn in itertools.product(bends.bends, (heading, -heading, 0.0)):
        more = np.zeros(len(arm.tucked))
        more[bends.bend], more[bends.turn] = bend, turn
        guesses.append((arm.tucked + more).clip(*arm.ranges))
    return guesses
