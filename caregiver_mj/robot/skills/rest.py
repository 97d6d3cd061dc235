"""Rest: to stay where one is."""

from __future__ import annotations

from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View


class Rest(Skill):
    """Comes to rest, with the hand in. Never done."""

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)  # a base that no skill drives stops by itself
        return Status.RUNNING
