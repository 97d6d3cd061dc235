"""The state of the grid: who is where, and what has become of everything."""

from __future__ import annotations

import numpy as np

from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan


class GridState:
    """The state of B episodes with K children each, all public: verbs change it, and tests look at it.

    All arrays have the episode as first dimension.

    Attributes:
        plan: The house.
        timestep: Novice timesteps done.
        child_cell: Free cell of each child, (B, K).
        goal: Toy bin that each goes to, (B, K).
        bumped: Whether the last move of each left it where it was, (B, K).
        previous_cell: Cell in which each made its last move, (B, K).
        previous_action: That move, or NOTHING, (B, K).
        caregiver_cell: The caregiver's cell, (B,).
        time_left: Share of the timestep that the caregiver has left, (B,).
        candle_table: Table on which each candle is, or NOTHING, (B, candles).
        holding: Candle in the caregiver's hand, or NOTHING, (B,).
        state: What has become of each hazard, a `State`, (B, hazards).
        orders: Current interventions.
        done: Whether that has been counted as done already, (B,).
    """

    plan: FloorPlan
    timestep: int
    child_cell: np.ndarray
    goal: np.ndarray
    bumped: np.ndarray
    previous_cell: np.ndarray
    previous_action: np.ndarray
    caregiver_cell: np.ndarray
    time_left: np.ndarray
    candle_table: np.ndarray
    holding: np.ndarray
    state: np.ndarray
    orders: Interventions
    done: np.ndarray

    def forget_orders(self, which: np.ndarray) -> None:
        """End the interventions of some worlds, (n,), so that whatever comes next is begun anew."""
        mask = np.zeros(len(self.holding), bool)
        mask[which] = True
        self.orders = Interventions.idle(len(mask)).where(mask, self.orders)


def shown(array: np.ndarray) -> np.ndarray:
    """Return an array as it is shown to others: writing into it raises, and does not change the world."""
    view = array.view()
    view.flags.writeable = False
    return view
