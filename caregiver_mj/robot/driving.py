"""How the robot drives: to where a skill wants it, round the child or out of its way, never faster than it could stop.

Skills build on `Skill`, whose `_drive` is called once a control timestep. It plans a path, follows it at the rate that
the child allows, yields where robot and child are in each other's way, and gives up what the child keeps closed.

The ideas are those of ISO 13482 (a mobile servant robot avoids, slows down and stops) and of ISO/TS 15066 (speed and
separation); nothing here claims to comply with them.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.robot import limits
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import BASE_RADIUS, CHILD_RADIUS, Navigator
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.trajectories import PathError

# How near the base must be to where it shall stand.
_ARRIVED = 0.006  # metres
_ARRIVED_YAW = 0.012  # radians
# How far out the hand may be, as a share of its reach, when the base sets off and when it turns: it must meet no wall.
MAY_DRIVE = 0.62
_MAY_TURN = 0.30
# A tucked hand bears a candle 0.45 m out: so far apart, middle to middle, must base and child be to swing it round.
_TURNING_DISTANCE = 0.60  # metres

# Speed and separation: the base must be able to stop before a child that walks towards it.
_CHILD_SPEED = 0.62  # m/s, the fastest that a toddler walks towards something
_REACTION = 0.04  # seconds of control and servo until the base begins to brake
_SEPARATION = 0.08  # metres that shall remain
_SWITCHING_RATE = 0.6  # a base that the child has slowed down below this stops before it takes another path
_PATIENCE = 1.7  # seconds for which the robot gets out of the way of a child that comes: one novice timestep
_COMING_SPEED = 0.1  # m/s towards the robot
_COMING_GAP = 0.9  # metres
FORESIGHT = 2.2  # metres within which paths are planned round the child
_PASSING, _PASSING_GAP = 0.35, 0.4  # share of the speed that counts so at no distance, and metres where none does
_GENTLE_GAP = 0.10  # metres to the child below which the base yields to a push
# How a base to which the child has come too close may still leave: slower than a strike even if it led to the child.
_CREEP_SPEED = 0.04  # m/s
_CREEP_TOWARDS = 0.2  # cosine between motion and child, at most: what slides past and does not push

# Seconds without coming nearer to where it shall stand after which a skill gives up: six steps of a toddler. One that
# only goes by is gone sooner, and no detour in a house takes as long.
TIME_OUT = 10.0


@dataclasses.dataclass
class View:
    """What the robot sees at one moment, in metres and radians.

    Attributes:
        now: Seconds since the episode's start.
        base: Pose (x, y, yaw) of its base.
        fingers: How far the fingers stand off the middle, both together.
        arm: Joint positions (7,).
        child: Position (x, y) of the toddler.
        child_velocity: Its velocity, m/s.
        candles: Position of each candle's foot, (candles, 3).
        candle_orientations: Its orientation, a quaternion (w, x, y, z), (candles, 4).
    """

    now: float
    base: tuple[float, float, float]
    fingers: float
    arm: np.ndarray
    child: Vector
    child_velocity: Vector
    candles: np.ndarray
    candle_orientations: np.ndarray

    @property
    def candle_poses(self) -> np.ndarray:
        """Position and orientation of each candle, (candles, 7)."""
        return np.concatenate([self.candles, self.candle_orientations], axis=1)

    def candle_axis(self, candle: int) -> np.ndarray:
        """Unit vector (3,) from a candle's foot to its top, in the house."""
        w, x, y, z = self.candle_orientations[candle].tolist()
        return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


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
        may_turn = math.dist(view.child, view.base[:2]) > _TURNING_DISTANCE and (
            robot.turns_to(yaw) or self._navigator.can_turn(view.base[:2])
        )
        if may_turn and robot.hand_out <= _MAY_TURN:
            robot.turn_to(yaw)
        # Where the drive is shorter than the turn, the base sets off later: it would have to wait at the goal instead.
        waits = self._stops or (may_turn and not robot.moving and robot.time_left < robot.turn_left(yaw))
        robot.set_rate(0.0 if waits else allowed_rate(view, robot))
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
        litter = fallen_candle_cells(view, self._navigator) - {cell}
        under_way = self._leads_to(goal) and litter == self._litter
        self._litter = litter
        if under_way and robot.time_left > 0.0 and not self._crosses(view, robot):
            self._replan_at = view.now + 1.0
            return
        navigator = self._navigator
        here = robot.base_reference()[0]
        # A child far away will be elsewhere when the robot gets there.
        near = math.dist(view.child, here) < FORESIGHT
        child, closed = (view.child, child_cells(view, navigator)) if near else (None, set())
        points = navigator.path(here, goal, cell, child, closed | litter)
        if not points and litter:  # then over what lies there
            points = navigator.path(here, goal, cell, child, closed)
        self._replan_at = view.now + (1.0 if points else 0.3)
        if points:
            self._aside_until = -math.inf
        else:  # the child leaves no way
            if _comes(view):
                self._aside_until = view.now + _PATIENCE
            if view.now < self._aside_until:
                goal, points = self._step_aside(view, here)
            elif not under_way:  # follow it, as closely as it lets the robot
                points = navigator.path(here, goal, cell, None)
        if not points:
            return
        self._stops = robot.moving and allowed_rate(view, robot) < _SWITCHING_RATE
        if not self._stops:
            try:
                robot.drive_along(points, navigator.has_room)
            except PathError:
                self._stops = True
        if self._stops:
            self._path_goal, self._replan_at = None, view.now + 0.04
        else:
            self._path_goal = goal

    def _step_aside(self, view: View, here: Vector) -> tuple[Vector | None, list[Vector] | None]:
        """Where the robot is not in the child's way, and the path there; None to stay where it is."""
        navigator = self._navigator
        closed = child_cells(view, navigator)
        child = navigator.plan.cell_at(np.array(view.child))
        for start in (here, *navigator.ways_out(here, view.child, closed)):
            refuge = navigator.refuge(navigator.nearest_cell(start), child, closed)
            if refuge is None:
                break
            place = tuple(navigator.plan.position(refuge).tolist())
            if self._leads_to(place):
                break  # on its way there already
            if points := navigator.path(start, place, refuge, view.child, closed):
                return place, points if start is here else [here, *points]
        return None, None

    def _crosses(self, view: View, robot: RobotMotion) -> bool:
        """Whether the child stands in the way of the path ahead."""
        near = BASE_RADIUS + CHILD_RADIUS + 0.05
        return any(math.dist(point, place) < near for point in robot.points_ahead(1.5) for place in child_places(view))


