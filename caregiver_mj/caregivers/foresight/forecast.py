"""What is to come in worlds whose children are thought to be on their ways, moment by moment."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.prospects import MOMENTS, Prospects


class Forecast:
    """Expected discounted damage in W worlds, of all children together.

    Attributes:
        prospects: That of the house.
        staying: Of a candle on each table from each moment on, (W, moments, tables).
        exposed: Of open stairwells until each moment, (W, moments).
        shut: Of those that are open while the caregiver is in a post, likewise, (W, moments, posts).
        guarding: From each moment on if it then is in a post, and guards for ever, (W, moments, posts).
        closing: Of stairwells in all if it is at each place (`Prospects`) at each moment and then guards for ever,
            after they have been open all the time, (W, moments, places).
    """

    def __init__(self, prospects: Prospects, child: np.ndarray, belief: np.ndarray):
        """Weighs what is to come.

        Args:
            prospects: What is to come in the house.
            child: The children's cells, (W, K).
            belief: Probability of every goal and epsilon of each child, (W, K, G E).
        """
        posts = prospects.after_post.shape[1]
        each = zip(child.T, np.moveaxis(belief, 1, 0), strict=True)
        ahead = sum(np.matmul(prospects.ahead[cell], weight[:, None, :, None])[..., 0] for cell, weight in each)
        self.prospects = prospects
        self.staying = ahead[..., : prospects.tables]
        self.guarding, others = np.split(ahead[..., prospects.tables : -1], 2, axis=2)
        self.exposed, self.shut = (later[:, :1] - later for later in (ahead[..., -1], others))
        when = self.moment(MOMENTS[:, None, None] + prospects.after_post)  # (moments, places, posts)
        self.closing = (self.exposed[:, when] + self.guarding[:, when, np.arange(posts)]).min(axis=3)

    def moment(self, moves: np.ndarray) -> np.ndarray:
        """Index of the moment after so many moves of a child."""
        return self.prospects.nearest[np.minimum(moves, MOMENTS[-1])]
