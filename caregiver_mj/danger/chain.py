"""A child as a Markov chain.

A state is a cell, a goal and an epsilon (the share of random moves). Cell c, goal g and epsilon e have number
(c G + g) E + e, so that the states of a cell are contiguous.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, identity
from scipy.sparse.linalg import splu


@dataclasses.dataclass(frozen=True, eq=False)
class ChildChain:
    """The Markov chain of children in a house. A move to no other cell leaves the child in its cell."""

    greedy: np.ndarray  #: probability of every move without randomness, (cells, G, moves)
    epsilons: np.ndarray  #: possible shares of random moves, (E,)
    next_cell: np.ndarray  #: cell after each move, (cells, moves)
    ends: np.ndarray  #: whether each move reaches each goal, bool (cells, moves, G)
    object_at: np.ndarray  #: object that each move bumps into, -1 for none, (cells, moves)
    objects: int  #: number of objects
    #: probability of the next goal (column) after each reached one (row), (G, G); uniform by default
    next_goal: np.ndarray = None  # type: ignore[assignment]  # filled in below
    #: prior probability of each goal and epsilon, (G, E); uniform by default
    prior: np.ndarray = None  # type: ignore[assignment]
    #: toy bin of each goal, -1 for other goals, (G,); goal g is bin g by default
    bin_of: np.ndarray = None  # type: ignore[assignment]
    #: returns the probability of every move towards the caregiver, the last goal, without randomness, (..., moves), by
    #: the cells of caregiver and child, (...) each; None without such a goal
    follows: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None

    def __post_init__(self) -> None:
        _, goals, epsilons = self.shape
        defaults = {
            "next_goal": np.full((goals, goals), 1.0 / goals),
            "bin_of": np.arange(goals),
            "prior": np.full((goals, epsilons), 1.0 / (goals * epsilons)),
        }
        for name, value in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of cells, goals and epsilons."""
        return *self.greedy.shape[:2], len(self.epsilons)

    @property
    def size(self) -> int:
        """Number of states."""
        return int(np.prod(self.shape))

    @functools.cached_property
    def moves(self) -> np.ndarray:
        """Probability of each move in each state, (cells, G, E, moves); the last dimension sums to 1."""
        return self.at_random(self.greedy[:, :, None])

    def at_random(self, greedy: np.ndarray) -> np.ndarray:
        """Return the probability of every move, (..., E, moves), given the one without randomness, (..., moves)."""
        share = self.epsilons[:, None]
        return share / self.greedy.shape[-1] + (1.0 - share) * greedy

    @functools.cached_property
    def transition(self) -> csr_array:
        """Transition probabilities from each state (row) to each (column) without a caregiver, (states, states)."""
        _, goals, epsilons = self.shape
        after = np.where(self.ends[..., None], self.next_goal, np.eye(goals))  # (cells, moves, G, next)
        cell, move, goal, following = np.nonzero(after)
        each = np.arange(epsilons)
        chance = self.moves[cell, goal, :, move] * after[cell, move, goal, following][:, None]
        row = ((cell * goals + goal) * epsilons)[:, None] + each
        column = ((self.next_cell[cell, move] * goals + following) * epsilons)[:, None] + each
        entries = chance.ravel(), (row.ravel(), column.ravel())
        transition = coo_array(entries, shape=(self.size, self.size)).tocsr()
        transition.eliminate_zeros()
        return transition

    @functools.cached_property
    def hits(self) -> np.ndarray:
        """Probability that the next move from each state bumps into each object, (states, objects)."""
        return self._hits(np.ones_like(self.ends))

    @functools.cached_property
    def last_hits(self) -> np.ndarray:
        """Probability of those bumps that also reach the child's goal, (states, objects)."""
        return self._hits(self.ends)

    def _hits(self, counts: np.ndarray) -> np.ndarray:
        """Return the probability of bumps by the counted moves, bool (cells, moves, G), (states, objects)."""
        cell, move = np.nonzero(self.object_at >= 0)
        hits = np.zeros((*self.shape, self.objects))
        where = cell, slice(None), slice(None), self.object_at[cell, move]
        chance = self.moves[cell, :, :, move] * counts[cell, move][:, :, None]
        np.add.at(hits, where, chance)  # type: ignore[arg-type]  # NumPy's stubs know no slices
        return hits.reshape(self.size, self.objects)


