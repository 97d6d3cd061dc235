"""Room that a house leaves for the base and its hand: rasters of distances to everything in it."""

from __future__ import annotations

import math

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.layout import Layout
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.geometry import Vector

_LEAVING = 0.40  # m; distance from the ends of a path within which its clearance may be less

_HAND_CLEARANCE = 0.04  # m; gap between hand and wall while the base cannot turn

_RASTER = 0.025  # m
_STRIDE, _ENDS = 16, 20  # in a quick check of a line: stride, and points at its ends within `_LEAVING`
_NEIGHBOURHOOD = 2.0  # m; margin of the raster around the house, for poses outside of it
_ROUNDING = 1e-9  # m


class Clearance:
    """Room of a robot in one house, from its floor plan alone."""

    def __init__(self, plan: FloorPlan, robot: Embodiment):
        self._plan = plan
        self._needs = needs = robot.clearances
        height, width = plan.shape
        self._half = np.array([width, height]) * plan.cell_size / 2 + _NEIGHBOURHOOD
        self._origin = tuple((-self._half).tolist())
        # m; room beyond the needs of the base, and of the hand that turns with it.
        layout = Layout(plan)
        self._room = self._distance_to(layout.obstacles) - robot.footprint - needs.furniture
        self._turning_room = self._distance_to(layout.high) - needs.turning

    def line(self, a: Vector, b: Vector, hand: Vector | None = None) -> tuple[np.ndarray, np.ndarray] | None:
        """Return points, x and y, m, of the straight line from a to b if the base has room on it, else None.

        A base already too close to something may leave it, or arrive so, but not come closer. `hand` is the tucked
        hand's offset from the base's centre in the house's axes, which must meet no wall until the base can turn; None
        to ignore it.
        """
        if self._meets_wall(a, b):
            return None
        x, y = _points_between(a, b)
        there = self._indices(x, y)
        for raster in (self._room, self._turning_room):
            slack = raster[there]
            if np.minimum.reduce(slack) >= 0.0:  # faster than `min`
                continue
            distance = np.linspace(0.0, math.dist(a, b), len(x))
            allowed = np.where(distance < _LEAVING, min(0.0, slack[0]), 0.0)
            allowed = np.where(distance > distance[-1] - _LEAVING, np.minimum(allowed, slack[-1]), allowed)
            if (slack < allowed - _ROUNDING).any():
                return None
        return (x, y) if hand is None or self._leaves_room(x, y, hand) else None

    def _leaves_room(self, x: np.ndarray, y: np.ndarray, hand: Vector) -> bool:
        """Return whether a hand with this offset has room until the base reaches a point at which it can turn."""
        can_turn = self._turning_room[self._indices(x, y)] >= 0.0
        until = int(can_turn.argmax()) if can_turn.any() else len(x)
        if until == 0:
            return True
        return self._is_clear_of_walls(x[:until] + hand[0], y[:until] + hand[1])

    def _is_clear_of_walls(self, x: np.ndarray, y: np.ndarray) -> bool:
        """Return whether the hand has room at all points, or at least as much as at the first."""
        there = self._indices(x, y)
        room = self._turning_room[there] + self._needs.turning - self._needs.hand_width / 2 - _HAND_CLEARANCE
        return bool((room >= min(0.0, room[0]) - _ROUNDING).all())

    def has_room(self, points: np.ndarray, hand: Vector | None = None) -> bool:
        """Return whether the base fits at points (n, 2), with less clearance than on a straight path; see `line`."""
        if not len(points):
            return True
        if hand is not None and not self._leaves_room(points[:, 0], points[:, 1], hand):
            return False
        there = self._indices(points[:, 0], points[:, 1])
        ends = np.minimum(np.hypot(*(points - points[0]).T), np.hypot(*(points - points[-1]).T)) < _LEAVING
        for raster in (self._room, self._turning_room):
            slack = raster[there]
            allowed = np.where(ends, min(-self._needs.corner, slack[0], slack[-1]), -self._needs.corner)
            if (slack < allowed - _ROUNDING).any():
                return False
        return True

    def can_stand(self, point: Vector) -> bool:
        """Return whether the base may stand at a point, and has room."""
        if self._plan.cell_at(point) not in self._plan.cell_index:  # also outside of the house
            return False
        return self._value(self._room, point) >= -self._needs.standing

    def hand_has_room(self, a: Vector, b: Vector, hand: Vector) -> bool:
        """Return whether the hand, as in `line`, has room while the base moves straight from a to b without turning."""
        x, y = _points_between(a, b)
        return self._is_clear_of_walls(x + hand[0], y + hand[1])

    def can_turn(self, point: Vector, spare: float = 0.0) -> bool:
        """Return whether the base can turn at a point with a candle in its tucked hand, and `spare` metres left."""
        return self._value(self._turning_room, point) >= spare

    def hand_clear(self, a: Vector, b: Vector) -> bool:
        """Return whether the extended hand can move straight between two points without touching a wall."""
        room = self._turning_room[self._indices(*_points_between(a, b))].min()
        return bool(room >= self._needs.hand - self._needs.turning)

    def _meets_wall(self, a: Vector, b: Vector) -> bool:
        """Return whether a sample of a line's points meets a wall: a quick check, as most long lines soon do."""
        last = int(math.dist(a, b) / _RASTER) + 1
        room, (left, bottom), (x, y), (right, up) = self._turning_room.item, self._origin, a, (b[0] - a[0], b[1] - a[1])
        for i in range(_ENDS, last - _ENDS, _STRIDE):  # up to thousands of points: `_value` takes twice as long
            share = i * (1.0 / last)
            column, row = int((x + share * right - left) / _RASTER), int((y + share * up - bottom) / _RASTER)
            if room(row, column) < -_ROUNDING:
                return True
        return False

    def _value(self, raster: np.ndarray, point: Vector) -> float:
        row, column = int((point[1] - self._origin[1]) / _RASTER), int((point[0] - self._origin[0]) / _RASTER)
        return raster.item(row, column)

    def _indices(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return ((y - self._origin[1]) / _RASTER).astype(int), ((x - self._origin[0]) / _RASTER).astype(int)

    def _distance_to(self, rectangles: np.ndarray) -> np.ndarray:
        """Return the distance of every raster point, (rows, columns), from the nearest rectangle of (n, 4), m."""
        from scipy import ndimage  # imported here: it takes 0.1 s

        half = self._half
        free = np.ones(np.ceil(2 * half[::-1] / _RASTER).astype(int) + 1, bool)
        for x, y, half_x, half_y in rectangles:
            low = np.floor((np.array([y - half_y, x - half_x]) + half[::-1]) / _RASTER).astype(int)
            high = np.ceil((np.array([y + half_y, x + half_x]) + half[::-1]) / _RASTER).astype(int)
            free[low[0] : high[0], low[1] : high[1]] = False
        return ndimage.distance_transform_edt(free) * _RASTER


def _points_between(a: Vector, b: Vector) -> tuple[np.ndarray, np.ndarray]:
    last = int(math.dist(a, b) / _RASTER) + 1
    share = np.arange(last + 1) * (1.0 / last)  # like `linspace`, which is slower than all the rest
    share[-1] = 1.0
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
