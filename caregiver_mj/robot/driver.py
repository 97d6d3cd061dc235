"""Driving: to the goal of a skill, round children or out of their way, never faster than the robot can stop.

A skill has a `Driver`, whose `drive` it calls at every step. It plans a path, follows it at the rate that the
children allow, yields where robot and child are in each other's way (or waits there, if it is not to yield), and gives
up what a child keeps closed.
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

# How near the base must be to where it shall stand.
ARRIVED = 0.006  # metres
ARRIVED_YAW = 0.012  # radians
# A base that creeps along a child, slower than this share, looks for a way off it.
_CREEPING_RATE = 0.3
_SAME = 0.05  # metres between the points of two ways below which they are one
_SWITCHING_RATE = 0.6  # a base that a child has slowed down below this stops before it takes another path
# Seconds until it looks at its way again: while it has one, while children leave it none, and while it stops.
_REPLAN_INTERVAL, _BARRED_INTERVAL, _STOPPING_INTERVAL = 1.0, 0.3, 0.04
_LOOK_AHEAD = 1.5  # seconds of the path that are looked at for children in the way
_LAST_OF_WAY = 5.0  # seconds that a base which has lost patience, but is on its way to the goal, may go on
_NEAR = 0.25  # metres ahead up to which it does not matter that it does not look where it goes
_WATCHES = 2.0  # metres from it within which it rather looks at a child than where it goes
_FACES_LOADED = 0.7  # the next, with a candle in the hand: in the picture
_FACES, _IN_TIME = 0.3, 1.8  # radians off a heading that will do, and seconds before the end in which it turns round
_PATIENCE = 1.7  # seconds for which the robot gets out of the way of a child that comes: one novice timestep
# Seconds, two of these, for which it keeps to a place out of the way of a child that stays so near, metres: one that
# follows it bars its way from there for ever, and opens it as it follows on.
_IN_VAIN, _STAYS = 3.4, 0.5
_TURNS = 12  # steps in which half a turn counts as progress
# Seconds without coming nearer after which it gives up: six steps of a toddler. One that only goes by is gone sooner,
# and no detour in a house takes as long.
TIME_OUT = 10.0


class Driver:
    """Drives the base to the goal of a skill.

    Attributes:
        goal: Position of the last plan's goal, (x, y), m; None before the first.
        cell: Its cell, or the one at whose border it is; None before the first plan.
        aside_until: Until when, in seconds, it gets out of the way of a child that leaves it no way; a past time if it
            does not.
        patience: Its progress watchdog.
        is_loaded: Whether it drives with a candle in the hand.
    """

    def __init__(self, navigator: Navigator, loaded: bool = False):
        """Prepare a driver.

        Args:
            navigator: Of the house and the robot.
            loaded: Whether there is a candle in the hand.
        """
        self.goal: Vector | None = None
        self.cell: Cell | None = None
        self.aside_until = -math.inf
        self.patience = Patience()
        self.is_loaded = loaded
        approach = navigator.robot.approach
        self._navigator, self._embodiment = navigator.loaded if loaded else navigator, navigator.robot
        self._may_drive = approach.drive_loaded if loaded else approach.drive  # so far out may the hand be
        self._path_goal: Vector | None = None  # where the present path ends
        self._way: list[Vector] = []  # the points of the present path
        self._replan_at = 0.0
        self._stops = False  # before it takes another path
        self._is_barred = False  # by children, when the way was last looked at
        self._hand: Vector | None = None  # from the base's middle, in the house, if something is in it
        self._led_off = 0  # how often the path had been given up when it was last looked at
        self._interrupted: float | None = None  # heading to which it was turning when a child came
        self._faces = math.nan  # heading in which it looks; at first none
        self._litter: set[Cell] = set()  # cells that the present path keeps clear of
        self._refuges: dict[Cell, float] = {}  # where it has got out of the way, and when it came to rest there

    def drive(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell, yaw: float | None = None) -> Status:
        """Drive until the next step.

        Args:
            view: What is seen.
            robot: What moves.
            goal: Where the base shall stand, metres.
            cell: The cell in which (or at whose border) that is.
            yaw: Its heading there, radians; None if any will do.

        Returns:
            DONE while the base is there. FAILED if it has lost patience, also if something keeps it from its work
            there.
        """
        moved = self.goal is None or math.dist(goal, self.goal) > 1e-3
        if robot.led_off != self._led_off:
            self._led_off, self._path_goal = robot.led_off, None
            self.replan()
        if (moved or self.looks_again(view.now)) and robot.hand_out <= self._may_drive:
            self._plan(view, robot, goal, cell)
        keeps = robot.yaw if yaw is None else yaw
        heading = keeps if view.gaze is None else self._heading(view, robot, goal, yaw)
        may_turn = self.turn(view, robot, heading)
        # Where the drive is shorter than the turn, the base sets off later: it would have to wait at the goal instead.
        # Nor does it set off to where it does not look.
        is_blind = view.gaze is not None and (self.is_loaded or not (view.children or view.hidden))
        is_blind = is_blind and abs(math.remainder(heading - view.base[2], math.tau)) > CAMERA_WIDTH / 2
        waits = may_turn and not robot.moving and (is_blind or robot.time_left < robot.turn_left(heading))
        robot.drives = 0.0 if self._stops or waits else 1.0
        moves = robot.moving
        if not moves and math.dist(goal, view.base[:2]) < ARRIVED:
            looks_round = yaw is None and view.gaze is not None
            turn = 0.0 if looks_round else abs(math.remainder(keeps - view.base[2], math.tau))
            # The rest of its turn counts as half a cell at most: a child may interrupt it again and again, and to turn
            # back to somewhere else would take as long. To arrive counts once, for a child may push it off as often.
            is_there = turn < ARRIVED_YAW
            self.patience.note(0.0 if is_there else 0.5 * math.ceil(_TURNS * turn / math.pi) / _TURNS, view.now)
            if is_there:
                return Status.FAILED if self.patience.is_over(view.now) else Status.DONE
        if not self.patience.is_over(view.now):
            return Status.RUNNING
        on_its_way = moves and self._leads_to(goal)
        return Status.FAILED if self.patience.is_over(view.now, _LAST_OF_WAY * on_its_way) else Status.RUNNING

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
        """The heading of a base that sees only ahead.

        At the end it is as it shall stand; before that it looks at a child nearby, or at where one may be, else where
        it goes. There it turns to its gaze. A candle in the hand slips at every turn: with one it only sees to it that
        it sees where it goes.
        """
        here, ahead = robot.base_reference()[0], robot.points_ahead(_LOOK_AHEAD)[-1]
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
        """Return a heading, or the one that it faces already if that is near enough."""
        if not abs(math.remainder(yaw - self._faces, math.tau)) <= (_FACES_LOADED if self.is_loaded else _FACES):
            self._faces = yaw
        return self._faces

    def _may_turn(self, view: View, robot: RobotMotion, yaw: float) -> bool:
        """Whether the base may turn where it is.

        A turn to this heading, once begun, goes on wherever the base has got to, but it stops while a child is close. A
        candle slips in the hand at every turn, so with one the base does not turn for a way that is closed.
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
        """Whether the base has no path, or stops before it takes another one: it takes that with the hand in only."""
        return self._stops or self._path_goal is None

    def stands_aside(self, now: float) -> bool:
        """Return whether it stands aside for a child that bars its way."""
        return now < self.aside_until

    def refuge(self, view: View, robot: RobotMotion, start: Cell) -> Cell | None:
        """Return where the robot is not in the children's way: elsewhere, once one has stayed by it there for long.

        Args:
            view: What is seen.
            robot: What moves.
            start: The cell from which it goes there.

        Returns:
            The cell, or None if no child is in a cell in which children can be.
        """
        plan, rests = self._navigator.plan, self._refuges
        if not robot.moving and gap(view, self._embodiment) < _STAYS:
            rests.setdefault(start, view.now)
        in_vain = [cell for cell, since in rests.items() if view.now > since + _IN_VAIN]
        children = [plan.cell_at(child.position) for child in view.children]
        refuge = self._navigator.refuge(start, children, child_cells(view.children, plan), in_vain)
        if refuge in in_vain:  # it has been everywhere
            rests.clear()
        return refuge

    def looks_again(self, now: float) -> bool:
        """Return whether a new plan is due."""
        return now >= self._replan_at

    def replan(self) -> None:
        """Request a new plan, because the world has changed."""
        self._replan_at = 0.0

    def _leads_to(self, goal: Vector, within: float = 1e-3) -> bool:
        """Whether the present path ends there, within so many metres."""
        return self._path_goal is not None and math.dist(goal, self._path_goal) < within

    def _plan(self, view: View, robot: RobotMotion, goal: Vector, cell: Cell) -> None:
        """Find a way, keeping to the present one as long as it leads to the goal and past the children."""
        self.goal, self.cell = goal, cell
        if self.is_loaded:
            self._hand = hand_offset(view, self._embodiment)
        self._note_progress(view, cell)
        litter = _littered_cells(view, self._navigator.plan) - {cell}
        under_way = self._leads_to(goal) and litter == self._litter
        self._litter = litter
        ahead = robot.points_ahead(_LOOK_AHEAD)
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
            self._stops, self._path_goal = True, None  # and stands there until they leave one
        else:
            if comes(view, self._embodiment):
                self.aside_until = view.now + _PATIENCE
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
        """Take a way that leads straight away from the child along which the base creeps, if there is one."""
        self._replan_at = view.now + _REPLAN_INTERVAL
        if robot.rate < _CREEPING_RATE and gap(view, self._embodiment) < BESIDE:
            self._replan_at = view.now + _BARRED_INTERVAL
            here, children = robot.base_reference()[0], [child.position for child in view.children]
            if self._navigator.brushes([here, robot.points_ahead(_LOOK_AHEAD)[-1]], children):
                points = self._way_past_children(view, here, goal, cell)
                if points and not self._navigator.brushes(points, children):
                    self._take(points, goal, view, robot)

    def _note_progress(self, view: View, cell: Cell) -> None:
        """Note the length of the shortest route to the cell, ignoring children."""
        route = self._navigator.route(self._navigator.nearest_cell(view.base[:2]), cell)
        self.patience.note(sys.maxsize if route is None else len(route), view.now)

    def _way_past_children(self, view: View, here: Vector, goal: Vector, cell: Cell) -> list[Vector] | None:
        """A way round the children that are near, and if possible round what lies on the floor; None if they bar it.

        A base that is there already needs none. Children on their way to a landing are what the base goes there for:
        while it is nearer, they bar it where they are, not where they are going. One between the base and the stairs
        would be shut in with them.
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
        """Take a way to a goal, or stop first if the base cannot turn into it; go on if it is on that way."""
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
        """Return the cell to wait in on a barred route: with a free cell between it and the children.

        At their heels it would keep them from turning round. None if it is too near already. Where it is in that cell,
        or they are on their way to stairs there, it goes on.
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

        Where they bar the path, too, it leaves them as far as it can: what stands beside a child is leaned on.
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
                return None, None  # on its way there already
            if points := navigator.path(start, place, refuge, children, closed, self._hand if start is here else None):
                return place, points if start is here else [here, *points]
        if not ways_out or (robot.time_left > 0.0 and self._leads_to(ways_out[0], _SAME)):
            return None, None
        return ways_out[0], [here, ways_out[0]]


