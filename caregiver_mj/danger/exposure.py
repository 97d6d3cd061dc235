"""How often somebody who walks at random comes to be where, without a single episode being played."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array


def expected_visits(transition: csr_array, start: np.ndarray, timesteps: int) -> np.ndarray:
    """Expected number of timesteps that a Markov chain begins in each state.

    Args:
        transition: Probabilities from each state (row) to each (column), (states, states).
        start: Probability of each state at first, (states,).
        timesteps: Length of the episode.

    Returns:
        Array (states,), which sums to the number of timesteps.
    """
    backwards = csr_array(transition.T)
    now, visits = start, np.zeros(len(start))
    for _ in range(timesteps):
        visits += now
        now = backwards @ now
    return visits
