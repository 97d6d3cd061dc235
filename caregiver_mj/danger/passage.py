"""How likely a child is to run into what, and how much harm there is to come: one backward pass for all its states."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, identity
from scipy.sparse.linalg import splu

from caregiver_mj.danger.chain import ChildChain


def first_passage(chain: ChildChain, timesteps: int) -> np.ndarray:
    """Probability of bumping into each object at least once within some timesteps.

    Args:
        chain: How the child moves.
        timesteps: How many moves there are.

    Returns:
        Array (states, objects).
    """
    within = np.zeros(chain.hits.shape)
    for _ in range(timesteps):
        # A move that bumps leaves the child in its state: what would have followed it is taken out again.
        within = chain.hits + chain.transition @ within - chain.hits * within
    return within


def expected_hits(chain: ChildChain, discount: float) -> np.ndarray:
    """Expected number of bumps into each object from now on, those in t moves counting discount^t (0 for the next).

    Args:
        chain: How the child moves.
        discount: Below 1.

    Returns:
        Array (states, objects).
    """
    remains = csc_array(identity(chain.size) - discount * chain.transition)
    return splu(remains).solve(chain.hits)