def _rest(way: list[Vector], here: Vector) -> list[Vector]:
    """Return the points of a way that are still ahead of a base."""
    lines = range(len(way) - 1, 0, -1)
    passed = (i for i in lines if geometry.distance_to_line(here, way[i - 1], way[i]) < _SAME)
    return way[next(passed, 0) :]


def _are_the_same(way: list[Vector], other: list[Vector]) -> bool:
    return len(way) == len(other) and all(math.dist(*points) < _SAME for points in zip(way, other, strict=True))


def _littered_cells(view: View, plan: FloorPlan) -> set[Cell]:
    """Return the cells in which candles or small things lie on the floor."""
    low = view.candles[:, 2] < layout.TABLE_HEIGHT / 2
    cells = {plan.cell_at(place) for place in view.candles[low, :2]} if low.any() else set()
    return cells | {plan.cell_at(place) for place in view.things[~view.things_gone, :2]} if len(view.things) else cells


class Patience:
    """Progress watchdog: it ends unless the base comes nearer to its goal than ever before."""

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget the progress, because the goal has changed."""
        self._nearest = self._deadline = math.inf

    def note(self, left: float, now: float) -> None:
        """Note the length of the remaining route, in cells, at a time in seconds."""
        if left < self._nearest:
            self._nearest, self._deadline = left, now + TIME_OUT

    def last_for_ever(self) -> None:
        """Switch the watchdog off until the base comes nearer still."""
        self._deadline = math.inf

    def is_over(self, now: float, seconds: float = 0.0) -> bool:
        """Return whether its time ended more than some seconds ago."""
        return now > self._deadline + seconds
