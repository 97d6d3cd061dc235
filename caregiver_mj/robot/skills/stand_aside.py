"""Stand aside: to be in nobody's way."""

from __future__ import annotations

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.separation import child_cells
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View


class StandAside(Skill):
    """Keeps out of the children's way, for as long as there is nothing else to do. Never done.

    Attributes:
        cell: Where it keeps; None before the first step.
    """

    def __init__(self, navigator: Navigator):
        super().__init__(navigator)
        self.cell: Cell | None = None

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)
        navigator, plan = self._navigator, self._navigator.plan
        if self.cell is None or self.driver.looks_again(view.now):
            here = navigator.nearest_cell(view.base[:2])
            children = [plan.cell_at(child.position) for child in view.children]
            self.cell = navigator.refuge(here, children, child_cells(view.children, plan)) or here
        self.driver.drive(view, robot, navigator.centres[self.cell], self.cell, robot.yaw)
        return Status.RUNNING
