"""Driving: to the goal of a skill, round children or out of their way, never faster than the robot can stop.

A skill calls its `Driver.drive` at every step. The driver plans a path and follows it at the rate that the
children allow. Where robot and child block each other it yields, or waits if it must not yield. It gives up a goal that
children keep closed.
"""

from __future__ import annotations

import functools
import math
import sys

from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import CAMERA_WIDTH
from caregiver_mj.robot import geometry, governor
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import hand_offset
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.scalar_motion import PathError
from caregiver_mj.robot.separation import BESIDE, child_cells, comes, gap, is_in_the_way, near_children
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

ARRIVED = 0.006  # m; distance from the goal at which the base has arrived
ARRIVED_YAW = 0.012  # rad; the same of its heading
_CREEPING_RATE = 0.3  # share of the planned speed below which a base beside a child looks for a way off it
_SAME = 0.05  # m; distance between points below which two paths are the same
_SWITCHING_RATE = 0.6  # share of the planned speed below which the base stops before it takes another path
# s; time between plans: with a path, without one for children, and while stopping
_REPLAN_INTERVAL, _BARRED_INTERVAL, _STOPPING_INTERVAL = 1.0, 0.3, 0.04
LOOK_AHEAD = 1.5  # s; part of the path checked for children in the way, and for walls beside the hand
_LAST_OF_WAY = 5.0  # s; grace of the watchdog for a base on its way to the goal
_NEAR = 0.25  # m; distance that the base may drive without looking ahead
_WATCHES = 2.0  # m; range within which it looks at a child and not ahead
_FACES_LOADED = 0.7  # rad; the next with a candle in the hand: within the camera's picture
_FACES, _IN_TIME = 0.3, 1.8  # rad; accepted deviation of a heading. s; time before arrival to begin the final turn
PATIENCE = 1.7  # s; time to keep out of a coming child's way: one novice timestep
# m; distance of a child that stays with the base in its refuge for two of these, after which it tries another: a child
# that follows it bars its way from there for ever, and opens it as it follows on.
_STAYS = 0.5
_TURNS = 12  # steps of progress in half a turn
# s without progress until the watchdog ends: six moves of a toddler. A passing child is gone sooner, and no detour in a
# house takes as long.
TIME_OUT = 10.0