def child_places(view: View) -> tuple[Vector, Vector]:
    """Where the child is, and where it will be shortly if it walks on."""
    (x, y), (vx, vy) = view.child, view.child_velocity
    return (x, y), (x + 0.8 * vx, y + 0.8 * vy)


def is_child_close(view: View) -> bool:
    """Whether the child is so close that the base must not push back when it is pushed."""
    return _gap(view) < _GENTLE_GAP


def child_cells(view: View, navigator: Navigator) -> set[Cell]:
    """The cells of these places."""
    return {navigator.plan.cell_at(np.array(place)) for place in child_places(view)}


def fallen_candle_cells(view: View, navigator: Navigator) -> set[Cell]:
    """The cells on whose floor candles lie."""
    low = view.candles[:, 2] < layout.TABLE_HEIGHT / 2
    return {navigator.plan.cell_at(place) for place in view.candles[low, :2]} if low.any() else set()


def allowed_rate(view: View, robot: RobotMotion) -> float:
    """The share of its planned speed at which the base can still stop before it touches the child.

    Speed and separation monitoring (the idea of ISO/TS 15066, section 5.5.4): while robot and child close in, the
    distance between them must cover what the robot needs to react and brake, and what the child walks meanwhile.
    At a rate r of its planned speed, stopping takes r * speed / deceleration + build-up seconds.

    Where no speed is low enough for that, the base may still leave: at any speed if it goes well away from the child,
    and at a creep if it slides past. Else the two could keep each other where they are: the child waits for the place
    in which the base waits for the child to go.
    """
    vx, vy = robot.planned_velocity()
    if vx == 0.0 and vy == 0.0:
        return 1.0
    dx, dy = view.child[0] - view.base[0], view.child[1] - view.base[1]
    gap = _gap(view) - _SEPARATION
    if gap > 2.0:
        return 1.0
    speed = math.hypot(vx, vy)
    approach = towards = (vx * dx + vy * dy) / math.hypot(dx, dy)
    # Close by, a path past the child counts as one that leads towards it: it may turn, and so may the path.
    approach += speed * _PASSING * min(1.0, max(0.0, 1.0 - gap / _PASSING_GAP))
    if approach <= 0.0:
        return 1.0
    # approach * r * (stopping / 2 + reaction) + child * (stopping + reaction) = gap, solved for r
    stopping = speed / limits.BASE.acceleration
    delay = _REACTION + limits.BASE.acceleration / limits.BASE.jerk
    a = approach * stopping / 2
    b = approach * delay + _CHILD_SPEED * stopping
    c = _CHILD_SPEED * delay - gap
    if c >= 0.0:
        return min(1.0, _CREEP_SPEED / speed) if towards <= _CREEP_TOWARDS * speed else 0.0
    return min(1.0, (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a))


def _comes(view: View) -> bool:
    """Whether the child walks towards the robot, or has just run into it."""
    gap = _gap(view)
    dx, dy = view.base[0] - view.child[0], view.base[1] - view.child[1]
    towards = (dx * view.child_velocity[0] + dy * view.child_velocity[1]) / math.hypot(dx, dy)
    return gap < 0.01 or (gap < _COMING_GAP and towards > _COMING_SPEED)


def _gap(view: View) -> float:
    """Metres between base and child."""
    return math.dist(view.child, view.base[:2]) - BASE_RADIUS - CHILD_RADIUS
