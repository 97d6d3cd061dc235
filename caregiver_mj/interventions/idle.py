"""What a caregiver does when there is nothing to protect the children from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, Intervention, Verb
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import ASIDE, STAY

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.interventions.routine import Means, Routine
    from caregiver_mj.robot.view import View


class StandAside(Verb):
    """To keep out of the children's way."""

    name = STAND_ASIDE
    counts = False

    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        return "keep out of the way"

    def place(self, world: GridWorld, which: np.ndarray) -> np.ndarray:
        return np.full(len(which), ASIDE)

    def routine(self, means: Means, intervention: Intervention, view: View, percept: Percept) -> Routine:
        from caregiver_mj.interventions.routine import Routine  # here, for the grid does without the robot
        from caregiver_mj.robot import skills

        return Routine(means, intervention, skills.StandAside(means.navigator), self.describe(means.plan, intervention))


class DoNothing(Verb):
    """To stay where one is, even in a child's way."""

    name = DO_NOTHING
    counts = False

    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        return "watch"

    def place(self, world: GridWorld, which: np.ndarray) -> np.ndarray:
        return np.full(len(which), STAY)

    def routine(self, means: Means, intervention: Intervention, view: View, percept: Percept) -> Routine:
        from caregiver_mj.interventions.routine import Routine
        from caregiver_mj.robot import skills

        return Routine(means, intervention, skills.Rest(means.navigator), self.describe(means.plan, intervention))