class Driver:
    """Drives the base to the goal of a skill.

    Attributes:
        goal: Position of the last plan's goal, (x, y), m; None before the first.
        cell: Its cell, or the one at whose border it is; None before the first plan.
        aside_until: Time until which it makes room for a child that leaves it no way, s; in the past if it does not.
        patience: Its progress watchdog.
        is_loaded: Whether it drives with a candle in the hand.
    """

    def __init__(self, navigator: Navigator, loaded: bool = False):
        """Prepare a driver for a navigator's house and robot, which is `loaded` with a candle in the hand."""
        self.goal: Vector | None = None
        self.cell: Cell | None = None
        self.aside_until = -math.inf
        self.patience = Patience()
        self.is_loaded = loaded
        approach = navigator.robot.approach
        self._navigator, self._embodiment = navigator.loaded if loaded else navigator, navigator.robot
        self._may_drive = approach.drive_loaded if loaded else approach.drive  # greatest extension of the hand
        self._path_goal: Vector | None = None  # end of the present path
        self._way: list[Vector] = []  # points of the present path
        self._replan_at = 0.0
        self._stops = False  # stops before another path
        self._is_barred = False  # by children, at the last plan
        self._hand: Vector | None = None  # offset from the base's centre in the house's axes, if loaded
        self._led_off = 0  # `robot.led_off` at the last look
        self._interrupted: float | None = None  # goal of a turn that a child interrupted
        self._faces = math.nan  # heading in which it looks
        self._litter: set[Cell] = set()  # littered cells that the present path avoids
        self._refuges: dict[Cell, float] = {}  # time of rest in each refuge, s

    def drive(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell, yaw: float | None = None) -> Status:
        """Drive until the next step.

        Args:
            view: The robot's view.
            robot: The robot's references.
            goal: Goal of the base, m.
            cell: The goal's cell, or the one at whose border it is.
            yaw: Heading at the goal, rad; None for any.

        Returns:
            DONE while the base is there. FAILED once the watchdog has ended, also there, if work does not progress.
        """
        moved = self.goal is None or math.dist(goal, self.goal) > 1e-3
        if robot.led_off != self._led_off:
            self._led_off, self._path_goal = robot.led_off, None
            self.replan()
        if (moved or self.looks_again(view.now)) and robot.hand_out <= self._may_drive:
            self._plan(view, robot, goal, cell)
        keeps = robot.yaw if yaw is None else yaw
        heading = keeps if view.gaze is None else self._heading(view, robot, goal, yaw)
        moves, is_turned = robot.moving, heading == robot.yaw and robot.turning == (0.0, 0.0)
        may_turn = not is_turned and self.turn(view, robot, heading)
        # Set off late if the turn takes longer than the drive, and never in a direction out of view.
        is_blind = view.gaze is not None and (self.is_loaded or not (view.children or view.hidden))
        is_blind = is_blind and abs(math.remainder(heading - view.base[2], math.tau)) > CAMERA_WIDTH / 2
        waits = may_turn and not moves and (is_blind or robot.time_left < robot.turn_left(heading))
        robot.drives = 0.0 if self._stops or waits else 1.0
        if not moves and math.dist(goal, view.base[:2]) < ARRIVED:
            looks_round = yaw is None and view.gaze is not None
            turn = 0.0 if looks_round else abs(math.remainder(keeps - view.base[2], math.tau))
            # The rest of the turn counts as up to half a cell, so that its progress delays the watchdog although a
            # child interrupts it. Arrival counts once: a child may push the base off again and again.
            is_there = turn < ARRIVED_YAW
            self.patience.note(0.0 if is_there else 0.5 * math.ceil(_TURNS * turn / math.pi) / _TURNS, view.now)
            if is_there:
                return Status.FAILED if self.patience.is_over(view.now) else Status.DONE
        grace = _LAST_OF_WAY if moves and self._leads_to(goal) else 0.0
        return Status.FAILED if self.patience.is_over(view.now, grace) else Status.RUNNING

    def turn(self, view: View, robot: RobotMotion, yaw: float) -> bool:
        """Turn to a heading, rad, if the base may turn and the hand is in; return whether the base may turn."""
        may_turn = self._may_turn(view, robot, yaw)
        if may_turn and robot.hand_out <= self._embodiment.approach.turn:
            robot.turn_to(yaw)
        return may_turn

    def look(self, view: View, robot: RobotMotion) -> None:
        """Turn to the best heading to look for children, unless the robot sees all round."""
        if view.gaze is not None:
            self.turn(view, robot, self._facing(view.gaze))

    def _heading(self, view: View, robot: RobotMotion, goal: Vector, yaw: float | None) -> float:
        """Return the heading of a base with a narrow view, rad.

        Near the end it is `yaw`. Before, the base looks at a near child or its possible place, else ahead; at the goal,
        along its gaze. With a candle, which slips at every turn, it only keeps its direction of motion in view.
        """
        here, ahead = robot.base_reference()[0], robot.points_ahead(LOOK_AHEAD)[-1]
        is_there = math.dist(here, goal) < _NEAR
        if yaw is not None and (is_there or 0.0 < robot.time_left < _IN_TIME):
            return yaw
        places = () if self.is_loaded else (child.position for child in view.children + view.hidden)
        nearest = min(places, key=lambda place: math.dist(place, here), default=ahead)
        x, y = nearest if math.dist(nearest, here) < _WATCHES else ahead
        if self.is_loaded:
            robot.turn_gently()
        if not is_there and math.dist((x, y), here) > _NEAR:
            return self._facing(math.atan2(y - here[1], x - here[0]))
        return robot.yaw if self.is_loaded or view.gaze is None else self._facing(view.gaze)

    def _facing(self, yaw: float) -> float:
        """Return a heading, or the present one if that is near enough."""
        if not abs(math.remainder(yaw - self._faces, math.tau)) <= (_FACES_LOADED if self.is_loaded else _FACES):
            self._faces = yaw
        return self._faces

    def _may_turn(self, view: View, robot: RobotMotion, yaw: float) -> bool:
        """Return whether the base may turn where it is.

        A turn once begun continues anywhere, but stops while a child is close. With a candle, which slips at every
        turn, the base does not turn for a closed way.
        """
        if view.child_distance(view.base[:2]) <= self._embodiment.clearances.child_turning:
            if robot.turns_to(yaw) and robot.turn_left(yaw) > 0.0:
                self._interrupted = yaw
                robot.stop_turning()
            return False
        if self.is_loaded and self._is_barred:
            return False
        begun = robot.turns_to(yaw) or yaw == self._interrupted
        return begun or self._navigator.clearance.can_turn(view.base[:2])

    @property
    def stops_first(self) -> bool:
        """Whether the base has no path, or stops before another one, which it takes only with the hand in."""
        return self._stops or self._path_goal is None

    def stands_aside(self, now: float) -> bool:
        """Return whether it stands aside for a child that bars its way."""
        return now < self.aside_until

    def refuge(self, view: View, robot: RobotMotion, start: Cell) -> Cell | None:
        """Return a cell out of the children's way, or None if no child is in a child's cell.

        It is the best one from the cell `start`, or another once a child has stayed near the present one for long.
        """
        plan, rests = self._navigator.plan, self._refuges
        if not robot.moving and gap(view, self._embodiment) < _STAYS:
            rests.setdefault(start, view.now)
        in_vain = [cell for cell, since in rests.items() if view.now > since + 2 * PATIENCE]
        children = [plan.cell_at(child.position) for child in view.children]
        refuge = self._navigator.refuge(start, children, child_cells(view.children, plan), in_vain)
        if refuge in in_vain:  # all have been tried
            rests.clear()
        return refuge

    def looks_again(self, now: float) -> bool:
        """Return whether a new plan is due."""
        return now >= self._replan_at

    def replan(self) -> None:
        """Request a new plan, because the world has changed."""
        self._replan_at = 0.0

    def _leads_to(self, goal: Vector, within: float = 1e-3) -> bool:
        """Return whether the present path ends within a distance of the goal, m."""
        return self._path_goal is not None and math.dist(goal, self._path_goal) < within

    def _plan(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell) -> None:
        """Find a path, keeping the present one as long as it leads to the goal and past the children."""
        self.goal, self.cell = goal, cell
        if self.is_loaded:
            self._hand = hand_offset(view, self._embodiment)
        # Progress is the length of the shortest route, ignoring children.
        route = self._navigator.route(self._navigator.nearest_cell(view.base[:2]), cell)
        self.patience.note(sys.maxsize if route is None else len(route), view.now)
        litter = _littered_cells(view, self._navigator.plan) - {cell}
        under_way = self._leads_to(goal) and litter == self._litter
        self._litter = litter
        ahead = robot.points_ahead(LOOK_AHEAD)
        if under_way and robot.time_left > 0.0 and not is_in_the_way(view, self._embodiment, ahead):
            self._is_barred = False
            self._leave(view, robot, goal, cell)
            return
        here = robot.base_reference()[0]
        points = self._way_past_children(view, here, goal, cell)
        if points and self._is_barred:
            self._refuges.clear()
        self._is_barred = not points
        self._replan_at = view.now + (_REPLAN_INTERVAL if points else _BARRED_INTERVAL)
        if points:
            self.aside_until = -math.inf
        elif not self._navigator.yields:
            self._stops, self._path_goal = True, None  # stop until they leave a way
        else:
            if comes(view, self._embodiment):
                self.aside_until = view.now + PATIENCE
            wait = None if self.stands_aside(view.now) else self._waiting_cell(view, here, cell)
            if wait is None:
                aside, points = self._step_aside(view, robot, here)
                goal = aside or goal
            else:
                goal = goal if wait == cell else self._navigator.centres[wait]
                if not self._leads_to(goal):
                    points = self._navigator.path(here, goal, wait, hand=self._hand)
        if points:
            self._take(points, goal, view, robot)

    def _leave(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell) -> None:
        """Take a path straight away from a child along which the base creeps, if there is one."""
        self._replan_at = view.now + _REPLAN_INTERVAL
        if robot.rate < _CREEPING_RATE and gap(view, self._embodiment) < BESIDE:
            self._replan_at = view.now + _BARRED_INTERVAL
            here, children = robot.base_reference()[0], [child.position for child in view.children]
            if self._navigator.brushes([here, robot.points_ahead(LOOK_AHEAD)[-1]], children):
                points = self._way_past_children(view, here, goal, cell)
                if points and not self._navigator.brushes(points, children):
                    self._take(points, goal, view, robot)

    def _way_past_children(self, view: View, here: Vector, goal: Vector, cell: Cell) -> list[Vector] | None:
        """Return a path round near children and, if possible, things on the floor; None if children bar it.

        None is needed at the goal. On its way to a landing, a base that is nearer to it than all children is barred by
        their present cells only: where they are heading is what it wants to block. A child between base and stairs
        would be shut in.
        """
        plan, near = self._navigator.plan, near_children(view, here)
        children, closed = [child.position for child in near], child_cells(near, plan)
        cells = set(map(plan.cell_at, children))
        if math.dist(here, goal) < _SAME and cell not in cells:
            return [here, goal]
        points = self._navigator.path(here, goal, cell, children, closed | self._litter, self._hand)
        if not points and self._litter:
            points = self._navigator.path(here, goal, cell, children, closed, self._hand)
        nearest = min((math.dist(child, goal) for child in children), default=math.inf)
        if not points and cell in plan.stairwells and math.dist(here, goal) < nearest:
            points = self._navigator.path(here, goal, cell, closed=cells, hand=self._hand)
        return points

    def _take(self, points: list[Vector], goal: Vector, view: View, robot: RobotMotion) -> None:
        """Take a path to a goal, unless it is the present one; stop first if the base cannot turn into it."""
        if self._leads_to(goal) and robot.time_left > 0.0 and _are_the_same(points[1:], _rest(self._way, points[0])):
            return
        self._stops = robot.moving and governor.path_rate(view, robot) < _SWITCHING_RATE
        if not self._stops:
            try:
                robot.drive_along(points, functools.partial(self._navigator.clearance.has_room, hand=self._hand))
            except PathError:
                self._stops = True
        if self._stops:
            self._path_goal, self._replan_at = None, view.now + _STOPPING_INTERVAL
        else:
            self._path_goal, self._way = goal, points[1:]

    def _waiting_cell(self, view: View, here: Vector, cell: Cell) -> Cell | None:
        """Return the cell to wait in on a barred route, with a free cell between it and the children.

        At their heels it would keep them from turning round. It is None if the base is too near already, and the goal's
        cell if the base is there, or no child bars the route. Children heading for stairs do not bar those.
        """
        plan = self._navigator.plan
        there = {plan.cell_at(child.position) for child in view.children}
        children = child_cells(view.children, plan) - ({*plan.stairwells} - there)
        route = self._navigator.route(self._navigator.nearest_cell(here), cell) or []
        barred = next((i for i, place in enumerate(route) if place in children), None)
        if barred is None or len(route) == 1:
            return cell
        return route[barred - 2] if barred >= 2 else None

    def _step_aside(self, view: View, robot: RobotMotion, here: Vector) -> tuple[Vector | None, list[Vector] | None]:
        """Return a refuge out of the children's way and the path there, or None to stay.

        If they bar the path, too, it is a place as far from them as possible: a child leans on a base beside it.
        """
        navigator, plan = self._navigator, self._navigator.plan
        closed = child_cells(view.children, plan)
        children = [child.position for child in view.children]
        ways_out = navigator.ways_out(here, children, closed, self._hand)
        for start in (here, *ways_out):
            refuge = self.refuge(view, robot, navigator.nearest_cell(start))
            if refuge is None:
                return None, None
            place = tuple(plan.position(refuge).tolist())
            if self._leads_to(place):
                return None, None  # already on its way
            if points := navigator.path(start, place, refuge, children, closed, self._hand if start is here else None):
                return place, points if start is here else [here, *points]
        if not ways_out or (robot.time_left > 0.0 and self._leads_to(ways_out[0], _SAME)):
            return None, None
        return ways_out[0], [here, ways_out[0]]


