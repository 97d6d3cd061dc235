"""Setting out: how long everything takes that the caregiver could do from where it is, with a child where that is."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.transit import Transit
from caregiver_mj.caregivers.foresight.travel import HANDLING, Travel, timesteps


class Departure:
    """Durations in moves of the child, for n pairs of a child and a caregiver.

    Attributes:
        to_post: Until the caregiver is in each post, (posts, n, G E).
        cost: What happens on the way, as damage, likewise.
        to_get: Until the candle of each table is in its hand, (tables, n).
        denied: Price of the moves denied to the child until then, (tables, n, G).
        to_place: Until it has been put down on another one, (tables, tables, n).
    """

    def __init__(self, ways: Travel, transit: Transit, child: np.ndarray, cell: np.ndarray, left: int):
        """Works them out.

        Args:
            ways: The caregiver's ways.
            transit: What happens on them.
            child: The child's cells, (n,).
            cell: The caregiver's cells, (n,).
            left: Actions that the caregiver has left before the child's next move.
        """
        posts = len(ways.posts)
        goal = np.arange(ways.step.shape[2])[:, None]
        at = ways.step[left, child, goal, cell]  # where it is when the child moves, (goals, n)
        self.to_post = transit.to_post[goal[:posts], child, :, at[:posts]]
        self.cost = transit.cost[goal[:posts], child, :, at[:posts]]
        self.to_get = transit.to_get[goal[: len(goal) - posts], child, at[posts:]].astype(int)
        self.denied = transit.denied[goal[: len(goal) - posts], child, :, at[posts:]]
        # What a child in the way costs, it costs on the way to the first table.
        self.to_place = to_place(ways, self.to_get, cell, left)


def to_place(ways: Travel, to_get: np.ndarray, cell: np.ndarray, left: int) -> np.ndarray:
    """Moves of the child until a candle is on another table, (tables, tables, n), from those until it is in the hand.

    Args:
        ways: The caregiver's ways.
        to_get: Until the candle of each table is in its hand, (tables, n).
        cell: The caregiver's cells, (n,).
        left: Actions that the caregiver has left before the child's next move.
    """
    get = ways.to_table[cell].T + HANDLING  # actions
    place = get[:, None] + np.moveaxis(ways.onward[cell], 0, 2) + HANDLING
    return to_get[:, None] + timesteps(place, left) - timesteps(get, left)[:, None]
