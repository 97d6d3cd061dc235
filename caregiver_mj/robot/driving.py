"""How the robot drives: to where a skill wants it, round children or out of their way, never faster than it could stop.

Skills build on `Skill`, whose `_drive` is called once a control timestep. It plans a path, follows it at the rate that
the child allows, yields where robot and child are in each other's way, and gives up what the child keeps closed.

The ideas are those of ISO 13482 (a mobile servant robot avoids, slows down and stops) and of ISO/TS 15066 (speed and
separation); nothing here claims to comply with them.
"""

from __future__ import annotations

import math

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.separation import allowed_rate, child_cells, comes, is_in_the_way, near_children
from caregiver_mj.robot.trajectories import PathError
from caregiver_mj.robot.view import View

# How near the base must be to where it shall stand.
_ARRIVED = 0.006  # metres
_ARRIVED_YAW = 0.012  # radians
# How far out the hand may be, as a share of its reach, when the base sets off and when it turns: it must meet no wall.
MAY_DRIVE = 0.62
_MAY_TURN = 0.30
# A tucked hand bears a candle 0.45 m out: so far apart, middle to middle, must base and child be to swing it round.
_TURNING_DISTANCE = 0.60  # metres

_SWITCHING_RATE = 0.6  # a base that a child has slowed down below this stops before it takes another path
_LOOK_AHEAD = 1.5  # seconds of the path that are looked at for children in the way
_PATIENCE = 1.7  # seconds for which the robot gets out of the way of a child that comes: one novice timestep

# Seconds without coming nearer to where it shall stand after which a skill gives up: six steps of a toddler. One that
# only goes by is gone sooner, and no detour in a house takes as long.
TIME_OUT = 10.0


class Skill:
    """Base of all skills: drives to where the skill wants to stand.

    Attributes:
        interruptible: Whether another skill may take over now.
        failed: Whether it is done without having achieved what it is for.
        overtaken: Whether it is done because the world has changed, and its aim with it.
    """

    interruptible = True
    failed = False
    overtaken = False
    _may_drive = MAY_DRIVE

    def __init__(self, navigator: Navigator):
        self._navigator = navigator
        self._asked: Vector | None = None  # where the skill wants to be, ...
        self._path_goal: Vector | None = None  # ... and where the present path ends
        self._stand: Cell | None = None
        self._replan_at = 0.0
        self._stops = False  # before it takes another path
        self._litter: set[Cell] = set()  # cells that the present path keeps clear of
        self._aside_until = -math.inf  # when it may block a child's way again
        self._nearest = math.inf  # how near it has come to where it shall stand, in cells of the way
        self._deadline = math.inf  # when it gives up unless it comes nearer

    def step(self, view: View, robot: RobotMotion) -> bool:
        """Acts for one control timestep; returns whether the skill is done, or has failed."""
        raise NotImplementedError

    def replan(self) -> None:
        """Has the way looked at again, because the world has changed."""
        self._replan_at = 0.0

    def _drive(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell, yaw: float) -> bool:
        """Drives to a pose; returns whether it is there. Fails if it has come no nearer for `TIME_OUT`, and stops."""
        moved = self._asked is None or math.dist(goal, self._asked) > 1e-3
        if (moved or view.now >= self._replan_at) and robot.hand_out <= self._may_drive:
            self._plan(view, robot, goal, cell)
        # A turn once begun goes on, wherever the base has got to.
        may_turn = view.child_distance(view.base[:2]) > _TURNING_DISTANCE and (
            robot.turns_to(yaw) or self._navigator.clearance.can_turn(view.base[:2])
        )
        if may_turn and robot.hand_out <= _MAY_TURN:
            robot.turn_to(yaw)
        # Where the drive is shorter than the turn, the base sets off later: it would have to wait at the goal instead.
        waits = self._stops or (may_turn and not robot.moving and robot.time_left < robot.turn_left(yaw))
        robot.set_rate(0.0 if waits else allowed_rate(view, robot.planned_velocity()))
        off = math.dist(goal, view.base[:2])
        turn = abs(math.remainder(yaw - view.base[2], math.tau))
        there = off < _ARRIVED and turn < _ARRIVED_YAW and not robot.moving
        if there:
            self._deadline = view.now + TIME_OUT
        elif view.now > self._deadline and not (robot.moving and self._leads_to(goal)):
            self.failed = True
        return there

    def _leads_to(self, goal: Vector) -> bool:
        """Whether the present path ends there."""
        return self._path_goal is not None and math.dist(goal, self._path_goal) < 1e-3

    def _note_progress(self, view: View, cell: Cell) -> None:
        """Puts the deadline off if the base is nearer to its cell than before, by a way that knows no child."""
        route = self._navigator.route(self._navigator.nearest_cell(view.base[:2]), cell)
        if route is not None and len(route) < self._nearest:
            self._nearest, self._deadline = len(route), view.now + TIME_OUT

    def _plan(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell) -> None:
        """Finds a way, keeping to the present one as long as it leads to the goal and past the child."""
        self._asked = goal
        self._note_progress(view, cell)
        litter = _fallen_candle_cells(view, self._navigator.plan) - {cell}
        under_way = self._leads_to(goal) and litter == self._litter
        self._litter = litter
        if under_way and robot.time_left > 0.0 and not is_in_the_way(view, robot.points_ahead(_LOOK_AHEAD)):
            self._replan_at = view.now + 1.0
            return
        navigator = self._navigator
        here = robot.base_reference()[0]
        near = near_children(view, here)
        children, closed = [child.position for child in near], child_cells(near, navigator.plan)
        points = navigator.path(here, goal, cell, children, closed | litter)
        if not points and litter:  # then over what lies there
            points = navigator.path(here, goal, cell, children, closed)
        self._replan_at = view.now + (1.0 if points else 0.3)
        if points:
            self._aside_until = -math.inf
        else:  # the children leave no way
            if comes(view):
                self._aside_until = view.now + _PATIENCE
            if view.now < self._aside_until:
                goal, points = self._step_aside(view, here)
            elif not under_way:  # follow them, as closely as they let the robot
                points = navigator.path(here, goal, cell)
        if not points:
            return
        self._stops = robot.moving and allowed_rate(view, robot.planned_velocity()) < _SWITCHING_RATE
        if not self._stops:
            try:
                robot.drive_along(points, navigator.clearance.has_room)
            except PathError:
                self._stops = True
        if self._stops:
            self._path_goal, self._replan_at = None, view.now + 0.04
        else:
            self._path_goal = goal

    def _step_aside(self, view: View, here: Vector) -> tuple[Vector | None, list[Vector] | None]:
        """Where the robot is not in the children's way, and the path there; None to stay where it is."""
        navigator, plan = self._navigator, self._navigator.plan
        closed = child_cells(view.children, plan)
        children = [child.position for child in view.children]
        for start in (here, *navigator.ways_out(here, children, closed)):
            refuge = navigator.refuge(navigator.nearest_cell(start), map(plan.cell_at, children), closed)
            if refuge is None:
                break
            place = tuple(plan.position(refuge).tolist())
            if self._leads_to(place):
                break  # on its way there already
            if points := navigator.path(start, place, refuge, children, closed):
                return place, points if start is here else [here, *points]
        return None, None


def _fallen_candle_cells(view: View, plan: FloorPlan) -> set[Cell]:
    """The cells on whose floor candles lie."""
    low = view.candles[:, 2] < layout.TABLE_HEIGHT / 2
    return {plan.cell_at(place) for place in view.candles[low, :2]} if low.any() else set()
