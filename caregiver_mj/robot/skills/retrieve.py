"""Retrieve: pick up a fallen candle. Like all that picks up anywhere, keep the hand out of the children's way."""

from __future__ import annotations

import abc
import math
import sys

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.robot.driver import TIME_OUT, Driver
from caregiver_mj.robot.kinematics import ATTEMPTS, hand_position, has_in_hand
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner, Search, Stance
from caregiver_mj.robot.separation import is_child_at_arm, is_child_at_line
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

_STILL_TIME, _SHIFT = 0.3, 0.003  # s, m; time that the thing must have lain still, and apparent motion of a still one
_CHILD_AWAY = 1.2  # m; distance of all children from the thing for the hand to go there
_CHILD_COMES, _COMES_SOON = 0.7, 1.0  # m, s; the hand withdraws if a child may be so near within that time
_CHILD_NEAR, NEAR_SOON = 0.6, 0.4  # m, s; the same for going no farther
CHILD_BESIDE, _BESIDE_SOON = 0.3, 0.3  # m, s; the same for not moving at all, also beside the arm


class Reaching(Skill):
    """Reaches for a thing anywhere. The hand stops while a child is near."""

    def __init__(self, navigator: Navigator, loaded: bool = False):
        super().__init__(navigator, loaded)
        self._since = 0.0  # s; begin of reaching, gripping or withdrawing
        self._seen, self._seen_since = np.full(3, np.inf), 0.0
        self._search: Search[Stance | None] | None = None  # for a place to stand, under way

    @abc.abstractmethod
    def _place(self, view: View) -> np.ndarray:
        """Return the position of the thing, (3,)."""

    def _reach(
        self, view: View, robot: RobotMotion, pose: float, speed: float = math.inf, comes_back: bool = False
    ) -> bool:
        """Move the hand to a pose on its path, unless a child is near it; return whether it is there.

        Its speed on the path is limited. `comes_back` marks a return along poses that increase.
        """
        comes_back, creeps = comes_back or pose < robot.reached, view.now > self._since + TIME_OUT
        if comes_back:
            waits = self._child_within(view, CHILD_BESIDE, _BESIDE_SOON)
        else:
            waits = self._child_within(view, _CHILD_NEAR, NEAR_SOON)
        if not waits:
            robot.reach(pose, speed=speed)
        elif comes_back and creeps:
            robot.reach(pose, creeps=True)
        else:
            robot.stop_reaching()
        waits = robot.giving_way.is_off and view.now < robot.reach_arrival + TIME_OUT
        return robot.reached == pose and not waits

    def _child_within(self, view: View, distance: float, seconds: float) -> bool:
        """Return whether a child is, or may be within `seconds`, so near to the thing, the hand or the arm."""
        thing, hand = self._place(view)[:2].tolist(), hand_position(view, self.embodiment)[:2].tolist()
        return (
            is_child_at_line(view, thing, thing, distance, seconds)
            or is_child_at_line(view, hand, hand, distance, seconds)
            or is_child_at_arm(view, self.embodiment, CHILD_BESIDE, seconds)
        )

    def _child_comes(self, view: View) -> bool:
        """Return whether a child may soon be so near that the hand must withdraw."""
        return self._child_within(view, _CHILD_COMES, _COMES_SOON)

    def _is_alone(self, view: View) -> bool:
        places = self._place(view), hand_position(view, self.embodiment)
        return min(view.child_distance(place[:2]) for place in places) > _CHILD_AWAY

    def _lies_still(self, view: View) -> bool:
        place = self._place(view)
        if np.abs(place - self._seen).max() > _SHIFT:
            self._seen, self._seen_since = place.copy(), view.now
        return view.now - self._seen_since >= _STILL_TIME


_FIRM_GRIP_TIME = 0.3  # s; time of the fingers to hold firmly, or close on nothing
_CHOICE_INTERVAL = 1.0  # s between choices of a stance


