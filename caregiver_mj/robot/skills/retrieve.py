"""Retrieve: pick up a fallen candle."""

from __future__ import annotations

import math
import sys

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.robot.driver import Driver
from caregiver_mj.robot.kinematics import ATTEMPTS, has_in_hand
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner, Search, Stance
from caregiver_mj.robot.skills.reaching import Reaching
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

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
