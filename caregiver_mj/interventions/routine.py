"""How the robot carries an intervention out: one skill after the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.interventions.intervention import Intervention
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner
from caregiver_mj.robot.skills import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept

# Seconds for which a hazard is passed over after the robot has failed to protect the children from it: three steps of
# a toddler, in which it can do something else and the way may open. After each further failure twice as many, up to
# those of a candle that lies where the arm does not get at it: what it does instead may take longer, beside a child.
PASSED_OVER = 5.0
LEFT_LYING = 60.0


class PassedOver:
    """Which hazards the robot could not get to lately, and leaves alone for a while."""

    def __init__(self, hazards: int):
        self._until = np.zeros(hazards)
        self._wait = np.full(hazards, PASSED_OVER)  # seconds, after the next failure

    def forget(self) -> None:
        """Begins an episode."""
        self._until[:], self._wait[:] = 0.0, PASSED_OVER

    def note(self, hazard: int, now: float, least: float = PASSED_OVER) -> None:
        """Has a hazard, at which the robot has failed, passed over for some seconds from now on."""
        self._until[hazard] = now + max(least, self._wait[hazard])
        self._wait[hazard] = min(LEFT_LYING, 2 * self._wait[hazard])

    def succeed(self, hazard: int) -> None:
        """Takes note that the robot has got something done about a hazard."""
        self._wait[hazard] = PASSED_OVER

    def now(self, time: float) -> np.ndarray:
        """Whether each hazard is passed over at a time, (hazards,)."""
        return self._until > time


@dataclasses.dataclass(frozen=True)
class Means:
    """What routines work with in one episode.

    Attributes:
        plan: The house.
        navigator: Plans the base's paths.
        retrievals: Plans how to pick up what has fallen.
        novice_timestep: Seconds of a novice timestep.
        passed_over: Hazards that are left alone for a while.
        destination: Where the caregiver wants a candle, by the percept and the candle's index: index of a table.
        takes_orders: Whether the caregiver was told what to do, so that there is nothing to choose.
    """

    plan: FloorPlan
    navigator: Navigator
    retrievals: RetrievalPlanner
    novice_timestep: float
    passed_over: PassedOver
    destination: Callable[[Percept, int], int]
    takes_orders: bool


class Routine:
    """One intervention under way in the house. This one is done with a single skill.

    Attributes:
        intervention: What is being done.
        skill: The robot's present skill.
        activity: What is being done, in words.
        holding: Index of the candle in the robot's hand, or NOTHING.
        goes_on: Whether it goes on after it is done, until something else is decided.
    """

    holding = NOTHING

    def __init__(self, means: Means, intervention: Intervention, skill: Skill, activity: str, goes_on: bool = False):
        self.means, self.intervention = means, intervention
        self.skill, self.activity, self.goes_on = skill, activity, goes_on

    @property
    def interruptible(self) -> bool:
        """Whether the skill may be left now."""
        return self.skill.status.interruptible

    def step(self, view: View, robot: RobotMotion, see: Callable[[], Percept]) -> Status:
        """Acts for one control timestep.

        Args:
            view: What the robot sees.
            robot: The robot's references.
            see: Makes the caregiver's percept of this moment.

        Returns:
            RUNNING, or how it has ended.
        """
        status = self.skill.step(view, robot)
        return self.after(status, view, see) if status.ended else status

    def after(self, status: Status, view: View, see: Callable[[], Percept]) -> Status:
        """What comes after a skill that has ended with a status: RUNNING if there is another one."""
        return status

    def hear(self, percept: Percept, wanted: Intervention) -> None:
        """Takes note, with a candle in the hand, of what the caregiver would want now."""
