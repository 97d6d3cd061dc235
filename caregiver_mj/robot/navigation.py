"""Paths for the base: shortest routes over cells, pulled tight round obstacles with a clearance."""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Collection, Iterable, Sequence

import numpy as np
from scipy import ndimage

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import ACTIONS, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.view import CHILD_RADIUS

BASE_RADIUS = 0.27  # metres
_CLEARANCE = 0.07  # metres between base and furniture on a planned path; blended corners and tracking need it
_CUT_CLEARANCE = 0.02  # metres of that which a cut corner may use up
_HAND_CLEARANCE = 0.52  # metres from the base's centre to a wall: a carried candle turns with the base, 0.45 m out
_STANDING_CLOSER = 0.02  # metres of the clearance that a base may use up where it stands still
_LEAVING = 0.40  # metres from the ends of a path within which it may be closer to things than elsewhere
_HAND_RADIUS = 0.16  # metres: half the hand's width, and what the arm may be off
_CHILD_CLEARANCE = 0.20  # metres between base and child on a planned path
_WAY_OUT, _DIRECTIONS = 0.45, 16  # metres that a base beside the child goes away from it first; and directions to try

_RASTER = 0.025  # metres
_STRIDE, _ENDS = 16, 20  # in a first look along a line: points to skip, and points at its ends within `_LEAVING`
_NEIGHBOURHOOD = 2.0  # metres round the house that the raster covers, for poses outside of it


