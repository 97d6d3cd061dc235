"""Relocate: take a candle from its table, or from where it has fallen, to a safer table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.interventions.verb import RELOCATE, Intervention, Mark, Verb
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where

if TYPE_CHECKING:
    from caregiver_mj.caregivers.percept import Percept
    from caregiver_mj.grid.world import GridWorld
    from caregiver_mj.interventions.routine import Means, Routine
    from caregiver_mj.robot.view import View


class Relocate(Verb):
    """The hazard is a candle, the destination a table. It is done when the candle is put down there.

    The destination is the one that was decided when the candle is taken; what is decided while it is in the hand waits
    until it has been put down.
    """

    name = RELOCATE

    def describe(self, plan: FloorPlan, intervention: Intervention) -> str:
        return f"fetch {plan.hazards[intervention.hazard]}"

    def mark(self, plan: FloorPlan, intervention: Intervention) -> Mark:
        return "candle", plan.hazards.among(Where.ON_TABLE, intervention.hazard)

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return plan.graph.beside(plan.tables)

    def place(self, world: GridWorld, which: np.ndarray) -> np.ndarray:
        table = world.candle_table[which, world.plan.hazards.among(Where.ON_TABLE, world.orders.hazard[which])]
        return np.where(world.holding[which] == NOTHING, table, world.orders.destination[which])

    def carry_out(self, world: GridWorld, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> None:
        here = which[stood]
        candle = world.plan.hazards.among(Where.ON_TABLE, world.orders.hazard[here])
        held = world.holding[here] != NOTHING
        world.candle_table[here, candle] = np.where(held, world.orders.destination[here], NOTHING)
        world.holding[here] = np.where(held, NOTHING, candle)
        world.ledger.interventions_done[here] += held
        world.forget_orders(here[held])  # to take the same candle again is another intervention

    def routine(self, means: Means, intervention: Intervention, view: View, percept: Percept) -> Routine:
        from caregiver_mj.interventions.routine import Relocating  # here, for the grid does without the robot

        return Relocating(means, intervention, view, percept)
