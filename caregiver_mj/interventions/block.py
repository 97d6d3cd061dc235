"""Block: stand in a stairwell, so that no child gets through."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.interventions.verb import BLOCK, Intervention, Mark, Verb
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import Where

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.interventions.routine import Means, Routine
    from caregiver_mj.robot.view import View


class Block(Verb):
    """The hazard is a stairwell. It is done as soon as the caregiver stands on its landing."""

    name = BLOCK

    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        return f"block {plan.hazards[intervention.hazard]}"

    def mark(self, plan: FloorPlan, intervention: Intervention) -> Mark:
        return "cell", plan.stairwells[plan.hazards.among(Where.OPENING, intervention.hazard)]

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[plan.cell_index[cell]] for cell in plan.stairwells]

    def place(self, world: GridWorld, which: np.ndarray) -> np.ndarray:
        return world.plan.hazards.among(Where.OPENING, world.orders.hazard[which])

    def carry_out(self, world: GridWorld, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> None:
        arrived = which[came & ~world.done[which]]
        world.ledger.interventions_done[arrived] += 1
        world.done[arrived] = True

    def routine(self, means: Means, intervention: Intervention, view: View, percept: Percept) -> Routine:
        from caregiver_mj.interventions.routine import Routine  # here, for the grid does without the robot
        from caregiver_mj.robot import skills

        skill = skills.Block(means.navigator, means.plan.hazards.among(Where.OPENING, intervention.hazard))
        return Routine(means, intervention, skill, self.describe(means.plan, intervention), goes_on=True)
