"""The base class of skills, and skills that only drive: rest, stand aside, go to a cell, block."""

from __future__ import annotations

import abc
import math

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.robot.driver import Driver
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.separation import child_cells
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

_THERE = 0.03  # m; distance of a resting base from the landing's centre at which it blocks it


class Skill(abc.ABC):
    """Something that the robot can do.

    Attributes:
        embodiment: The robot.
        driver: Drives the base, at first with a candle in the hand if `loaded`.
        status: Status after the last step; RUNNING before the first.
    """

    def __init__(self, navigator: Navigator, loaded: bool = False):
        self.embodiment = navigator.robot
        self.driver = Driver(navigator, loaded)
        self.status = Status.RUNNING
        self._navigator = navigator

    def step(self, view: View, robot: RobotMotion) -> Status:
        """Set goals for one control step. After its end a skill is not stepped, except for `Block` and `GoTo`."""
        robot.drives = 0.0  # a base that the skill does not drive stops
        self.status = self._act(view, robot)
        return self.status

    @abc.abstractmethod
    def _act(self, view: View, robot: RobotMotion) -> Status:
        """Set goals for one control step, and return the status."""


class Rest(Skill):
    """Comes to rest with the hand in. Never done."""

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)  # a base that no skill drives stops by itself
        self.driver.look(view, robot)
        return Status.RUNNING


class StandAside(Skill):
    """Stays out of the children's way while there is nothing else to do. Never done.

    Attributes:
        cell: Its refuge; None before the first step.
        yaw: Its heading there, rad; None for any.
    """

    def __init__(self, navigator: Navigator, moves_on: bool = False):
        """Prepare the skill; with `moves_on` it leads a child that follows it from one refuge to another."""
        super().__init__(navigator)
        self.cell: Cell | None = None
        self.yaw: float | None = None
        self._moves_on = moves_on

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)
        navigator, plan = self._navigator, self._navigator.plan
        if self.cell is None or self.driver.looks_again(view.now):
            here = navigator.nearest_cell(view.base[:2])
            children = [plan.cell_at(child.position) for child in view.children]
            refuge = (
                self.driver.refuge(view, robot, here)
                if self._moves_on
                else navigator.refuge(here, children, child_cells(view.children, plan))
            )
            self.cell = refuge or here
        self.driver.drive(view, robot, navigator.centres[self.cell], self.cell, self.yaw)
        return Status.RUNNING


class GoTo(Skill):
    """Goes to a cell. Done when the base is there; stays as long as it is stepped."""

    def __init__(self, navigator: Navigator, cell: Cell):
        super().__init__(navigator)
        self.cell = cell

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)
        return self.driver.drive(view, robot, self._navigator.centres[self.cell], self.cell)


class Block(Skill):
    """Stands in a stairwell. Done when the base is there; stays as long as it is stepped.

    Attributes:
        stairwell: Index of the stairwell.
        cell: Its landing.
    """

    def __init__(self, navigator: Navigator, stairwell: int):
        super().__init__(navigator)
        self.stairwell = stairwell
        self.cell = navigator.plan.stairwells[stairwell]
        step = navigator.plan.stair_directions[stairwell]
        self._outwards = None if step is None else math.atan2(step[0], -step[1])

    def _act(self, view: View, robot: RobotMotion) -> Status:
        robot.reach(0.0)
        goal = self._navigator.centres[self.cell]
        # Between the panels it cannot turn: a robot with a narrow view comes in backwards.
        status = self.driver.drive(view, robot, goal, self.cell, None if view.gaze is None else self._outwards)
        there = status is Status.DONE or (math.dist(goal, view.base[:2]) < _THERE and not robot.moving)
        if status is Status.FAILED or not there:
            return status
        self.driver.patience.last_for_ever()  # it stays, even if pushed
        return Status.DONE
