"""Setting out: how long everything takes that the caregiver could do from where it is, with a child where that is."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.transit import Transit
from caregiver_mj.caregivers.foresight.travel import Travel, timesteps


class Departure:
    """Durations in moves of the child, for n pairs of a child and a caregiver.

    Attributes:
        to_post: Until the caregiver is in each post, (posts, n, G E).
        cost: What happens on the way, as damage, likewise.
        to_get: Until the candle of each table is in its hand, (tables, n).
        denied: Price of the moves denied to the child until then, (tables, n, G).
        to_place: Until it has been put down on another one, (tables, tables, n).
    """

    def __init__(self, ways: Travel, transit: Transit, child: np.ndarray, cell: np.ndarray, left: np.ndarray | float):
        """Works them out.

        Args:
            ways: The caregiver's ways.
            transit: What happens on them.
            child: The child's cells, (n,).
            cell: The caregiver's cells, (n,).
            left: Cells that the caregiver can walk before the child's next move, (n,) or for all.
        """
        posts, pace = len(ways.posts), ways.pace
        goal = np.arange(ways.step.shape[2])[:, None]
        taking = np.where(goal < posts, 0.0, pace.get - 1.0)  # on the ways a candle is taken in the time of a step
        walked = np.clip(np.rint(left - taking).astype(int), 0, len(ways.step) - 1)
        at = ways.step[walked, child, goal, cell]  # where it is when the child moves, (goals, n)
        self.to_post = transit.to_post[goal[:posts], child, :, at[:posts]]
        self.cost = transit.cost[goal[:posts], child, :, at[:posts]]
        self.to_get = transit.to_get[goal[: len(goal) - posts], child, at[posts:]].astype(int)
        self.denied = transit.denied[goal[: len(goal) - posts], child, :, at[posts:]]
        # What a child in the way costs, it costs on the way to the first table.
        get = ways.to_table[cell].T + pace.get  # steps
        place = get[:, None] + np.moveaxis(ways.onward[cell], 0, 2) + pace.place
        self.to_place = self.to_get[:, None] + timesteps(place, left, pace) - timesteps(get, left, pace)[:, None]
