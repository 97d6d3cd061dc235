"""Block: to stand in a stairwell."""

from __future__ import annotations

import math

from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

_THERE = 0.03  # metres; a base that rests so near to the landing's middle blocks it


class Block(Skill):
    """Stands in a stairwell. Done when the base is there; goes on standing as long as it is stepped.

    Attributes:
        stairwell: Its index.
        cell: Its landing.
    """

    def __init__(self, navigator: Navigator, stairwell: int):
        super().__init__(navigator)
        self.stairwell = stairwell
        self.cell = navigator.plan.stairwells[stairwell]

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)
        goal = self._navigator.centres[self.cell]
        status = self.driver.drive(view, robot, goal, self.cell, robot.yaw)
        there = status is Status.DONE or (math.dist(goal, view.base[:2]) < _THERE and not robot.moving)
        if status is Status.FAILED or not there:
            return status
        self.driver.patience.last_for_ever()  # it stays, even if it is pushed
        return Status.DONE