class Navigator:
    """Plans the base's paths in one house, from its floor plan alone."""

    def __init__(self, plan: FloorPlan):
        self.plan = plan
        self._neighbours = {
            cell: [n for down, right in ACTIONS if (n := (cell[0] + down, cell[1] + right)) in plan.cell_index]
            for cell in plan.caregiver_cells
        }
        self._centres = {cell: tuple(plan.position(cell).tolist()) for cell in plan.caregiver_cells}
        # While the child is far away, way after way leads to the same goal with the same cells closed.
        self._steps_to = functools.lru_cache(maxsize=64)(self._steps_to)
        self._rasterise()

    def path(
        self,
        start: Vector,
        goal: Vector,
        goal_cell: Cell,
        children: Sequence[Vector] = (),
        closed: Collection[Cell] = (),
    ) -> list[Vector] | None:
        """Plans a polyline.

        Args:
            start: Present position of the base, metres.
            goal: Where it shall go, metres.
            goal_cell: The cell in which (or at whose border) the goal lies.
            children: Where children are that are to be given a wide berth.
            closed: Cells not to be entered.

        Returns:
            Points from start to goal, or None if there is no way.
        """
        path = self._path(start, goal, goal_cell, children, closed)
        if path is None:
            ways_out = self.ways_out(start, children, closed)
            rests = (self._path(out, goal, goal_cell, children, closed) for out in ways_out)
            path = next(([start, *rest] for rest in rests if rest), None)
        return path

    def _path(
        self, start: Vector, goal: Vector, goal_cell: Cell, children: Sequence[Vector], closed: Collection[Cell]
    ) -> list[Vector] | None:
        """Plans a polyline along a shortest route over cells; the arguments are those of `path`."""
        start_cell = self.nearest_cell(start)
        cells = self.route(start_cell, goal_cell, closed)
        if cells is None:
            return None
        ends = {start_cell, goal_cell}
        shut = np.array([self._code(cell) for cell in {*closed, *self.plan.stairwells} - ends], int)
        # The first point is the centre of the cell in which the base stands: the way out if nothing else is in sight.
        points = [start, *(self._centres[cell] for cell in cells[:-1]), goal]
        return self._pull_tight(points, children, shut)

    def route(self, start: Cell, goal: Cell, closed: Collection[Cell] = ()) -> list[Cell] | None:
        """The cells of a shortest 4-connected route, ends included, or None. Landings are no thoroughfares."""
        if goal in closed:
            return None
        steps = self._steps_to(goal, frozenset({*closed, *self.plan.stairwells} - {start, goal}))
        if start not in steps:
            return None
        cells = [start]
        while cells[-1] != goal:
            cells.append(steps[cells[-1]])
        return cells

    def _steps_to(self, goal: Cell, closed: frozenset[Cell]) -> dict[Cell, Cell]:
        """For every cell from which there is a way to a goal, the next cell on a shortest one."""
        steps = {goal: goal}
        queue = deque([goal])
        while queue:
            cell = queue.popleft()
            for neighbour in self._neighbours[cell]:
                if neighbour not in steps and neighbour not in closed:
                    steps[neighbour] = cell
                    queue.append(neighbour)
        return steps

    def nearest_cell(self, position: Vector) -> Cell:
        """The cell on which a base stands (the nearest one that it can stand on)."""
        cell = self.plan.cell_at(position)
        if cell in self._centres:
            return cell
        return min(self._centres, key=lambda c: math.dist(self._centres[c], position))

    def visible(self, a: Vector, b: Vector, children: Sequence[Vector] = (), shut: np.ndarray | None = None) -> bool:
        """Whether the base can go straight from one point to another.

        Args:
            a: A point, metres.
            b: Another one.
            children: Where children are that are to be given a wide berth.
            shut: Codes of cells that must not be crossed.
        """
        if self._meets_wall(a, b):
            return False
        x, y = self._line(a, b)
        # A base that stands too close to something already may leave it, or come to stand there, but no more than that.
        for raster in (self._room, self._turning_room):
            slack = self._at(raster, x, y)
            if slack.min() >= 0.0:
                continue
            distance = np.linspace(0.0, math.dist(a, b), len(x))
            allowed = np.where(distance < _LEAVING, min(0.0, slack[0]), 0.0)
            allowed = np.where(distance > distance[-1] - _LEAVING, np.minimum(allowed, slack[-1]), allowed)
            if (slack < allowed - 1e-9).any():
                return False
        if shut is not None and shut.size and np.isin(self._codes(x, y), shut).any():
            return False
        wanted = BASE_RADIUS + CHILD_RADIUS + _CHILD_CLEARANCE
        for child in children:
            distance = np.hypot(x - child[0], y - child[1])
            if distance.min() < min(wanted, distance[0] - 1e-6):
                return False
        return True

    def has_room(self, points: np.ndarray) -> bool:
        """Whether the base fits at all points (n, 2), be it with less clearance than a straight path keeps."""
        if not len(points):
            return True
        for raster in (self._room, self._turning_room):
            slack = self._at(raster, points[:, 0], points[:, 1])
            ends = np.minimum(np.hypot(*(points - points[0]).T), np.hypot(*(points - points[-1]).T)) < _LEAVING
            allowed = np.where(ends, min(-_CUT_CLEARANCE, slack[0], slack[-1]), -_CUT_CLEARANCE)
            if (slack < allowed - 1e-9).any():
                return False
        return True

    def can_stand(self, point: Vector) -> bool:
        """Whether the base has room to stand at a point, and is meant to."""
        if self.plan.cell_at(np.array(point)) not in self._centres:  # as those of all points outside of the house
            return False
        return self._value(self._room, point) >= -_STANDING_CLOSER

    def can_turn(self, point: Vector) -> bool:
        """Whether the base has room to turn at a point with a candle in its tucked hand."""
        return self._value(self._turning_room, point) >= 0.0

    def hand_clear(self, a: Vector, b: Vector) -> bool:
        """Whether the outstretched hand can move straight from one point to another without touching a wall."""
        return bool(self._at(self._turning_room, *self._line(a, b)).min() >= _HAND_RADIUS - _HAND_CLEARANCE)

    def _pull_tight(
        self, points: Sequence[Vector], children: Sequence[Vector], shut: np.ndarray
    ) -> list[Vector] | None:
        """Leaves out the points between which one can go straight; None if a child stands in between."""
        kept = [points[0]]
        i = 0
        while i < len(points) - 1:
            j = len(points) - 1
            while j > i + 1 and not self.visible(points[i], points[j], children, shut):
                j -= 1
            if j == i + 1 and not self.visible(points[i], points[j], children) and self.visible(points[i], points[j]):
                return None
            kept.append(points[j])
            i = j
        return kept

    def ways_out(self, start: Vector, children: Sequence[Vector], closed: Collection[Cell]) -> list[Vector]:
        """Where a base beside a child can go straight away from it: one place in each cell round about.

        Args:
            start: Where the base is, metres. Routes over cells are no help where it shares a cell with a child.
            children: Where the children are.
            closed: Cells not to be entered.

        Returns:
            Places, the farthest from all children first; none if no child is that close.
        """

        def distance(place: Vector) -> float:
            return min((math.dist(place, child) for child in children), default=math.inf)

        if distance(start) >= BASE_RADIUS + CHILD_RADIUS + _CHILD_CLEARANCE:
            return []
        angles = np.arange(_DIRECTIONS) * math.tau / _DIRECTIONS
        places = np.array(start) + _WAY_OUT * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        found: dict[Cell, Vector] = {}
        for place in sorted(map(tuple, places.tolist()), key=distance, reverse=True):
            cell = self.plan.cell_at(np.array(place))
            if cell in found or cell in closed or cell not in self._centres:
                continue
            if self.can_stand(place) and self.visible(start, place, children):
                found[cell] = place
        return list(found.values())

    def refuge(self, start: Cell, children: Iterable[Cell], closed: Collection[Cell]) -> Cell | None:
        """The nearest of the cells in which the robot is least in the children's way, without entering closed cells.

        Args:
            start: Where the robot is.
            children: Where each child is.
            closed: Cells not to be entered.

        Returns:
            The cell, or None if no child is in a cell where children can be.
        """
        known = [self.plan.cell_index[child] for child in children if child in self.plan.free_cells]
        if not known:
            return None
        in_the_way = sum(yielding(self.plan).routes_over(child) for child in known)
        distance = {start: 0}
        queue = deque([start])
        while queue:
            cell = queue.popleft()
            for neighbour in self._neighbours[cell]:
                if neighbour not in distance and neighbour not in closed:
                    distance[neighbour] = distance[cell] + 1
                    queue.append(neighbour)
        return min(distance, key=lambda cell: (in_the_way[self.plan.cell_index[cell]], distance[cell]))

    def _meets_wall(self, a: Vector, b: Vector) -> bool:
        """Whether a few of a line's points already show a wall in the way: most long lines meet one, and soon."""
        last = int(math.dist(a, b) / _RASTER) + 1
        for i in range(_ENDS, last - _ENDS, _STRIDE):
            share = i * (1.0 / last)
            x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
            if self._value(self._turning_room, (x, y)) < -1e-9:
                return True
        return False

    def _line(self, a: Vector, b: Vector) -> tuple[np.ndarray, np.ndarray]:
        """Points, x and y, along a straight line."""
        share = np.linspace(0.0, 1.0, int(math.dist(a, b) / _RASTER) + 2)
        return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])

    def _value(self, raster: np.ndarray, point: Vector) -> float:
        """Value of a raster at one point."""
        row, column = int((point[1] - self._origin[1]) / _RASTER), int((point[0] - self._origin[0]) / _RASTER)
        return float(raster[row, column])

    def _at(self, raster: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Values of a raster at points."""
        row = ((y - self._origin[1]) / _RASTER).astype(int)
        return raster[row, ((x - self._origin[0]) / _RASTER).astype(int)]

    def _code(self, cell: Cell) -> int:
        return cell[0] * self.plan.shape[1] + cell[1]

    def _codes(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Codes of the cells in which points lie."""
        height, width = self.plan.shape
        column = np.rint(x / self.plan.cell_size + (width - 1) / 2).astype(int)
        row = np.rint((height - 1) / 2 - y / self.plan.cell_size).astype(int)
        return row * width + column

    def _rasterise(self) -> None:
        """Tabulates, in metres, how much room there is beyond what the base needs, and the hand when it turns."""
        height, width = self.plan.shape
        half = np.array([width, height]) * self.plan.cell_size / 2 + _NEIGHBOURHOOD
        self._origin = tuple((-half).tolist())
        shape = tuple(np.ceil(2 * half[::-1] / _RASTER).astype(int) + 1)

        def distance_to(rectangles: np.ndarray) -> np.ndarray:
            free = np.ones(shape, bool)
            for x, y, half_x, half_y in rectangles:
                low = np.floor((np.array([y - half_y, x - half_x]) + half[::-1]) / _RASTER).astype(int)
                high = np.ceil((np.array([y + half_y, x + half_x]) + half[::-1]) / _RASTER).astype(int)
                free[low[0] : high[0], low[1] : high[1]] = False
            return ndimage.distance_transform_edt(free) * _RASTER

        self._room = distance_to(layout.obstacle_rectangles(self.plan)) - BASE_RADIUS - _CLEARANCE
        # Stairs go down between panels as high as walls.
        high = np.concatenate([layout.wall_rectangles(self.plan), layout.stair_rectangles(self.plan)])
        self._turning_room = distance_to(high) - _HAND_CLEARANCE
