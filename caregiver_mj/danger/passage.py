"""How likely a child is to run into what, how much harm there is to come, and where it may be soon."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array, identity
from scipy.sparse.linalg import splu

from caregiver_mj.danger.chain import ChildChain


def first_passage(chain: ChildChain, timesteps: int, groups: np.ndarray | None = None) -> np.ndarray:
    """Probability of bumping into each object at least once within some timesteps: one backward pass for all states.

    Args:
        chain: How the child moves.
        timesteps: How many moves there are.
        groups: Which objects are asked about together, for bumps into any of them: bool (objects, groups). Left out,
            each is asked about alone.

    Returns:
        Array (states, objects), or (states, groups).
    """
    hits = chain.hits if groups is None else chain.hits @ groups
    within = np.zeros(hits.shape)
    for _ in range(timesteps):
        # A move that bumps leaves the child in its state: what would have followed it is taken out again.
        within = hits + chain.transition @ within - hits * within
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


def presence(chain: ChildChain, now: np.ndarray, timesteps: int) -> np.ndarray:
    """Probability of being in each cell after at least one of the next moves: where a child may be soon.

    Args:
        chain: How the child moves.
        now: Probability of each state, (states,).
        timesteps: How many moves there are.

    Returns:
        Array (cells,).
    """
    cells = chain.shape[0]
    onwards = csr_array(chain.transition.T)
    near, at = np.zeros(cells, bool), now
    for _ in range(timesteps):
        at = onwards @ at
        near |= (at.reshape(cells, -1) > 0).any(axis=1)
    cell = np.flatnonzero(near)
    column = np.arange(len(cell))
    # Of each of those cells a column, in which whoever has been there is counted and taken out.
    there, found = np.tile(now[:, None], len(cell)), np.zeros(cells)
    for _ in range(timesteps):
        there = (onwards @ there).reshape(cells, -1, len(cell))
        found[cell] += there[cell, :, column].sum(axis=1)
        there[cell, :, column] = 0.0
        there = there.reshape(chain.size, -1)
    return found
