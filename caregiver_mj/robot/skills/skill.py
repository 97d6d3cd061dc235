"""What all skills have in common."""

from __future__ import annotations

import abc

from caregiver_mj.robot.driver import MAY_DRIVE, Driver
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View


class Skill(abc.ABC):
    """Something that the robot can do.

    Attributes:
        driver: Drives it to where it wants to stand.
        status: What its last step has come to; RUNNING before the first.
    """

    def __init__(self, navigator: Navigator, may_drive: float = MAY_DRIVE):
        """Prepares a skill.

        Args:
            navigator: Of the house.
            may_drive: How far out the hand may be, as a share of its reach, when the base sets off.
        """
        self.driver = Driver(navigator, may_drive)
        self.status = Status.RUNNING
        self._navigator = navigator

    def step(self, view: View, robot: RobotMotion) -> Status:
        """Acts for one control timestep. What has ended is not stepped any more, except for `Block`."""
        self.status = self._act(view, robot)
        return self.status

    def replan(self) -> None:
        """Has the way looked at again, because the world has changed."""
        self.driver.replan()

    @property
    def is_approaching(self) -> bool:
        """Whether it is still on its way; else the hand is at work."""
        return True

    @abc.abstractmethod
    def _act(self, view: View, robot: RobotMotion) -> Status:
        """Sets goals for one control timestep."""
