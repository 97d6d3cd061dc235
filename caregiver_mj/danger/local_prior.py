"""An action prior that can be carried from house to house: it goes by what is around a child, and not by where it is.

The paper counts, for every cell s of a house, how many expert trajectories take action a there (section II). Those
counts mean nothing in another house. Here they are those of *contexts*: what stands in the four neighbouring cells, and
where the goal lies (whether above, below or in the same row, and whether left, right or in the same column). With
phi(s, g) for the context of a child in cell s that is on its way to goal g::

    alpha_phi(a)  = number of pairs of an expert trajectory, to g, and a cell s with phi(s, g) = phi
                    in which that trajectory takes a, over all houses, + alpha^0
    theta_phi     ~ Dir(alpha_phi), or its mean
    theta_s(a)    = 1 / G sum_g theta_phi(s, g)(a)

The last line is the prior of a cell in a new house with G goals: which of them a child is on its way to is not known,
and all are taken to be as probable. A house that is turned or mirrored is a house too, so every move that an expert
makes counts in all eight symmetries of the grid.
"""

from __future__ import annotations

import numpy as np

from caregiver_mj.danger.safety import ACTION_COUNT, HYPERPRIOR

SECTORS = 8  # in which a goal can lie, clockwise from north: straight ahead, to the upper right, ...
KINDS = 5  # of what can stand in a cell
CONTEXTS = KINDS**ACTION_COUNT * SECTORS


def sector(down: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The sector of a place so many cells down and to the right, not both 0: integers of the same shape.

    Only the signs count. Sectors of 45 degrees told less of where experts go (on houses of `train-40`).
    """
    return np.rint(np.arctan2(np.sign(right), -np.sign(down)) / (2.0 * np.pi / SECTORS)).astype(int) % SECTORS


def context(around: np.ndarray, goal_sector: np.ndarray) -> np.ndarray:
    """Numbers of contexts.

    Args:
        around: What stands north, east, south and west, below `KINDS`, (..., 4).
        goal_sector: Where the goal lies, (...).

    Returns:
        Integers below `CONTEXTS`, (...).
    """
    return (around @ KINDS ** np.arange(ACTION_COUNT)) * SECTORS + goal_sector


def context_counts(
    around: np.ndarray, goal_sector: np.ndarray, action: np.ndarray, hyperprior: float = HYPERPRIOR
) -> np.ndarray:
    """alpha_phi(a), of n moves of experts; each belongs to another cell, or another trajectory.

    Args:
        around: What stood around them, (n, 4), as for `context`.
        goal_sector: In which sector their goal lay, (n,).
        action: The moves, (n,): north, east, south or west.
        hyperprior: alpha^0; positive.

    Returns:
        Array (`CONTEXTS`, 4).

    Raises:
        ValueError: The hyperprior is not positive.
    """
    if not hyperprior > 0:
        raise ValueError(f"the hyperprior must be positive, not {hyperprior}")
    alpha = np.full((CONTEXTS, ACTION_COUNT), float(hyperprior))
    directions = np.arange(ACTION_COUNT)
    for mirrored in (1, -1):  # what is east is west
        for quarters in directions:  # turned clockwise
            seen = np.empty_like(around)
            seen[:, (mirrored * directions + quarters) % ACTION_COUNT] = around
            to_goal = (mirrored * goal_sector + quarters * SECTORS // ACTION_COUNT) % SECTORS
            np.add.at(alpha, (context(seen, to_goal), (mirrored * action + quarters) % ACTION_COUNT), 1.0)
    return alpha


def carried_prior(theta: np.ndarray, contexts: np.ndarray) -> np.ndarray:
    """theta_s(a) in a house.

    Args:
        theta: theta_phi(a) of every context, (`CONTEXTS`, 4), rows sum to 1.
        contexts: phi(s, g), (cells, goals).

    Returns:
        Array (cells, 4), rows sum to 1.
    """
    return theta[contexts].mean(axis=1)
