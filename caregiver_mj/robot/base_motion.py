"""The base's reference: a path, played back as fast as the child allows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from caregiver_mj.robot.base_path import BasePath, direction, without_repeats
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.limits import Limits, RobotLimits
from caregiver_mj.robot.scalar_motion import NOTHING, PathError, ScalarMotion

_CORNER_DEVIATIONS = (0.2, 0.12, 0.06)  # metres by which corners of a path are cut, if there is room
_CHECK_INTERVAL = 0.08  # seconds between the points of a path that are checked for room
_LOOKS = 33  # points of a line that are checked for room

# The path is played back at a rate of 0 to 1, to slow down on it. The slower the path itself is, the quicker the rate
# may change; below this speed it makes no difference any more.
_SLOW = 0.3  # m/s
PLANNED_AHEAD = 0.1  # seconds on the path at which `planned` looks
_AHEAD = tuple(0.025 * i for i in range(9))  # seconds on the path for which a change of rate must leave room
_LEAST_SHARE = 0.05  # of the base's acceleration, a change of rate may always have
NO_SPEED = 1e-3  # m/s that are none: a slower base is at rest, and commands that differ by less are the same
_SAME_WAY = math.cos(math.radians(25.0))  # of the angle between motion and new path, for the base to go on as it does


class BaseMotion:
    """References of the base, now and in future.

    Times are seconds since the start of the episode, positions metres in the house.

    Attributes:
        now: The present time.
        led_off: How often the base has given its path up: it had been led off it, or could not stop in time on it.
        drives: The share, 0 to 1, of its planned speed at which its skill wants it to drive.
        limits: Those of the robot that are in force: with something in its hand they are lower.
        stops: Whether it has given its path up and has no new one yet. It then comes to rest as soon as it can,
            whatever rate it is asked for.
    """

    now = 0.0
    led_off = 0
    drives = 0.0
    stops = False
    _path: BasePath | None
    _playback: ScalarMotion
    _rate: float  # that was asked for last

    def __init__(self, limits: RobotLimits):
        self.limits = limits  # that are in force
        self._looked_up: tuple[float, tuple[Vector, Vector, Vector]] | None = None  # the last moment, and its motion

    def drive_along(self, points: Sequence[Vector], is_clear: Callable[[np.ndarray], bool]) -> None:
        """Take a new path, from the motion that is under way now.

        Args:
            points: Polyline to follow.
            is_clear: Tells whether the base has room at points (n, 2). Corners are cut as long as it does.

        Raises:
            PathError: The base is too fast to turn into it, has no room to, or is about to come to rest; stop first.
        """
        _, velocity, acceleration = self.base_reference()
        moves = math.hypot(*velocity) > NO_SPEED
        brakes = moves and self._playback.at(self.now)[2] < 0.0 and _leads_on(points, velocity)
        if brakes and self._path is not None:
            _, velocity, acceleration = self._path.at(self._playback.at(self.now)[0])
        # A path ends a protective stop with less jerk than the stop itself: near rest the base would turn back by it.
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
        # A base that slows down goes on with that if it goes on much the same way: its path begins as fast as the last
        # one goes on there, at the same rate. Else the path begins with the present velocity, and is played back at
        # full rate from the first moment; from rest the rate may start anywhere, and starts at nothing until `set_rate`
        # says how much the child allows.
        if brakes:
            self._playback.begin_anew(self.now)
            return
        self._playback = ScalarMotion(Limits(1.0, 1.0, 1.0), 0.0)  # from its first change on: `_rate_limits`
        self._rate = 1.0 if moves else 0.0
        self._playback.run_at(self._rate, self.now, at_once=True)

    def let_go(self, position: Vector, velocity: Vector, acceleration: Vector) -> None:
        """Give the base's path up, and come to rest from where it is as soon as it can.

        Args:
            position: Where it is, metres.
            velocity: What it does there, m/s.
            acceleration: The same, m/s^2.
        """
        self.led_off += 1
        self._hold(position)
        self.stops = True
        if math.hypot(*velocity) > NO_SPEED:
            self._path = BasePath.to_rest(position, velocity, acceleration, self.limits.as_commanded)
            self._playback = ScalarMotion(Limits(1.0, 1.0, 1.0), 0.0)
            self._playback.run_at(1.0, self.now, at_once=True)

    def set_rate(self, rate: float) -> None:
        """Set the share, 0 to 1, of its planned speed at which the base moves along its path."""
        if self._path is None or self.stops:
            return
        if self._rate == 0.0 and self._playback.at(self.now)[0] < self._path.turned_in:
            self._turn_on_the_spot(self._path)
        if self._rate == 0.0 and self._playback.at(self.now)[:2] == (0.0, 0.0):
            self._rate, self._looked_up = rate, None
            self._playback.run_at(rate, self.now, at_once=True)
        # The solver is asked for worthwhile changes only.
        elif abs(rate - self._rate) > min(0.04, 0.2 * self._rate) or (rate in (0.0, 1.0) and rate != self._rate):
            self._rate = rate
            self._change_rate()
        elif self._playback.arrival > self.now:  # meanwhile the path may leave more to the rate, or less
            self._change_rate()

    def _turn_on_the_spot(self, path: BasePath) -> None:
        """Begin a path anew from rest, if the base has stopped before it has turned into it.

        What is left of its turn may lead on to what it has stopped for, and it would stand there until that goes.
        """
        if self._playback.arrival > self.now:
            return  # it has not stopped yet
        (_, *points), is_clear = self._asked
        here = path.at(self._playback.at(self.now)[0])[0]
        if points and is_clear(np.linspace(here, points[0], _LOOKS)):
            self.drive_along([here, *points], is_clear)

    def _change_rate(self) -> None:
        self._looked_up = None
        assert self._path is not None  # it is the rate of one
        self._playback.set_limits(self._rate_limits(self._path))
        # It would slow down to each rate gently and lag behind rates that keep falling: so it aims beyond them.
        too_fast = max(0.0, self._playback.at(self.now)[1] - self._rate)
        self._playback.run_at(max(0.0, self._rate - too_fast), self.now)

    def base_reference(self) -> tuple[Vector, Vector, Vector]:
        """Return the position, velocity and acceleration of the base's reference now."""
        return self._base_at(self.now)

    @property
    def time_left(self) -> float:
        """Seconds until the base arrives if it is not slowed down any more."""
        if self._path is None:
            return 0.0
        return self._path.duration - self._playback.at(self.now)[0]

    @property
    def is_driving(self) -> bool:
        """Whether the base has a path to follow, also one on which it waits."""
        return self._path is not None

    @property
    def rate(self) -> float:
        """The share, 0 to 1, of its planned speed at which the base goes along its path now; 0 without a path."""
        return 0.0 if self._path is None else self._playback.at(self.now)[1]

    @property
    def moving(self) -> bool:
        """Whether the base's reference is on its way."""
        return self._path is not None and math.hypot(*self.base_reference()[1]) > NO_SPEED

    def points_ahead(self, seconds: float) -> list[Vector]:
        """Return points of the path that the base passes within some seconds."""
        if self._path is None:
            return [self._here]
        begin = self._playback.at(self.now)[0]
        return [self._path.at(begin + seconds * i / 5)[0] for i in range(1, 6)]

    def planned(self) -> tuple[Vector, Vector]:
        """Return the velocity and the acceleration that the path would have now at full rate."""
        if self._path is None:
            return (0.0, 0.0), (0.0, 0.0)
        # Look a little ahead, so that a base at rest at the start of its path sees where it would go.
        _, velocity, acceleration = self._path.at(self._playback.at(self.now)[0] + PLANNED_AHEAD)
        return velocity, acceleration

    def _base_at(self, time: float) -> tuple[Vector, Vector, Vector]:
        known = self._looked_up
        if known is None or known[0] != time:  # many ask for the same moment
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
        """Bounds of the rate of playback that keep those of the base: the rate gets what the path leaves.

        At a rate r the base's acceleration is r^2 times the path's, and the rate's change times the path's velocity.
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
    """Whether a path begins in much the same direction as a velocity."""
    here, *rest = without_repeats(points)
    if not rest:
        return False
    (x, y), _ = direction(here, rest[0])
    return x * velocity[0] + y * velocity[1] > _SAME_WAY * math.hypot(*velocity)
