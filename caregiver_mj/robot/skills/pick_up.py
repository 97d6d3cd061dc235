"""Pick up: take a small thing off the floor and put it into the robot's tray."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import sys
from collections.abc import Callable

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import TIME_OUT, Driver
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.kinematics import ATTEMPTS, Arm, arm_of, hand_position
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import LOW, TRAY_SPOTS, UP, share_at, tray_path
from caregiver_mj.robot.retrieval import RetrievalPlanner, Search, Stance
from caregiver_mj.robot.separation import gap_to
from caregiver_mj.robot.skills.retrieve import CHILD_BESIDE, Reaching
from caregiver_mj.robot.skills.skill import StandAside
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

_FEELING = 0.013  # m/s; speed of the fingertips that feel for the floor
# m/s; speed of a hand with the thing, of which the fingertips hold 3 mm: in a turn it slips outwards by half of the
# squared angle of every physics step, times the radius.
CARRYING, _TURNING = 0.5, 0.07  # the second while the tucked hand turns
_TURNS = 0.2  # rad/s; rate of the base's turns: slip 1 mm; at seven times that the thing is lost within half a turn
_TOUCHED = 0.0012  # m; height of the hand above its command at which the floor holds it up
_ON_FLOOR = 0.0015  # m; height of the fingertips at which that is the floor; above, it is the thing
_OVER_FLOOR = 0.0003  # m; height above the floor at which they close, below the thing's middle
_SETTLES, _FIRM, _FALLS = 0.15, 0.4, 0.4  # s; time of a hand to come to rest, a grip to hold, a thing to fall
AT_FLOOR = 2.4  # s; approximate time at the floor, to feel for it and to grip
_SQUEEZE = 0.0012  # m; each finger's command below the thing's radius, with their servos 2 to 5 N
_EMPTY = 0.0008  # m; total width below the thing's at which the fingers have closed on nothing
# m; distance of a child's centre from the hand's way between mid-air and tray within which the hand stops (a gap of
# 0.02 m), does not begin, and does not begin again.
_STOP, _BEGIN, _BEGIN_AGAIN = 0.23, 0.25, 0.27
# Nor does it if a child can walk there, m/s, before the hand is up again or, once down, stops, s. The base holds up a
# child within a gap, m, below a speed, m/s, and one that would pass its centre within a share of the footprint.
_WALKS, _DOWN_AND_UP, _STOPS, _HELD_UP, _STANDS, _BEHIND = 0.45, 2.7, 0.4, 0.15, 0.1, 0.7
_ANOTHER = 0.8  # rad; change of the heading away from the child that is worth another turn
_LINGERS = 3.0  # s; wait of the hand in mid-air for a child to go by
_LIFTS = 2.0  # s; children must not come beside the hand within that time while it grips and lifts
_IN_HAND = 0.15  # m; distance from the pinch point at which a held thing is seen, with delay and errors
_STRAYED = 0.006  # m; greatest distance of the thing from the stance's aim
_UNSURE = 0.01  # m; apparent distance outside of the tray of a thing in it


class PickUp(Reaching):
    """Picks up a small thing from the floor, and drops it into the tray. Done when it is seen there.

    The base rests while the arm is out. The hand feels for the floor, so that the fingers close below the middle of a
    thin thing. It stops while a child is near, and withdraws before one that comes. In mid-air it is above their heads.
    From there it goes down to the tray if no child is in its way; else the base drives away from the child with the
    hand tucked, turns the tray away from it, and leads a child that follows about. Failures are retried, three attempts
    in all.

    Attributes:
        thing: Number of the thing among those on the floor.
        tries: Number of times that the fingers have closed.
    """

    def __init__(self, navigator: Navigator, planner: RetrievalPlanner, thing: int):
        super().__init__(navigator)
        self.thing, self.tries = thing, 0
        self._planner = planner
        self._stance: Stance | None = None
        self._aim = np.zeros(3)
        self._stage: Callable[[View, RobotMotion], Status] = self._approach
        self._way: list[float] = []  # next poses of the hand on its path
        self._speed = math.inf  # greatest speed on it
        self._aside, self._yaw = StandAside(navigator), math.inf  # and its heading there
        self._is_at_tray = False  # whether the hand's path leads to the tray
        self._until, self._failures = 0.0, 0

    def _act(self, view: View, robot: RobotMotion) -> Status:
        return Status.COMMITTED if view.now < self._until else self._stage(view, robot)

    def _place(self, view: View) -> np.ndarray:
        return view.things[self.thing]

    def _approach(self, view: View, robot: RobotMotion) -> Status:
        """Drive to the stance, and begin to reach."""
        robot.reach(0.0)
        robot.grip(self.embodiment.grasp.open)
        if view.things_gone[self.thing]:
            return Status.DONE if self._is_in_tray(view) else Status.OVERTAKEN
        if self._failures == ATTEMPTS:
            return Status.FAILED
        if self._stance is None or math.dist(self._place(view), self._aim) > _STRAYED:
            return self._choose_stance(view)
        x, y, yaw = self._stance.base
        status = self.driver.drive(view, robot, (x, y), self._navigator.nearest_cell((x, y)), yaw)
        self._is_at_tray = False
        if status is not Status.DONE or robot.reached > 0.0 or self._child_comes(view):
            return Status.RUNNING if status is Status.DONE else status
        robot.reach_along(self._stance.path)
        goal = float(robot.reach_path.goal)
        self._begin(view, self._go_down, UP, share_at(arm_of(self.embodiment), robot.reach_path, LOW), goal)
        return Status.COMMITTED

    def _choose_stance(self, view: View) -> Status:
        patience = self.driver.patience
        patience.note(sys.maxsize, view.now)
        if patience.is_over(view.now):
            return Status.FAILED
        if self._search is None:
            self._stance, self._aim = None, self._place(view).copy()
            self.driver = Driver(self._navigator)  # for the new way
            self.driver.patience = patience
            self._search = Search(self._planner.to_pick_up_small(view, self.thing))
        if not self._search.go_on():
            return Status.RUNNING
        self._stance, self._search = self._search.found, None
        return Status.RUNNING if self._stance else Status.OUT_OF_REACH

    def _begin(self, view: View, stage: Callable[[View, RobotMotion], Status], *way: float) -> None:
        self._stage, self._way, self._since, self._speed = stage, list(way), view.now, math.inf

    def _go_down(self, view: View, robot: RobotMotion) -> Status:
        """Reach over the thing, and feel for the floor."""
        path, feels, comes = robot.reach_path, len(self._way) == 1, self._child_comes(view)
        if feels and self._height(view.arm) - self._height(path.joints(robot.reached)) > _TOUCHED:
            robot.stop_reaching()
            self._until, self._stage = view.now + _SETTLES, self._close
        elif view.things_gone[self.thing] or (comes and (robot.reached > UP or view.now > self._since + TIME_OUT)):
            self._withdraw(view, robot)
        elif (not comes or self._way[0] == UP) and self._goes_on(view, robot):
            if feels:  # no floor
                self._withdraw(view, robot)
            elif self._way == [path.goal]:
                depth = LOW - self._height(path.joints(path.goal))
                self._speed = _FEELING * (path.goal - robot.reached) / depth
        return Status.COMMITTED

    def _close(self, view: View, robot: RobotMotion) -> Status:
        """Go to just above the floor that the fingertips stand on."""
        floor = self._height(view.arm)
        # The base holds up a child behind it.
        ahead = tuple(child for child in view.children if geometry.to_local(view.base, child.position)[0] > 0.0)
        if self._child_within(dataclasses.replace(view, children=ahead), CHILD_BESIDE, _LIFTS):
            self._withdraw(view, robot)
            return Status.COMMITTED
        self.tries += 1
        if floor > _ON_FLOOR:
            self._withdraw(view, robot)
        else:
            robot.reach(share_at(arm_of(self.embodiment), robot.reach_path, floor + _OVER_FLOOR))
            self._until, self._stage = view.now + _SETTLES, self._grip
        return Status.COMMITTED

    def _grip(self, view: View, robot: RobotMotion) -> Status:
        robot.grip(layout.THING_RADIUS - _SQUEEZE)
        slower = robot.grip_time / self.embodiment.grasp.grip_time  # with inexact sensing
        self._until = view.now + slower * _FIRM
        self._carry(view, robot, self._lift, UP)
        self._since = -math.inf
        return Status.COMMITTED

    def _lift(self, view: View, robot: RobotMotion) -> Status:
        if self._height(view.arm) > LOW and not self._is_in_hand(view):
            self._let_go(view, robot)
        elif self._goes_on(view, robot) and not self._way:
            robot.reach_along(tray_path(arm_of(self.embodiment), self._free_spot(view)))
            self._is_at_tray = True
            self._carry(view, robot, self._put_in_tray, float(robot.reach_path.goal))
        return Status.COMMITTED

    def _put_in_tray(self, view: View, robot: RobotMotion) -> Status:
        """Go down to the tray and let go; stay in mid-air, or return there, while a child is in the way."""
        is_up, goal = robot.reached == UP, float(robot.reach_path.goal)
        near, seconds = (_BEGIN, _DOWN_AND_UP) if is_up else (_STOP, _STOPS)
        is_barred = self._way == [goal] and self._child_at_tray(view, near, seconds)
        if not self._is_in_hand(view):
            self._let_go(view, robot)
        elif is_barred and (not is_up or view.now > self._since + _LINGERS):
            self._aside, self._yaw = StandAside(self._navigator, moves_on=True), math.inf
            robot.turn_gently(_TURNS)  # else it slips out
            self._carry(
                view, robot, self._keep_away, *([] if is_up else [UP]), 0.0, speed=_TURNING if is_up else CARRYING
            )
            self._since = -math.inf  # creeps without delay
        elif is_barred:
            pass
        elif self._goes_on(view, robot):
            if self._way:
                self._carry(view, robot, self._put_in_tray, goal)
            else:
                self._let_go(view, robot)
        return Status.COMMITTED

    def _free_spot(self, view: View) -> float:
        """Return the spot of the tray, one of `TRAY_SPOTS`, farthest from its contents."""
        tray = self.embodiment.tray
        assert tray is not None  # required for the skill
        places = [(*geometry.to_local(view.base, (x, y)), z) for x, y, z in view.things.tolist()]
        lying = [place for place in places if tray.holds(place, _UNSURE)]
        return max(
            TRAY_SPOTS, key=lambda spot: min((math.dist(tray.along(spot), place) for place in lying), default=0.0)
        )

    def _let_go(self, view: View, robot: RobotMotion) -> None:
        robot.grip(self.embodiment.grasp.open)
        self._until = view.now + _FALLS
        self._withdraw(view, robot)

    def _keep_away(self, view: View, robot: RobotMotion) -> Status:
        """Drive away with the thing above the children's heads until none is in the hand's way to the tray."""
        if not self._is_in_hand(view):
            self._let_go(view, robot)
        elif self._way:
            if self._goes_on(view, robot) and self._way:
                self._carry(view, robot, self._keep_away, *self._way, speed=_TURNING)
        elif robot.moving or self._child_at_tray(view, _BEGIN_AGAIN, _DOWN_AND_UP):
            self._step_aside(view, robot)
        else:
            robot.stop_turning()
            self._carry(view, robot, self._put_in_tray, UP, float(robot.reach_path.goal), speed=_TURNING)
        return Status.COMMITTED

    def _step_aside(self, view: View, robot: RobotMotion) -> None:
        """Drive away from the children, and turn the tray's side away from the nearest, if need be at a creep."""
        (x, y), place = _way_to_tray(arm_of(self.embodiment))[2], view.base[:2]
        if not view.children:  # unseen ones may be anywhere
            self._aside.step(view, robot)
            return
        child = min((child.position for child in view.children), key=functools.partial(math.dist, place))
        yaw = math.atan2(place[1] - child[1], place[0] - child[0]) - math.atan2(y, x)
        if math.isinf(self._yaw) or abs(math.remainder(yaw - self._yaw, math.tau)) > _ANOTHER:
            self._yaw = yaw
        is_near = math.dist(child, place) <= self.embodiment.clearances.child_turning
        self._aside.yaw = None if is_near else self._yaw
        self._aside.step(view, robot)
        if is_near and self._navigator.clearance.can_turn(place):
            robot.turn_to(self._yaw)

    def _withdraw(self, view: View, robot: RobotMotion) -> None:
        """Retract the hand through the same poses, at a creep beside a child."""
        self._begin(view, self._come_back, *map(float, range(max(0, math.ceil(robot.reached) - 1), -1, -1)))
        self._since = -math.inf

    def _come_back(self, view: View, robot: RobotMotion) -> Status:
        if self._goes_on(view, robot) and not self._way:
            self._stage, self._stance = self._approach, None
            self._failures += 1  # no failure if it is in the tray
            self.driver.patience.begin_anew()
        return Status.COMMITTED

    def _carry(
        self,
        view: View,
        robot: RobotMotion,
        stage: Callable[[View, RobotMotion], Status],
        *way: float,
        speed: float = CARRYING,
    ) -> None:
        self._begin(view, stage, *way)
        self._speed = speed / robot.reach_path.longest(arm_of(self.embodiment), robot.reached, way[0])

    def _goes_on(self, view: View, robot: RobotMotion) -> bool:
        """Move the hand along its way; return whether it has just reached the next pose."""
        if max(robot.reached, self._way[0]) <= UP:  # above the children's heads
            robot.reach(self._way[0], speed=self._speed)
            is_there = robot.reached == self._way[0]
        else:
            is_there = self._reach(view, robot, self._way[0], self._speed)
        if is_there:
            del self._way[0]
        return is_there

    def _child_within(self, view: View, distance: float, seconds: float) -> bool:
        return (
            self._child_at_tray(view, _STOP, seconds)
            if self._is_at_tray
            else super()._child_within(view, distance, seconds)
        )

    def _child_at_tray(self, view: View, near: float, seconds: float) -> bool:
        """Return whether a child, unless behind the base, is or can soon be near the hand's way to the tray."""
        way = [geometry.to_world(view.base, place) for place in _way_to_tray(arm_of(self.embodiment))]
        near, middle = near + view.unsure, way[len(way) // 2]
        for child in view.children:
            if any(geometry.distance_to_line(child.position, *line) < near for line in itertools.pairwise(way)):
                return True
            past = geometry.distance_to_line(view.base[:2], child.position, middle)
            is_held_up = gap_to(view.base, self.embodiment, child) <= _HELD_UP and math.hypot(*child.velocity) < _STANDS
            off = geometry.distance_to_line(child.position, way[0], middle)
            if past > _BEHIND * self.embodiment.footprint and not is_held_up and off < near + _WALKS * seconds:
                return True
        return False

    def _height(self, joints: np.ndarray) -> float:
        """Return the height of the fingertips of a hand that points down, m."""
        return float(arm_of(self.embodiment).pinch(joints)[2]) - self.embodiment.fingertip

    def _is_in_hand(self, view: View) -> bool:
        """Return whether the fingers hold something, with the thing seen between them."""
        near = math.dist(self._place(view), hand_position(view, self.embodiment)) < _IN_HAND
        return near and view.fingers > 2 * layout.THING_RADIUS - _EMPTY

    def _is_in_tray(self, view: View) -> bool:
        x, y, z = self._place(view).tolist()
        tray = self.embodiment.tray
        return tray is not None and tray.holds((*geometry.to_local(view.base, (x, y)), z), _UNSURE)


@functools.cache
def _way_to_tray(arm: Arm) -> list[Vector]:
    """Return the hand's places from mid-air to the tray, (x, y) in the base's frame."""
    path = tray_path(arm)
    return [(x, y) for x, y, _ in (arm.pinch(path.joints(s)).tolist() for s in np.linspace(UP, path.goal, 5))]