class Retrieve(Reaching):
    """Picks up a lying candle, from a table or the floor, and tucks it upright.

    A candle that the arm cannot take so at once is first laid down on open floor, and picked up there. The base rests
    while the arm is out. The hand stops while a child is near, and withdraws before one that comes; failures are
    retried. Beside a child that stays, the hand finally returns at a creep. After a failure the candle may still be in
    the hand.

    Attributes:
        candle: Index of the candle.
        pitch_down: Pitch of the hand for laying down the candle in it, rad; None if it need not be. It is passed on to
            the skill that continues after a failure.
    """

    def __init__(self, navigator: Navigator, planner: RetrievalPlanner, candle: int, pitch_down: float | None = None):
        super().__init__(navigator, loaded=pitch_down is not None)
        self.candle, self.pitch_down = candle, pitch_down
        self._thing = layout.things(navigator.plan)[candle]
        if pitch_down is not None:
            self.status = Status.COMMITTED
        self._planner = planner
        self._stance: Stance | None = None
        self._steps: list[tuple[float, float | None]] = []  # of the hand: next pose on its path, gripper command there
        self._until = self._choose_at = 0.0
        self._failures = 0
        self._withdraws = False  # before a child

    def _place(self, view: View) -> np.ndarray:
        return view.candles[self.candle]

    def still_holds(self, view: View) -> bool:
        """Return whether, after a failure, a candle that must be laid down is in the hand."""
        return self.pitch_down is not None and has_in_hand(view, self.embodiment, self.candle, self._thing)

    def _act(self, view: View, robot: RobotMotion) -> Status:
        still = self._lies_still(view)
        holds = robot.closes and has_in_hand(view, self.embodiment, self.candle, self._thing)
        if not self._steps:
            return self._approach(view, robot, still, holds)
        goes_out = any(grip is not None for _, grip in self._steps)  # else only the return is left
        if not self._withdraws and goes_out and self._child_comes(view):
            self._withdraw(view, robot)
        if view.now < self._until or not self._reach(view, robot, self._steps[0][0]):
            return Status.COMMITTED
        _, grip = self._steps.pop(0)
        if grip is not None:
            robot.grip(grip)
            self._since, self._until = view.now, view.now + max(_FIRM_GRIP_TIME, robot.grip_time)
        elif not (still or robot.closes):
            del self._steps[: -round(robot.reached)]  # it has moved: come back without it
        return Status.COMMITTED if self._steps else self._end(holds)

    def _approach(self, view: View, robot: RobotMotion, still: bool, holds: bool) -> Status:
        """Drive to the stance for picking up or laying down, and begin to reach."""
        robot.reach(0.0)
        if not holds:
            robot.grip(self.embodiment.grasp.opened(self._thing))
        elif self.pitch_down is None:  # it only seemed lost after a bump
            return Status.DONE if robot.reached == 0.0 else Status.COMMITTED
        if self._stance is None or not (still or holds):
            return self._choose_stance(view, still, holds)
        x, y, yaw = self._stance.base
        arrival = self.driver.drive(view, robot, (x, y), self._navigator.nearest_cell((x, y)), yaw)
        if arrival is Status.FAILED:
            return arrival
        if arrival is Status.DONE and robot.reached == 0.0 and self._is_alone(view):
            robot.reach_along(self._stance.path)
            grasp, goal = self.embodiment.grasp, self._stance.path.goal
            grip = grasp.opened(self._thing) if holds else grasp.squeezed(self._thing)
            way = [(float(pose), None) for pose in range(1, goal)]
            self._steps = [*way, (float(goal), grip), *way[::-1], (0.0, None)]
            self._since = view.now
            return Status.COMMITTED
        return _unless_in_hand(holds)

    def _choose_stance(self, view: View, still: bool, holds: bool) -> Status:
        """Search for a stance to pick the candle up or lay it down; rarely, because a search takes long."""
        self._stance = None
        if self.driver.is_loaded != holds:
            self.driver = Driver(self._navigator, loaded=holds)
            self._search = None  # it was for the other task
        if not (still or holds):
            self._search = None
        patience = self.driver.patience
        patience.note(sys.maxsize, view.now)
        if self._search is None:  # a search under way ends by itself
            if patience.is_over(view.now):
                return Status.FAILED
            if not (still or holds) or view.now < self._choose_at:
                return _unless_in_hand(holds)
            self._choose_at = view.now + _CHOICE_INTERVAL
            self.driver = Driver(self._navigator, loaded=holds)  # for the new way
            self.driver.patience = patience
            planner, pitch = self._planner, self.pitch_down
            if holds:
                assert pitch is not None  # set by the pick-up
                self._search = Search(planner.to_lay_down(view, self.candle, pitch))
            else:
                self._search = Search(planner.to_pick_up(view, self.candle))
        if not self._search.go_on():
            return _unless_in_hand(holds)
        self._stance, self._search = self._search.found, None
        return Status.OUT_OF_REACH if self._stance is None and not holds else _unless_in_hand(holds)

    def _end(self, holds: bool) -> Status:
        assert self._stance is not None  # of the reach
        if not self._withdraws:
            self.pitch_down, self._stance = self._stance.pitch_down, None
            if holds and self.pitch_down is None:
                return Status.DONE
        self._withdraws = False
        self._failures += not holds  # or it has been laid down again
        self.driver.patience.begin_anew()
        return Status.FAILED if self._failures == ATTEMPTS else _unless_in_hand(holds)

    def _withdraw(self, view: View, robot: RobotMotion) -> None:
        """Retract the hand through the same poses, before a child walks into it."""
        last = max(0, math.ceil(robot.reached) - 1)
        self._steps = [(float(pose), None) for pose in range(last, -1, -1)]
        self._withdraws, self._since = True, view.now


def _unless_in_hand(holds: bool) -> Status:
    """Return an interruptible status, unless the candle is in the hand."""
    return Status.COMMITTED if holds else Status.RUNNING
