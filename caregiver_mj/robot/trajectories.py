"""References that move: jerk-limited trajectories of ruckig, for single quantities and for the base's path.

All of them are functions of time that continue from whatever state they are in when a new goal is set.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.se2 import Vector

_HOLD = 1e-9  # ruckig refuses targets that are closer than rounding; so near, hold
_OVERSHOOT = 0.003  # metres beyond the end of a line that are none
_SAMPLES = 60  # of a trajectory, to see how fast it gets
_TURN_IN_LENGTHS = (0.5, 0.8, 1.2, 1.8, 2.6)  # metres in which a new path may be entered at speed; the quickest wins


class ScalarMotion:
    """A single quantity that moves to a position, or at a velocity, within limits."""

    def __init__(self, limits: Limits, position: float):
        """Starts at rest.

        Args:
            limits: Bounds of velocity, acceleration and jerk.
            position: Where it is.
        """
        self.target = position
        self._solver = Ruckig(1)
        self._start = 0.0
        self._rest: float | None = position  # at rest here, unless a trajectory is under way
        self.set_limits(limits)

    def set_limits(self, limits: Limits) -> None:
        """Changes the limits; a motion under way keeps the old ones until its next goal."""
        self.limits = limits

    def at(self, now: float) -> tuple[float, float, float]:
        """Position, velocity and acceleration at a time not before the last goal was set."""
        if self._rest is not None:
            return self._rest, 0.0, 0.0
        if now != self._sampled_at:  # many ask for the same moment
            self._sampled_at, self._sample = now, self._state_at(now - self._start)
        return self._sample

    def move_to(self, target: float, now: float) -> None:
        """Sets a position to come to rest at."""
        if target == self.target and (self._rest is not None or self._ends):
            return
        state = self.at(now)
        self.target = target
        if abs(target - state[0]) < _HOLD and abs(state[1]) < _HOLD and abs(state[2]) < _HOLD:
            self._rest = target
            return
        self._solve(now, state, ControlInterface.Position)

    def run_at(self, velocity: float, now: float, at_once: bool = False) -> None:
        """Sets a velocity to keep up from then on.

        Args:
            velocity: The velocity.
            now: The present time.
            at_once: Starts with that velocity instead of speeding up to it.
        """
        position, present, acceleration = self.at(now)
        state = (position, velocity, 0.0) if at_once else (position, present, acceleration)
        self.target = velocity
        self._solve(now, state, ControlInterface.Velocity)

    def highest(self) -> float:
        """The highest position of the present motion, which may swing out before it turns back."""
        if self._rest is not None:
            return self._rest
        if self._highest is None:
            times = (self._duration * i / _SAMPLES for i in range(_SAMPLES + 1))
            self._highest = max(self._trajectory.at_time(time)[0][0] for time in times)
        return self._highest

    @property
    def arrival(self) -> float:
        """When the present motion ends (a past time if it is at rest)."""
        return self._start if self._rest is not None else self._start + self._duration

    def _state_at(self, time: float) -> tuple[float, float, float]:
        """Position, velocity and acceleration at a time since the start of the trajectory."""
        if self._ends and time >= self._duration:
            return self.target, 0.0, 0.0
        (position,), (velocity,), (acceleration,) = self._trajectory.at_time(time)
        return position, velocity, acceleration

    def _solve(self, now: float, state: tuple[float, float, float], control: ControlInterface) -> None:
        parameters = _parameters([state[0]], [state[1]], [state[2]], self.limits)
        parameters.control_interface = control
        self._ends = control == ControlInterface.Position
        if self._ends:
            parameters.target_position = [self.target]
        else:
            parameters.target_velocity = [self.target]
        self._trajectory = _solve(self._solver, parameters)
        self._duration = self._trajectory.duration
        self._start, self._rest = now, None
        self._sampled_at, self._highest = math.nan, None  # samples of the old trajectory are void


@dataclasses.dataclass(frozen=True)
class _Piece:
    """A part of a path: a ruckig trajectory in a frame of its own, from `begin` on."""

    begin: float
    origin: Vector
    axis: Vector  # direction of the first coordinate; the second is a quarter turn to its left
    trajectory: Trajectory

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        position, velocity, acceleration = self.trajectory.at_time(time - self.begin)
        c, s = self.axis
        if len(position) == 1:
            p, v, a = position[0], velocity[0], acceleration[0]
            return (self.origin[0] + c * p, self.origin[1] + s * p), (c * v, s * v), (c * a, s * a)
        (p, q), (v, w), (a, b) = position, velocity, acceleration
        x, y = self.origin
        return (x + c * p - s * q, y + s * p + c * q), (c * v - s * w, s * v + c * w), (c * a - s * b, s * a + c * b)


class BasePath:
    """The base's way along a polyline: straight pieces, and corners blended without a stop.

    In a corner the velocity goes in a straight line, in velocity space, from the old direction to the new one; so the
    speed never exceeds that of the two ends. Every piece is one ruckig trajectory, and position, velocity and
    acceleration are continuous throughout.

    Attributes:
        goal: The end of the path, metres.
        duration: Seconds that it takes.
    """

    def __init__(
        self,
        points: Sequence[Vector],
        limits: Limits,
        velocity: Vector = (0.0, 0.0),
        acceleration: Vector = (0.0, 0.0),
        deviation: float = 0.08,
    ):
        """Plans the way.

        Args:
            points: The polyline from the present position to the goal, metres.
            limits: Bounds of speed, acceleration and jerk.
            velocity: Present velocity, m/s.
            acceleration: Present acceleration, m/s^2.
            deviation: Metres by which a blended corner may cut inside of the polyline.

        Raises:
            PathError: The present velocity is too high to turn into the path; stop first.
        """
        self._limits, self._deviation = limits, deviation
        self._pieces: list[_Piece] = []
        self.duration = 0.0
        points = _without_repeats(points)
        self.goal = points[-1]
        moving = math.hypot(*velocity) > 1e-6 or math.hypot(*acceleration) > 1e-6
        if len(points) == 1:
            if moving:
                raise PathError("no way to turn into: the base is moving at its goal")
            return
        start_speed = 0.0
        if moving:
            points, start_speed = self._turn_in(points, velocity, acceleration)
        self._follow(points, start_speed)

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Position (m), velocity (m/s) and acceleration (m/s^2) at a time since the start."""
        if time >= self.duration:
            return self.goal, (0.0, 0.0), (0.0, 0.0)
        pieces = self._pieces
        i = len(pieces) - 1
        while pieces[i].begin > time and i:
            i -= 1
        return pieces[i].at(time)

    # -- Planning --------------------------------------------------------------------------------

    def _turn_in(self, points: list[Vector], velocity: Vector, acceleration: Vector) -> tuple[list[Vector], float]:
        """Plans from the present motion onto the first line. Returns the points left, and the speed there."""
        axis, length = _direction(points[0], points[1])
        along, across = _in_frame(velocity, axis)
        parameters = _parameters([0.0, 0.0], [along, across], list(_in_frame(acceleration, axis)), self._limits)
        parameters.synchronization = Synchronization.TimeIfNecessary
        # Each axis gets what leaves the length of the vector within its limit.
        parameters.max_acceleration = [self._limits.acceleration / math.sqrt(2)] * 2
        parameters.max_jerk = [self._limits.jerk / math.sqrt(2)] * 2
        # While there is speed across the line there must be less along it.
        across_peak = abs(across) + parameters.current_acceleration[1] ** 2 / (2 * parameters.max_jerk[1])
        top = math.sqrt(max(self._limits.velocity**2 - across_peak**2, (0.3 * self._limits.velocity) ** 2))
        options = []
        for reach in (*(r for r in _TURN_IN_LENGTHS if r < 0.95 * length), length):
            # No faster than can be reached in time, or braked from in the rest of the line.
            end = min(top, self._reachable(max(along, 0.0), 0.6 * reach), self._reachable(0.0, length - reach))
            if self._distance_to_change(max(along, 0.0), end) > 0.9 * reach:
                continue  # it would overshoot and come back
            parameters.max_velocity = [max(top, abs(along)), self._limits.velocity]
            parameters.target_position = [reach, 0.0]
            parameters.target_velocity = [end, 0.0]
            trajectory = _solve(Ruckig(2), parameters)
            top_speed, farthest = _extremes(trajectory)
            if top_speed <= self._limits.velocity + _HOLD and farthest <= reach + _OVERSHOOT:
                options.append((trajectory.duration + (length - reach) / self._limits.velocity, reach, end, trajectory))
        if not options:
            raise PathError("too fast to turn into the path")
        _, reach, end, trajectory = min(options, key=lambda option: option[:2])
        self._append(points[0], axis, trajectory)
        if reach == length:
            return points[1:], end
        here = (points[0][0] + axis[0] * reach, points[0][1] + axis[1] * reach)
        return [here, *points[1:]], end

    def _follow(self, points: list[Vector], start_speed: float) -> None:
        """Plans along a polyline on whose first line the base already moves at a speed, to rest at its end."""
        if len(points) < 2:
            return
        lines = [_direction(a, b) for a, b in itertools.pairwise(points)]
        turns = [_angle(a[0], b[0]) for a, b in itertools.pairwise(lines)]
        # Speed at each point: what the corner allows, then what can be reached from, and braked to, its neighbours.
        speeds = [start_speed, *(self._corner_speed(t, min(a[1], b[1]) / 2) for t, a, b in
                                 zip(turns, lines, lines[1:], strict=False)), 0.0]  # fmt: skip
        trims = [0.0, *(self._corner_size(v, t) for v, t in zip(speeds[1:], turns, strict=False)), 0.0]
        lengths = [line[1] - a - b for line, a, b in zip(lines, trims, trims[1:], strict=False)]
        for i in range(len(lengths)):
            speeds[i + 1] = min(speeds[i + 1], self._reachable(speeds[i], lengths[i]))
        for i in reversed(range(1, len(lengths))):
            speeds[i] = min(speeds[i], self._reachable(speeds[i + 1], lengths[i]))

        here = points[0]
        for i, (axis, _) in enumerate(lines):
            corner = i < len(turns)
            trim = self._corner_size(speeds[i + 1], turns[i]) if corner else 0.0
            end = (points[i + 1][0] - axis[0] * trim, points[i + 1][1] - axis[1] * trim)
            length = (end[0] - here[0]) * axis[0] + (end[1] - here[1]) * axis[1]
            if length > _HOLD:
                parameters = _parameters([0.0], [speeds[i]], [0.0], self._limits)
                parameters.target_position = [length]
                parameters.target_velocity = [speeds[i + 1]]
                self._append(here, axis, _solve(Ruckig(1), parameters))
            here = end
            if corner and trim > _HOLD:
                here = self._corner(end, axis, lines[i + 1][0], speeds[i + 1])

    def _corner(self, begin: Vector, axis: Vector, next_axis: Vector, speed: float) -> Vector:
        turned = _in_frame(next_axis, axis)
        parameters = _parameters([0.0, 0.0], [speed, 0.0], [0.0, 0.0], self._limits)
        parameters.control_interface = ControlInterface.Velocity
        parameters.synchronization = Synchronization.Phase
        parameters.target_velocity = [speed * turned[0], speed * turned[1]]
        # The limits hold for the length of the vector; each axis gets its share of the change.
        change = math.hypot(turned[0] - 1.0, turned[1])
        share = [max(abs(turned[0] - 1.0) / change, 1e-3), max(abs(turned[1]) / change, 1e-3)]
        parameters.max_acceleration = [self._limits.acceleration * k for k in share]
        parameters.max_jerk = [self._limits.jerk * k for k in share]
        trajectory = _solve(Ruckig(2), parameters)
        self._append(begin, axis, trajectory)
        return self._pieces[-1].at(self.duration)[0]

    def _append(self, origin: Vector, axis: Vector, trajectory: Trajectory) -> None:
        self._pieces.append(_Piece(self.duration, origin, axis, trajectory))
        self.duration += trajectory.duration

    # -- How fast, how far -----------------------------------------------------------------------

    def _time_to_change(self, change: float) -> float:
        """Seconds for a jerk-limited change of velocity, from and to zero acceleration."""
        a, j = self._limits.acceleration, self._limits.jerk
        return change / a + a / j if change >= a * a / j else 2 * math.sqrt(change / j)

    def _distance_to_change(self, speed: float, end: float) -> float:
        return (speed + end) / 2 * self._time_to_change(abs(speed - end))

    def _reachable(self, speed: float, distance: float) -> float:
        """The highest speed to reach from another within a distance (or to brake from to it)."""
        low, high = speed, self._limits.velocity
        if high <= low or self._distance_to_change(speed, high) <= distance:
            return high
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if self._distance_to_change(speed, middle) <= distance else (low, middle)
        return low

    def _corner_size(self, speed: float, turn: float) -> float:
        """Length before, and after, the corner point that a blend at this speed takes."""
        return speed * self._time_to_change(2 * speed * math.sin(turn / 2)) / 2

    def _corner_speed(self, turn: float, room: float) -> float:
        """The highest speed at which a corner fits into the lines beside it and cuts not too far inside."""
        if turn > 0.9 * math.pi:
            return 0.0
        size = min(0.95 * room, 2 * self._deviation / max(math.sin(turn / 2), 1e-6))
        low, high = 0.0, self._limits.velocity
        if self._corner_size(high, turn) <= size:
            return high
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if self._corner_size(middle, turn) <= size else (low, middle)
        return low


