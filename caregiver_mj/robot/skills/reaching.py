"""Shared by skills that pick up anywhere: the hand of a resting base stays out of the children's way."""

from __future__ import annotations

import abc
import math

import numpy as np

from caregiver_mj.robot.driver import TIME_OUT
from caregiver_mj.robot.kinematics import hand_position
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import Search, Stance
from caregiver_mj.robot.separation import is_child_at_arm, is_child_at_line
from caregiver_mj.robot.skills.skill import Skill
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
