"""What all skills have in common."""

from __future__ import annotations

import abc

from caregiver_mj.robot.driver import Driver
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View


class Skill(abc.ABC):
    """Something that the robot can do.

    Attributes:
        embodiment: The robot that does it.
        driver: Drives it to where it wants to stand.
        status: What its last step has come to; RUNNING before the first.
    """

    def __init__(self, navigator: Navigator, loaded: bool = False):
        """Prepares a skill.

        Args:
            navigator: Of the house and the robot.
            loaded: Whether there is a candle in the hand.
        """
        self.embodiment = navigator.robot
        self.driver = Driver(navigator, loaded)
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