def _rest(way: list[Vector], here: Vector) -> list[Vector]:
    """Return the points of a path still ahead of a base."""
    lines = range(len(way) - 1, 0, -1)
    passed = (i for i in lines if geometry.distance_to_line(here, way[i - 1], way[i]) < _SAME)
    return way[next(passed, 0) :]


def _are_the_same(way: list[Vector], other: list[Vector]) -> bool:
    return len(way) == len(other) and all(math.dist(*points) < _SAME for points in zip(way, other, strict=True))


def _littered_cells(view: View, plan: FloorPlan) -> set[Cell]:
    low = view.candles[:, 2] < layout.TABLE_HEIGHT / 2
    cells = {plan.cell_at(place) for place in view.candles[low, :2]} if low.any() else set()
    return cells | {plan.cell_at(place) for place in view.things[~view.things_gone, :2]} if len(view.things) else cells


class Patience:
    """Progress watchdog: it ends after `TIME_OUT` without a new least distance from the goal."""

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget the progress, after a change of goal."""
        self._nearest = self._deadline = math.inf

    def note(self, left: float, now: float) -> None:
        """Record the remaining route, in cells, at a time, s."""
        if left < self._nearest:
            self._nearest, self._deadline = left, now + TIME_OUT

    def last_for_ever(self) -> None:
        """Switch the watchdog off until the next progress."""
        self._deadline = math.inf

    def is_over(self, now: float, seconds: float = 0.0) -> bool:
        """Return whether its time ended more than `seconds` ago."""
        return now > self._deadline + seconds
