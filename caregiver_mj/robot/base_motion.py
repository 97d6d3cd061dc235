"""The base's reference: a path, played back at the rate that the children allow."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.robot.base_path import BasePath, direction, without_repeats
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.limits import Limits, RobotLimits
from caregiver_mj.robot.scalar_motion import NOTHING, PathError, ScalarMotion

_CORNER_DEVIATIONS = (0.2, 0.12, 0.06)  # m; cuts of a path's corners, the first with room
_CHECK_INTERVAL = 0.08  # s; between points of a path that are checked for room
_LOOKS = 33  # points of a line that are checked for room

_SLOW = 0.3  # m/s; the slower the path, the quicker the rate of playback may change, down to this speed
PLANNED_AHEAD = 0.1  # s; look-ahead of `planned` on the path
_AHEAD = tuple(0.025 * i for i in range(9))  # s; times ahead on the path at which a change of rate must leave room
_LEAST_SHARE = 0.05  # share of the base's acceleration that a change of rate may always use
NO_SPEED = 1e-3  # m/s; a slower base is at rest, and commands that differ by less are the same
_SAME_WAY = math.cos(math.radians(25.0))  # cosine between motion and new path above which the base goes on braking


class BaseMotion:
    """The base's references, present and future.

    Times are in s since the start of the episode, positions in m in the house.

    Attributes:
        now: Present time.
        led_off: Number of paths given up, because the base had left the path or could not stop in time on it.
        drives: Share, 0 to 1, of the planned speed that the skill wants.
        limits: The robot's limits in force; they are lower with something in its hand.
        stops: Whether the base has given up its path and has no new one yet. It then comes to rest as soon as possible,
            whatever its rate.
    """

    now = 0.0
    led_off = 0
    drives = 0.0
    stops = False
    _path: BasePath | None
    _playback: ScalarMotion
    _rate: float  # last requested

    def __init__(self, limits: RobotLimits):
        self.limits = limits
        self._looked_up: tuple[float, tuple[Vector, Vector, Vector]] | None = None  # last time, and motion then

    def drive_along(self, points: Sequence[Vector], is_clear: Callable[[np.ndarray], bool]) -> None:
        """Take a new path, which continues the present motion.

        Args:
            points: Polyline to follow, m.
            is_clear: Returns whether the base has room at points, m, (n, 2). It decides how far corners are cut.

        Raises:
            PathError: The base is too fast to turn into it, has no room to, or is about to come to rest; stop first.
        """
        _, velocity, acceleration = self.base_reference()
        moves = math.hypot(*velocity) > NO_SPEED
        brakes = moves and self._playback.at(self.now)[2] < 0.0 and _leads_on(points, velocity)
        if brakes and self._path is not None:
            _, velocity, acceleration = self._path.at(self._playback.at(self.now)[0])
        # The path has less jerk than a protective stop: with a stop almost over, the base would turn back on it.
        slows = velocity[0] * acceleration[0] + velocity[1] * acceleration[1] < 0.0
        if moves and slows and math.hypot(*acceleration) ** 2 > 2 * self.limits.base.jerk * math.hypot(*velocity):
            raise PathError("the base is about to come to rest")
        for deviation in _CORNER_DEVIATIONS:
            path = BasePath(points, self.limits.base, velocity, acceleration, deviation)
            times = np.arange(0.0, path.duration, _CHECK_INTERVAL).tolist()
            if is_clear(np.array([path.at(time)[0] for time in times]).reshape(-1, 2)):
                break
        else:
            if moves:
                raise PathError("no room to turn into the path")
        self._path, self.stops = path, False
        self._asked = points, is_clear
        self._looked_up = None
        # A braking base goes on braking if the direction is similar: the new path begins with the last path's velocity,
        # at the same rate. Else it begins with the base's velocity, at full rate; from rest, at rate 0 until `set_rate`
        # gives the rate that the children allow.
        if brakes:
            self._playback.begin_anew(self.now)
            return
        self._playback = ScalarMotion(Limits(1.0, 1.0, 1.0), 0.0)  # until its first change: see `_rate_limits`
        self._rate = 1.0 if moves else 0.0
        self._playback.run_at(self._rate, self.now, at_once=True)

    def let_go(self, position: Vector, velocity: Vector, acceleration: Vector) -> None:
        """Give up the path, and come to rest as soon as possible.

        Args:
            position: Position of the base, m.
            velocity: Its velocity, m/s.
            acceleration: Its acceleration, m/s^2.
        """
        self.led_off += 1
        self._hold(position)
        self.stops = True
        if math.hypot(*velocity) > NO_SPEED:
            self._path = BasePath.to_rest(position, velocity, acceleration, self.limits.as_commanded)
            self._playback = ScalarMotion(Limits(1.0, 1.0, 1.0), 0.0)
            self._playback.run_at(1.0, self.now, at_once=True)

    def set_rate(self, rate: float) -> None:
        """Set the rate of playback: the share, 0 to 1, of the planned speed."""
        if self._path is None or self.stops:
            return
        if self._rate == 0.0 and self._playback.at(self.now)[0] < self._path.turned_in:
            self._turn_on_the_spot(self._path)
        if self._rate == 0.0 and self._playback.at(self.now)[:2] == (0.0, 0.0):
            self._rate, self._looked_up = rate, None
            self._playback.run_at(rate, self.now, at_once=True)
        # Solve only for worthwhile changes.
        elif abs(rate - self._rate) > min(0.04, 0.2 * self._rate) or (rate in (0.0, 1.0) and rate != self._rate):
            self._rate = rate
            self._change_rate()
        elif self._playback.arrival > self.now:  # the path may leave the rate more by now, or less
            self._change_rate()

    def _turn_on_the_spot(self, path: BasePath) -> None:
        """Plan a path anew from rest if the base has stopped while turning into it.

        The rest of the turn may lead towards the child that stopped the base, and the base would wait until the child
        leaves.
        """
        if self._playback.arrival > self.now:
            return  # not stopped yet
        (_, *points), is_clear = self._asked
        here = path.at(self._playback.at(self.now)[0])[0]
        if points and is_clear(np.linspace(here, points[0], _LOOKS)):
            self.drive_along([here, *points], is_clear)

    def _change_rate(self) -> None:
        self._looked_up = None
        assert self._path is not None  # only a path has a rate
        self._playback.set_limits(self._rate_limits(self._path))
        # Aim below a falling rate: a gentle approach to each would lag behind.
        too_fast = max(0.0, self._playback.at(self.now)[1] - self._rate)
        self._playback.run_at(max(0.0, self._rate - too_fast), self.now)

    def base_reference(self) -> tuple[Vector, Vector, Vector]:
        """Return the present position, velocity and acceleration of the base's reference."""
        return self._base_at(self.now)

    @property
    def time_left(self) -> float:
        """Time to arrival at full rate, s."""
        if self._path is None:
            return 0.0
        return self._path.duration - self._playback.at(self.now)[0]

    @property
    def is_driving(self) -> bool:
        """Whether the base has a path, even if it waits on it."""
        return self._path is not None

    @property
    def rate(self) -> float:
        """Present rate of playback, 0 to 1; 0 without a path."""
        return 0.0 if self._path is None else self._playback.at(self.now)[1]

    @property
    def moving(self) -> bool:
        """Whether the base's reference moves."""
        return self._path is not None and math.hypot(*self.base_reference()[1]) > NO_SPEED

    def points_ahead(self, seconds: float) -> list[Vector]:
        """Return five points of the path over the coming seconds at full rate, or the position without a path."""
        if self._path is None:
            return [self._here]
        begin = self._playback.at(self.now)[0]
        return [self._path.at(begin + seconds * i / 5)[0] for i in range(1, 6)]

    def planned(self) -> tuple[Vector, Vector]:
        """Return the path's velocity and acceleration at full rate, `PLANNED_AHEAD` from now."""
        if self._path is None:
            return (0.0, 0.0), (0.0, 0.0)
        # At the start of a path from rest both would be zero, without a direction.
        _, velocity, acceleration = self._path.at(self._playback.at(self.now)[0] + PLANNED_AHEAD)
        return velocity, acceleration

    def _base_at(self, time: float) -> tuple[Vector, Vector, Vector]:
        known = self._looked_up
        if known is None or known[0] != time:  # many callers use the same time
            self._looked_up = known = time, self._look_up(time)
        return known[1]

    def _look_up(self, time: float) -> tuple[Vector, Vector, Vector]:
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
        self._looked_up = None

    def _rate_limits(self, path: BasePath) -> Limits:
        """Return bounds of the rate of playback: the part of the base's bounds that the path leaves.

        At a rate r the base's acceleration is r^2 times the path's, plus r' times the path's velocity.
        """
        bounds = self.limits.together
        most = bounds.acceleration
        along, rate, _ = self._playback.at(self.now)
        way = 1.0 if self._rate > rate else -1.0
        left, fastest = 2.0 * most, _SLOW
        for ahead in _AHEAD:
            _, (vx, vy), (ax, ay) = path.at(along + ahead)
            if (speed := math.hypot(vx, vy)) < NOTHING:
                continue
            with_it = rate * rate * (vx * ax + vy * ay) / speed
            across = rate * rate * (vx * ay - vy * ax) / speed
            left = min(left, math.sqrt(max(0.0, most * most - across * across)) - way * with_it)
            fastest = max(fastest, speed)
        return Limits(1.0, max(left, _LEAST_SHARE * most) / fastest, bounds.jerk / fastest)


def _leads_on(points: Sequence[Vector], velocity: Vector) -> bool:
    """Return whether a path begins in a direction similar to a velocity's."""
    here, *rest = without_repeats(points)
    if not rest:
        return False
    (x, y), _ = direction(here, rest[0])
    return x * velocity[0] + y * velocity[1] > _SAME_WAY * math.hypot(*velocity)