class PathError(Exception):
    """A path cannot be entered from the present motion."""


def _parameters(
    position: list[float], velocity: list[float], acceleration: list[float], limits: Limits
) -> InputParameter:
    parameters = InputParameter(len(position))
    parameters.current_position = position
    parameters.current_velocity = velocity
    parameters.current_acceleration = acceleration
    # A state that overshoots a limit by rounding must not be an error.
    parameters.max_velocity = [max(limits.velocity, abs(v)) for v in velocity]
    parameters.max_acceleration = [limits.acceleration] * len(position)
    parameters.max_jerk = [limits.jerk] * len(position)
    return parameters


def _solve(solver: Ruckig, parameters: InputParameter) -> Trajectory:
    trajectory = Trajectory(solver.degrees_of_freedom)
    try:
        result = solver.calculate(parameters, trajectory)
    except RuckigError as error:
        raise PathError(str(error)) from None
    if result not in (Result.Working, Result.Finished):
        raise PathError(f"ruckig found no trajectory: {result}")
    return trajectory


def _extremes(trajectory: Trajectory) -> tuple[float, float]:
    """The highest speed of a trajectory in two dimensions and its farthest first coordinate, from samples."""
    states = [trajectory.at_time(trajectory.duration * i / _SAMPLES) for i in range(_SAMPLES + 1)]
    return max(math.hypot(*velocity) for _, velocity, _ in states), max(position[0] for position, _, _ in states)


def _without_repeats(points: Sequence[Vector]) -> list[Vector]:
    kept = [(float(points[0][0]), float(points[0][1]))]
    for x, y in points[1:]:
        if math.hypot(x - kept[-1][0], y - kept[-1][1]) > 1e-4:
            kept.append((float(x), float(y)))
    return kept


def _direction(a: Vector, b: Vector) -> tuple[Vector, float]:
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return ((b[0] - a[0]) / length, (b[1] - a[1]) / length), length


def _in_frame(vector: Vector, axis: Vector) -> Vector:
    return vector[0] * axis[0] + vector[1] * axis[1], -vector[0] * axis[1] + vector[1] * axis[0]


def _angle(a: Vector, b: Vector) -> float:
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))
