"""The state of the grid."""

from __future__ import annotations

import numpy as np

from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan


class GridState:
    """The state of B episodes with K children each, which verbs change."""

    plan: FloorPlan  #: the house
    timestep: int  #: novice timesteps done
    child_cell: np.ndarray  #: free cell of each child, (B, K)
    goal: np.ndarray  #: toy bin of each child, (B, K)
    bumped: np.ndarray  #: whether each child's last move left it in its cell, (B, K)
    previous_cell: np.ndarray  #: cell in which each child's last move began, (B, K)
    previous_action: np.ndarray  #: that move, or NOTHING, (B, K)
    caregiver_cell: np.ndarray  #: the caregiver's cell, (B,)
    time_left: np.ndarray  #: share of the timestep that the caregiver has left, (B,)
    candle_table: np.ndarray  #: table of each candle, or NOTHING, (B, candles)
    holding: np.ndarray  #: candle in the caregiver's hand, or NOTHING, (B,)
    state: np.ndarray  #: `State` of each hazard, (B, hazards)
    orders: Interventions  #: current interventions
    done: np.ndarray  #: whether the intervention has been counted as done, (B,)

    def forget_orders(self, which: np.ndarray) -> None:
        """End the interventions of some worlds, (n,)."""
        mask = np.zeros(len(self.holding), bool)
        mask[which] = True
        self.orders = Interventions.idle(len(mask)).where(mask, self.orders)


def shown(array: np.ndarray) -> np.ndarray:
    """Return a read-only view of an array."""
    view = array.view()
    view.flags.writeable = False
    return view
