"""Paths for the base: shortest routes over cells, pulled tight round obstacles with a clearance."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Iterable, Sequence

import numpy as np

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import yielding
from caregiver_mj.robot import geometry
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.separation import BESIDE, LEAVING
from caregiver_mj.robot.view import CHILD_RADIUS

_CHILD_CLEARANCE = 0.20  # m; gap between base and child on a planned path
_STRAYS = 0.05  # m; deviation that a child may cause until the next plan
_ON_THE_WAY = 0.03  # m; distance from the line between two cells' centres at which a base is on its way between them
_WAY_OUT, _DIRECTIONS = 0.45, 16  # m; distance to leave a child beside the base first; directions to try


class Routes:
    """The cells of a house on which the base can stand, and shortest routes over them.

    Attributes:
        plan: The house.
        centres: Centre of each of these cells, m.
    """

    def __init__(self, plan: FloorPlan, landings: bool = True):
        """Prepare routes in a house; without `landings` the base must not stand on those of stairwells."""
        self.plan = plan
        cells = plan.caregiver_cells if landings else plan.free_cells
        self.centres: dict[Cell, Vector] = {cell: tuple(plan.position(cell).tolist()) for cell in cells}
        self._search = _search(plan)

    def nearest_cell(self, position: Vector) -> Cell:
        """Return the cell that the base stands on, or the nearest one that it can stand on."""
        cell = self.plan.cell_at(position)
        if cell in self.centres:
            return cell
        return min(self.centres, key=lambda c: math.dist(self.centres[c], position))

    def route(self, start: Cell, goal: Cell, closed: Collection[Cell] = ()) -> list[Cell] | None:
        """Return a shortest 4-connected route including its ends, or None; landings can only be ends."""
        if goal in closed:
            return None
        index, cells = self.plan.cell_index, self.plan.caregiver_cells
        next_cell = self._search(index[goal], self._indices({*closed, *self.plan.stairwells} - {start, goal}))
        here = index[start]
        if here not in next_cell:
            return None
        route = [start]
        while route[-1] != goal:
            here = next_cell[here]
            route.append(cells[here])
        return route

    def refuge(
        self, start: Cell, children: Iterable[Cell], closed: Collection[Cell], in_vain: Collection[Cell] = ()
    ) -> Cell | None:
        """Return the nearest of the reachable cells in which the robot is least in the children's way.

        Closed cells are not crossed. Cells `in_vain` come last; with several of these, which means that a child
        follows, dead ends come after other cells, too. None if no child is in a child's cell.
        """
        known = [self.plan.cell_index[child] for child in children if child in self.plan.free_cells]
        if not known:
            return None
        in_the_way, dead_ends = yielding(self.plan).in_the_way(known), yielding(self.plan).dead_ends
        # Nearest cells come first, and `min` takes the first of equals.
        landings = [cell for cell in self.plan.stairwells if cell not in self.centres]
        within_reach = self.plan.graph.breadth_first(self.plan.cell_index[start], self._indices({*closed, *landings}))
        been = self._indices(in_vain)

        def worth(cell: int) -> tuple[bool, bool, int]:
            return cell in been, bool(len(been) > 1 and dead_ends[cell]), in_the_way[cell]

        return self.plan.caregiver_cells[min(within_reach, key=worth)]

    def _indices(self, cells: Iterable[Cell]) -> frozenset[int]:
        """Return the indices of cells, except those on which the base cannot stand."""
        return frozenset(self.plan.cell_index[cell] for cell in cells if cell in self.plan.cell_index)


class Navigator(Routes):
    """Plans the paths of a robot's base in one house, from its floor plan alone.

    Attributes:
        robot: The robot.
        yields: Whether it makes room for children that leave it no way; else it waits where it is.
        clearance: The room that the house leaves.
        is_loaded: Whether a candle is in the hand, see `loaded`.
    """

    def __init__(
        self,
        plan: FloorPlan,
        robot: Embodiment,
        yields: bool = True,
        is_loaded: bool = False,
        clearance: Clearance | None = None,
    ):
        """Prepare a navigator of a robot in a house; its clearance is computed if not given."""
        super().__init__(plan, landings=not is_loaded)
        self.robot, self.yields, self.is_loaded = robot, yields, is_loaded
        self.clearance = clearance or Clearance(plan, robot)
        self._berth = robot.footprint + CHILD_RADIUS + _CHILD_CLEARANCE  # m, centre to centre
        self._beside = robot.footprint + CHILD_RADIUS + BESIDE  # m, the same

    @functools.cached_property
    def loaded(self) -> Navigator:
        """The same with a candle in the hand.

        It avoids the landings, even to make room: on most of them the candle would meet the panels beside the stairs,
        which are nearer to the base than the hand.
        """
        return Navigator(self.plan, self.robot, self.yields, is_loaded=True, clearance=self.clearance)

    def path(
        self,
        start: Vector,
        goal: Vector,
        goal_cell: Cell,
        children: Sequence[Vector] = (),
        closed: Collection[Cell] = (),
        hand: Vector | None = None,
    ) -> list[Vector] | None:
        """Return points of a polyline for the base from start to goal, m, or None without one.

        The goal is in a cell or at its border. Closed cells are not entered, children are given a wide berth. For the
        hand, which must have room where the base cannot turn, see `Clearance.line`.
        """
        path = self._path(start, goal, goal_cell, children, closed, hand)
        if path is None or self.brushes(path, children):
            ways_out = self.ways_out(start, children, closed, hand)
            rests = (self._path(out, goal, goal_cell, children, closed) for out in ways_out)
            path = next(([start, *rest] for rest in rests if rest), path)
        return path

    def brushes(self, path: list[Vector], children: Sequence[Vector]) -> bool:
        """Return whether a path begins so close to a child that the base would creep, without leading away from it."""
        if len(path) < 2:
            return False
        (x, y), (ahead_x, ahead_y) = path[:2]
        length = math.dist(path[0], path[1])
        for child_x, child_y in children:
            distance = math.hypot(child_x - x, child_y - y)
            towards = (ahead_x - x) * (child_x - x) + (ahead_y - y) * (child_y - y)
            if distance < self._beside and towards > LEAVING * length * distance:
                return True
        return False

    def _path(
        self,
        start: Vector,
        goal: Vector,
        goal_cell: Cell,
        children: Sequence[Vector],
        closed: Collection[Cell],
        hand: Vector | None = None,
    ) -> list[Vector] | None:
        """Plan a polyline along a shortest route over cells; the arguments are those of `path`."""
        start_cell = self.nearest_cell(start)
        cells = self.route(start_cell, goal_cell, closed)
        if cells is None:
            return None
        ends = {start_cell, goal_cell}
        shut = np.zeros(self.plan.shape, bool)
        for cell in {*closed, *self.plan.stairwells} - ends:
            shut[cell] = True
        # The centre of the base's own cell is the way out if nothing else is in sight.
        points = [start, *(self.centres[cell] for cell in cells[:-1]), goal]
        if len(points) > 2 and geometry.distance_to_line(start, *points[1:3]) < _ON_THE_WAY:
            del points[1]  # the base has already left it on this way
        last = self.centres[cells[-1]]
        if not self.visible(points[-2], goal) and self.visible(points[-2], last) and self.visible(last, goal):
            points.insert(-1, last)  # for a goal round a corner
        return self._pull_tight(points, children, shut, hand)

    def visible(
        self,
        a: Vector,
        b: Vector,
        children: Sequence[Vector] = (),
        shut: np.ndarray | None = None,
        hand: Vector | None = None,
    ) -> bool:
        """Return whether the base can drive straight from a to b, m, giving children a wide berth.

        It must not cross `shut` cells, bool (rows, columns). For the hand see `Clearance.line`.
        """
        line = self.clearance.line(a, b, hand)
        if line is None:
            return False
        x, y = line
        if shut is not None and shut.take(self._codes(x, y), mode="clip").any():
            return False
        for child in children:
            distance = np.hypot(x - child[0], y - child[1])
            if np.minimum.reduce(distance) < min(self._berth, distance[0] - 1e-6):
                return False
        return True

    def _pull_tight(
        self, points: Sequence[Vector], children: Sequence[Vector], shut: np.ndarray, hand: Vector | None
    ) -> list[Vector] | None:
        """Drop points between which a straight line is free; return None if a child is in the way."""
        kept = [points[0]]
        i = 0
        while i < len(points) - 1:
            j = len(points) - 1
            while j > i + 1 and not self.visible(points[i], points[j], children, shut, hand):
                j -= 1
            line = points[i], points[j]
            if j == i + 1 and not self.visible(*line, children, hand=hand) and self.visible(*line):
                return None
            kept.append(points[j])
            i, hand = j, None  # there the base can turn
        return kept

    def ways_out(
        self, start: Vector, children: Sequence[Vector], closed: Collection[Cell], hand: Vector | None = None
    ) -> list[Vector]:
        """Return where a base beside a child can go straight away from it: one place in each cell around.

        The farthest come first. Routes over cells are no help in a cell shared with a child. Closed cells are not
        entered; for the hand see `Clearance.line`. Without a child so close there are none.
        """

        def distance(place: Vector) -> float:
            return min((math.dist(place, child) for child in children), default=math.inf)

        if distance(start) >= self._berth:
            return []
        straight = [math.atan2(start[1] - y, start[0] - x) for x, y in children]
        angles = np.array([*straight, *(np.arange(_DIRECTIONS) * math.tau / _DIRECTIONS)])
        places = np.array(start) + _WAY_OUT * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        found: dict[Cell, Vector] = {}
        for place in sorted(map(tuple, places.tolist()), key=distance, reverse=True):
            cell = self.plan.cell_at(place)
            if cell in found or cell in closed or cell not in self.centres:
                continue
            # The hand turns with the base, and must not meet a wall.
            has_room = self.clearance.can_stand(place) and (
                not self.is_loaded or self.clearance.can_turn(place, _STRAYS)
            )
            if has_room and self.visible(start, place, children, hand=hand):
                found[cell] = place
        return list(found.values())

    def _codes(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        height, width = self.plan.shape
        column = np.rint(x / self.plan.cell_size + (width - 1) / 2).astype(int)
        row = np.rint((height - 1) / 2 - y / self.plan.cell_size).astype(int)
        return row * width + column


def _search(plan: FloorPlan) -> Callable[..., dict[int, int]]:
    """Return the plan's search, cached: far from children, consecutive plans share goal and closed cells."""
    return functools.lru_cache(maxsize=64)(plan.graph.breadth_first)
