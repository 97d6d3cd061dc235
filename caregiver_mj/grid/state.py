"""The state of the grid: who is where, and what has become of everything."""

from __future__ import annotations

import numpy as np

from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan


class GridState:
    """The state of B episodes with K children each, all public: verbs change it, and tests look at it.

    All arrays have the episode as first dimension.
    """

    plan: FloorPlan  #: the house
    timestep: int  #: novice timesteps done
    child_cell: np.ndarray  #: free cell of each child, (B, K)
    goal: np.ndarray  #: toy bin that each goes to, (B, K)
    bumped: np.ndarray  #: whether the last move of each left it where it was, (B, K)
    previous_cell: np.ndarray  #: cell in which each made its last move, (B, K)
    previous_action: np.ndarray  #: that move, or NOTHING, (B, K)
    caregiver_cell: np.ndarray  #: the caregiver's cell, (B,)
    time_left: np.ndarray  #: share of the timestep that the caregiver has left, (B,)
    candle_table: np.ndarray  #: table on which each candle is, or NOTHING, (B, candles)
    holding: np.ndarray  #: candle in the caregiver's hand, or NOTHING, (B,)
    state: np.ndarray  #: what has become of each hazard, a `State`, (B, hazards)
    orders: Interventions  #: current interventions
    done: np.ndarray  #: whether that has been counted as done already, (B,)

    def forget_orders(self, which: np.ndarray) -> None:
        """End the interventions of some worlds, (n,), so that the next ones begin anew."""
        mask = np.zeros(len(self.holding), bool)
        mask[which] = True
        self.orders = Interventions.idle(len(mask)).where(mask, self.orders)


def shown(array: np.ndarray) -> np.ndarray:
    """Return an array as it is shown to others: writing into it raises, and does not change the world."""
    view = array.view()
    view.flags.writeable = False
    return view
