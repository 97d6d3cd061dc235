"""The base's path along a polyline: jerk-limited trajectories that continue the present motion."""

from __future__ import annotations

import bisect
import dataclasses
import itertools
import math
from collections.abc import Sequence

from ruckig import ControlInterface, Synchronization, Trajectory

from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.limits import Limits
from caregiver_mj.robot.scalar_motion import NOTHING, PathError, extremes, highest, parameters, solve

_OVERSHOOT = 0.003  # m; accepted overshoot beyond the end of a line
_TURN_IN_LENGTHS = (0.5, 0.8, 1.2, 1.8, 2.6)  # m; candidates for the length of entry to a new path, the quickest wins
# Share of the base's limits for coming to rest; the rest lets lagging commands catch up. Candidate directions of that
# share, rad off the motion: the part along brakes, the part across stops acceleration there from swinging the base out.
_BRAKES, _ACROSS = 0.95, tuple(math.radians(18.0 + 10.0 * i) for i in range(7))
BRAKES_ALONG = _BRAKES * math.cos(_ACROSS[0])  # the same share of a base that drives straight


class BasePath:
    """A path along a polyline: straight pieces, and corners blended without a stop.

    In a corner the velocity moves on a straight line in velocity space from the old direction to the new one, so the
    speed never exceeds that at the two ends. Every piece is one ruckig trajectory; position, velocity and acceleration
    are continuous throughout.

    Attributes:
        goal: End of the path, m.
        duration: Duration, s.
        turned_in: Time at which the entry to the first line ends, s; 0 from rest.
    """

    def __init__(
        self,
        points: Sequence[Vector],
        limits: Limits,
        velocity: Vector = (0.0, 0.0),
        acceleration: Vector = (0.0, 0.0),
        deviation: float = 0.08,
    ):
        """Plan the path.

        Args:
            points: Polyline from the present position to the goal, m.
            limits: Bounds of speed, acceleration and jerk.
            velocity: Present velocity, m/s.
            acceleration: Present acceleration, m/s^2.
            deviation: Greatest cut of a blended corner inside the polyline, m.

        Raises:
            PathError: The base is too fast to turn into the path, or moves at its goal; stop first.
        """
        self._limits, self._speeds = limits, PathSpeeds(limits, deviation)
        self._pieces: list[Piece] = []
        self._begins: list[float] = []
        self.duration = self.turned_in = 0.0
        points = without_repeats(points)
        self.goal = points[-1]
        moving = math.hypot(*velocity) > 1e-6 or math.hypot(*acceleration) > 1e-6
        if len(points) == 1:
            if moving:
                raise PathError("no way to turn into: the base is moving at its goal")
            return
        start_speed = 0.0
        if moving:
            points, start_speed = self._turn_in(points, velocity, acceleration)
            self.turned_in = self.duration
        self._follow(points, start_speed)

    @classmethod
    def to_rest(cls, position: Vector, velocity: Vector, acceleration: Vector, limits: Limits) -> BasePath:
        """Return the path on which a base comes to rest as soon as possible.

        Args:
            position: Present position, m.
            velocity: Present velocity, m/s, not zero.
            acceleration: Present acceleration, m/s^2.
            limits: Bounds of speed, acceleration and jerk.
        """
        path, speed = cls([position], limits), math.hypot(*velocity)
        axis = (velocity[0] / speed, velocity[1] / speed)
        asked = parameters([0.0, 0.0], [speed, 0.0], list(_in_frame(acceleration, axis)), limits)
        asked.control_interface = ControlInterface.Velocity
        asked.synchronization = Synchronization.TimeIfNecessary
        asked.target_velocity = [0.0, 0.0]

        def way(across: float) -> Trajectory:
            shares = _BRAKES * math.cos(across), _BRAKES * math.sin(across)
            asked.max_acceleration = [share * limits.acceleration for share in shares]
            asked.max_jerk = [share * limits.jerk for share in shares]
            return solve(asked)

        path._append(position, axis, min(map(way, _ACROSS), key=lambda found: found.duration))
        path.goal = path._pieces[-1].at(path.duration)[0]
        return path

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Return the position (m), velocity (m/s) and acceleration (m/s^2) at a time since the start, s."""
        if time >= self.duration:
            return self.goal, (0.0, 0.0), (0.0, 0.0)
        return self._pieces[max(0, bisect.bisect(self._begins, time) - 1)].at(time)

    # -- Planning --------------------------------------------------------------------------------

    def _turn_in(self, points: list[Vector], velocity: Vector, acceleration: Vector) -> tuple[list[Vector], float]:
        """Plan the entry to the first line from the present motion; return the points left, and the speed there."""
        speeds = self._speeds
        axis, length = direction(points[0], points[1])
        along, across = _in_frame(velocity, axis)
        along_change, across_change = _in_frame(acceleration, axis)
        # Per axis, so that the vector's length keeps its limit.
        most, jerk = self._limits.acceleration / math.sqrt(2), self._limits.jerk / math.sqrt(2)
        # Speed across the line leaves less along it.
        across_peak = abs(across) + across_change**2 / (2 * jerk)
        top = math.sqrt(max(self._limits.velocity**2 - across_peak**2, (0.3 * self._limits.velocity) ** 2))
        best: tuple[float, float, float, Trajectory] | None = None  # time in all, s, then reach, end, entry
        for reach in (*(r for r in _TURN_IN_LENGTHS if r < 0.95 * length), length):
            # Bounded by acceleration before, and by braking in the rest of the line.
            end = min(top, speeds.reachable(max(along, 0.0), 0.6 * reach), speeds.reachable(0.0, length - reach))
            if speeds.distance_to_change(max(along, 0.0), end) > 0.9 * reach:
                continue  # it would overshoot and come back
            asked = parameters([0.0, 0.0], [along, across], [along_change, across_change], self._limits)
            asked.synchronization = Synchronization.TimeIfNecessary
            asked.max_velocity = [max(top, abs(along)), self._limits.velocity]
            asked.max_acceleration, asked.max_jerk = [most, most], [jerk, jerk]
            asked.target_position = [reach, 0.0]
            asked.target_velocity = [end, 0.0]
            trajectory = solve(asked)
            time = trajectory.duration + (length - reach) / self._limits.velocity
            if best and time >= best[0]:
                continue
            top_speed, farthest = extremes(trajectory)
            if top_speed <= self._limits.velocity + NOTHING and farthest <= reach + _OVERSHOOT:
                best = time, reach, end, trajectory
        if best is None:
            raise PathError("too fast to turn into the path")
        _, reach, end, trajectory = best
        self._append(points[0], axis, trajectory)
        if reach == length:
            return points[1:], end
        here = (points[0][0] + axis[0] * reach, points[0][1] + axis[1] * reach)
        return [here, *points[1:]], end

    def _follow(self, points: list[Vector], start_speed: float) -> None:
        """Plan from a start speed along the first line to rest at the end of a polyline."""
        if len(points) < 2:
            return
        lines = [direction(a, b) for a, b in itertools.pairwise(points)]
        turns = [angle(a[0], b[0]) for a, b in itertools.pairwise(lines)]
        rooms = [min(a[1], b[1]) / 2 for a, b in itertools.pairwise(lines)]
        # Speed at each point: bounded by the corner, then by acceleration and braking from its neighbours.
        speeds = [start_speed, *map(self._speeds.corner_speed, turns, rooms), 0.0]
        trims = [0.0, *map(self._speeds.corner_size, speeds[1:-1], turns), 0.0]
        lengths = [line[1] - a - b for line, a, b in zip(lines, trims, trims[1:], strict=False)]
        for i in range(len(lengths)):
            speeds[i + 1] = min(speeds[i + 1], self._speeds.reachable(speeds[i], lengths[i]))
        for i in reversed(range(1, len(lengths))):
            speeds[i] = min(speeds[i], self._speeds.reachable(speeds[i + 1], lengths[i]))
        if turns:
            speeds[1] = self._speeds.corner_speed_from(start_speed, lines[0][1], turns[0], speeds[1])

        here = points[0]
        for i, (axis, _) in enumerate(lines):
            corner = i < len(turns)
            trim = self._speeds.corner_size(speeds[i + 1], turns[i]) if corner else 0.0
            end = (points[i + 1][0] - axis[0] * trim, points[i + 1][1] - axis[1] * trim)
            length = (end[0] - here[0]) * axis[0] + (end[1] - here[1]) * axis[1]
            if length > NOTHING:
                asked = parameters([0.0], [speeds[i]], [0.0], self._limits)
                asked.target_position = [length]
                asked.target_velocity = [speeds[i + 1]]
                self._append(here, axis, solve(asked))
            here = end
            if corner and trim > NOTHING:
                here = self._corner(end, axis, lines[i + 1][0], speeds[i + 1])

    def _corner(self, begin: Vector, axis: Vector, next_axis: Vector, speed: float) -> Vector:
        turned = _in_frame(next_axis, axis)
        asked = parameters([0.0, 0.0], [speed, 0.0], [0.0, 0.0], self._limits)
        asked.control_interface = ControlInterface.Velocity
        asked.synchronization = Synchronization.Phase
        asked.target_velocity = [speed * turned[0], speed * turned[1]]
        # The vector's length keeps its limits; each axis gets its share of the change.
        change = math.hypot(turned[0] - 1.0, turned[1])
        share = [max(abs(turned[0] - 1.0) / change, 1e-3), max(abs(turned[1]) / change, 1e-3)]
        asked.max_acceleration = [self._limits.acceleration * k for k in share]
        asked.max_jerk = [self._limits.jerk * k for k in share]
        trajectory = solve(asked)
        self._append(begin, axis, trajectory)
        return self._pieces[-1].at(self.duration)[0]

    def _append(self, origin: Vector, axis: Vector, trajectory: Trajectory) -> None:
        self._pieces.append(Piece(self.duration, origin, axis, trajectory))
        self._begins.append(self.duration)
        self.duration += trajectory.duration


@dataclasses.dataclass(frozen=True)
class Piece:
    """A part of a path: a ruckig trajectory in its own frame, from the time `begin`, s, on."""

    begin: float
    origin: Vector
    axis: Vector  # direction of the first coordinate; the second is a quarter turn to its left
    trajectory: Trajectory

    def at(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Return the position, velocity and acceleration at a time since the start of the path."""
        position, velocity, acceleration = self.trajectory.at_time(time - self.begin)
        c, s = self.axis
        if len(position) == 1:
            p, v, a = position[0], velocity[0], acceleration[0]
            return (self.origin[0] + c * p, self.origin[1] + s * p), (c * v, s * v), (c * a, s * a)
        (p, q), (v, w), (a, b) = position, velocity, acceleration
        x, y = self.origin
        return (x + c * p - s * q, y + s * p + c * q), (c * v - s * w, s * v + c * w), (c * a - s * b, s * a + c * b)