def first_passage(chain: ChildChain, timesteps: int, groups: np.ndarray | None = None) -> np.ndarray:
    """Return the probability of bumping into each object within some timesteps, by one backward pass.

    Args:
        chain: The chain.
        timesteps: The horizon.
        groups: Membership of objects in groups, bool (objects, groups); each object alone by default.

    Returns:
        Probability of a bump into any object of each group, (states, groups).
    """
    hits, last = (each if groups is None else each @ groups for each in (chain.hits, chain.last_hits))
    within = np.zeros(hits.shape)
    for _ in range(timesteps):
        # A bump leaves the child in its cell: subtract later bumps, with the same goal or, if it was reached, the next.
        drawn = np.einsum("gh,chen->cgen", chain.next_goal, within.reshape(*chain.shape, -1)).reshape(hits.shape)
        within = hits + chain.transition @ within - hits * within - last * (drawn - within)
    return within


def first_entry(chain: ChildChain, cells: tuple[int, ...], timesteps: int) -> np.ndarray:
    """Return the probability of entering each of some cells within some timesteps, (states, cells)."""
    within, by_cell = np.zeros((chain.size, len(cells))), (chain.shape[0], chain.size // chain.shape[0], len(cells))
    for _ in range(timesteps):
        there = within.reshape(by_cell).copy()
        there[list(cells), :, np.arange(len(cells))] = 1.0
        within = chain.transition @ there.reshape(within.shape)
    return within


def discounted_entry(chain: ChildChain, cells: tuple[int, ...], discount: float) -> np.ndarray:
    """Return the expected discount^t of the first move into each of some cells, after t others, (states, cells).

    The discount must be below 1.
    """
    found = np.zeros((chain.size, len(cells)))
    for column, cell in zip(found.T, cells, strict=True):
        there = np.repeat(np.arange(chain.shape[0]) == cell, chain.size // chain.shape[0])
        onwards = chain.transition @ diags_array(np.where(there, 0.0, discount))
        column[:] = splu(csc_array(identity(chain.size) - onwards)).solve(chain.transition @ there.astype(float))
    return found


def expected_hits(chain: ChildChain, discount: float) -> np.ndarray:
    """Return the expected number of bumps into each object, each weighted by discount^t after t others.

    The array is (states, objects); the discount must be below 1.
    """
    remains = csc_array(identity(chain.size) - discount * chain.transition)
    return splu(remains).solve(chain.hits)


def presence(chain: ChildChain, now: np.ndarray, timesteps: int) -> np.ndarray:
    """Return the probability of each cell, (cells,), after at least one of the next moves.

    `now` is the probability of each state, (states,).
    """
    cells = chain.shape[0]
    onwards = csr_array(chain.transition.T)
    near, at = np.zeros(cells, bool), now
    for _ in range(timesteps):
        at = onwards @ at
        near |= (at.reshape(cells, -1) > 0).any(axis=1)
    cell = np.flatnonzero(near)
    column = np.arange(len(cell))
    # One column a cell; probability that reaches the cell is counted and removed.
    there, found = np.tile(now[:, None], len(cell)), np.zeros(cells)
    for _ in range(timesteps):
        there = (onwards @ there).reshape(cells, -1, len(cell))
        found[cell] += there[cell, :, column].sum(axis=1)
        there[cell, :, column] = 0.0
        there = there.reshape(chain.size, -1)
    return found


def expected_visits(transition: csr_array, start: np.ndarray, timesteps: int) -> np.ndarray:
    """Return the expected number of timesteps that a Markov chain begins in each state, (states,).

    `transition` has probabilities from each state (row) to each (column), (states, states), `start` the initial ones,
    (states,).
    """
    backwards = csr_array(transition.T)
    now, visits = start, np.zeros(len(start))
    for _ in range(timesteps):
        visits += now
        now = backwards @ now
    return visits