def without_repeats(points: Sequence[Vector]) -> list[Vector]:
    """Return a polyline without points that repeat the previous one, within 0.1 mm."""
    kept = [(float(points[0][0]), float(points[0][1]))]
    for x, y in points[1:]:
        if math.hypot(x - kept[-1][0], y - kept[-1][1]) > 1e-4:
            kept.append((float(x), float(y)))
    return kept


def direction(a: Vector, b: Vector) -> tuple[Vector, float]:
    """Return the unit vector from one point to another, and their distance."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return ((b[0] - a[0]) / length, (b[1] - a[1]) / length), length


def _in_frame(vector: Vector, axis: Vector) -> Vector:
    """Return a vector's components along an axis, and along its quarter turn to the left."""
    return vector[0] * axis[0] + vector[1] * axis[1], -vector[0] * axis[1] + vector[1] * axis[0]


def angle(a: Vector, b: Vector) -> float:
    """Return the angle between two directions, 0 to pi, rad."""
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))


class PathSpeeds:
    """Speeds and lengths, within limits, of straight pieces and corners."""

    def __init__(self, limits: Limits, deviation: float):
        """Set the bounds.

        Args:
            limits: Bounds of speed, acceleration and jerk.
            deviation: Greatest cut of a blended corner inside the polyline, m.
        """
        self._limits, self._deviation = limits, deviation

    def time_to_change(self, change: float) -> float:
        """Return the time of a jerk-limited change of velocity, from and to zero acceleration, s."""
        a, j = self._limits.acceleration, self._limits.jerk
        return change / a + a / j if change >= a * a / j else 2 * math.sqrt(change / j)

    def distance_to_change(self, speed: float, end: float) -> float:
        """Return the distance of a change from one speed to another, m."""
        return (speed + end) / 2 * self.time_to_change(abs(speed - end))

    def reachable(self, speed: float, distance: float) -> float:
        """Return the highest speed that can be reached from `speed` within a distance, or from which it can be."""
        most = self._limits.velocity
        if most <= speed or self.distance_to_change(speed, most) <= distance:
            return most
        return highest(lambda end: self.distance_to_change(speed, end) <= distance, speed, most)

    def corner_speed_from(self, speed: float, length: float, turn: float, most: float) -> float:
        """Return the highest speed, up to `most`, of the corner at the end of a line entered at `speed`.

        The base brakes to it before the corner begins, and a faster corner begins earlier. One such speed exists if the
        base can stop within the line.
        """

        def fits(end: float) -> bool:
            return self.distance_to_change(speed, min(speed, end)) <= length - self.corner_size(end, turn)

        return most if fits(most) else highest(fits, 0.0, most)

    def corner_size(self, speed: float, turn: float) -> float:
        """Return the length of a blend at a speed before, and also after, the corner point, m."""
        return speed * self.time_to_change(2 * speed * math.sin(turn / 2)) / 2

    def corner_speed(self, turn: float, room: float) -> float:
        """Return the highest speed at which a corner fits into `room`, m, and keeps the greatest cut inside."""
        if turn > 0.9 * math.pi:
            return 0.0
        size = min(0.95 * room, 2 * self._deviation / max(math.sin(turn / 2), 1e-6))
        most = self._limits.velocity
        if self.corner_size(most, turn) <= size:
            return most
        return highest(lambda speed: self.corner_size(speed, turn) <= size, 0.0, most)
