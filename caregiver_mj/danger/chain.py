"""A child that goes from place to place, as a Markov chain: what it does next, given where it is and what it wants.

Its state is its cell, its goal, and its epsilon: the share of its moves that are random. That of cell c, goal g and
epsilon e has the number (c G + g) E + e, so that what belongs to a cell lies together.
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
    """A house as a child walks through it. Wherever a move leads that is no other cell, the child stays in its cell."""

    greedy: np.ndarray  #: probability of every move of a child that makes none at random, (cells, G, moves)
    epsilons: np.ndarray  #: the shares of random moves that there are, (E,)
    next_cell: np.ndarray  #: the cell after each move, (cells, moves)
    ends: np.ndarray  #: whether each move reaches each goal, bool (cells, moves, G)
    object_at: np.ndarray  #: the object that each move bumps into, -1 for none, (cells, moves)
    objects: int  #: how many objects there are
    #: probability of each goal (column) after each (row) has been reached, (G, G). Left out, uniform
    next_goal: np.ndarray = None  # type: ignore[assignment]  # filled in below
    #: probability of each goal and epsilon of a child of whom nothing is known, (G, E). Left out, uniform
    prior: np.ndarray = None  # type: ignore[assignment]
    #: the toy bin that each goal is, -1 for something else, (G,). Left out, goal g is bin g
    bin_of: np.ndarray = None  # type: ignore[assignment]
    #: returns the probability of every move of a child that makes none at random and whose goal is the last one: to be
    #: where the caregiver is, (..., moves), by the caregiver's cell and its own, (...) both. Left out, there is no such
    #: goal
    follows: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None

    def __post_init__(self) -> None:
        """Fill in what is left out."""
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
        """How many cells, goals and epsilons there are."""
        return *self.greedy.shape[:2], len(self.epsilons)

    @property
    def size(self) -> int:
        """How many states there are."""
        return int(np.prod(self.shape))

    @functools.cached_property
    def moves(self) -> np.ndarray:
        """How probable each move is in each state: (cells, G, E, moves), whose last dimension sums to 1."""
        return self.at_random(self.greedy[:, :, None])

    def at_random(self, greedy: np.ndarray) -> np.ndarray:
        """Return the probability of every move, (..., E, moves), by that of a child that makes none at random."""
        share = self.epsilons[:, None]
        return share / self.greedy.shape[-1] + (1.0 - share) * greedy

    @functools.cached_property
    def transition(self) -> csr_array:
        """Probabilities from each state (row) to each (column), (states, states), with no caregiver about."""
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
        """The same of those bumps that end the child's goal: then it draws another one."""
        return self._hits(self.ends)

    def _hits(self, counts: np.ndarray) -> np.ndarray:
        """The same of moves that count with each goal, bool (cells, moves, G)."""
        cell, move = np.nonzero(self.object_at >= 0)
        hits = np.zeros((*self.shape, self.objects))
        where = cell, slice(None), slice(None), self.object_at[cell, move]
        chance = self.moves[cell, :, :, move] * counts[cell, move][:, :, None]
        np.add.at(hits, where, chance)  # type: ignore[arg-type]  # NumPy's stubs know no slices
        return hits.reshape(self.size, self.objects)


def first_passage(chain: ChildChain, timesteps: int, groups: np.ndarray | None = None) -> np.ndarray:
    """Return the probability of bumping into each object within some timesteps: one backward pass for all states.

    Objects are asked about together, for bumps into any of them, in groups: bool (objects, groups). Left out, each is
    asked about alone. The array is (states, objects), or (states, groups).
    """
    hits, last = (each if groups is None else each @ groups for each in (chain.hits, chain.last_hits))
    within = np.zeros(hits.shape)
    for _ in range(timesteps):
        # A move that bumps leaves the child in its cell: what would have followed it is taken out again, with the goal
        # that it keeps or, where a bump ends that, with those that it draws.
        drawn = np.einsum("gh,chen->cgen", chain.next_goal, within.reshape(*chain.shape, -1)).reshape(hits.shape)
        within = hits + chain.transition @ within - hits * within - last * (drawn - within)
    return within


def first_entry(chain: ChildChain, cells: tuple[int, ...], timesteps: int) -> np.ndarray:
    """Return the probability of coming into each of some cells within some timesteps, (states, cells)."""
    within, by_cell = np.zeros((chain.size, len(cells))), (chain.shape[0], chain.size // chain.shape[0], len(cells))
    for _ in range(timesteps):
        there = within.reshape(by_cell).copy()
        there[list(cells), :, np.arange(len(cells))] = 1.0
        within = chain.transition @ there.reshape(within.shape)
    return within


def discounted_entry(chain: ChildChain, cells: tuple[int, ...], discount: float) -> np.ndarray:
    """Return the expected discount of the first move into each of some cells, (states, cells).

    One in t moves (0: the next) counts discount^t, with a discount below 1.
    """
    found = np.zeros((chain.size, len(cells)))
    for column, cell in zip(found.T, cells, strict=True):
        there = np.repeat(np.arange(chain.shape[0]) == cell, chain.size // chain.shape[0])
        onwards = chain.transition @ diags_array(np.where(there, 0.0, discount))
        column[:] = splu(csc_array(identity(chain.size) - onwards)).solve(chain.transition @ there.astype(float))
    return found


def expected_hits(chain: ChildChain, discount: float) -> np.ndarray:
    """Return the expected bumps into each object from now on, (states, objects).

    Those in t moves (0: the next) count discount^t, with a discount below 1.
    """
    remains = csc_array(identity(chain.size) - discount * chain.transition)
    return splu(remains).solve(chain.hits)


def presence(chain: ChildChain, now: np.ndarray, timesteps: int) -> np.ndarray:
    """Return the probability of being in each cell after at least one of the next moves: where a child may be soon.

    It is (cells,), by the probability of each state now, (states,).
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


def expected_visits(transition: csr_array, start: np.ndarray, timesteps: int) -> np.ndarray:
    """Return the expected number of timesteps that a Markov chain begins in each state, (states,).

    They sum to the timesteps. The transition has the probabilities from each state (row) to each (column), (states,
    states), the start that of each state at first, (states,).
    """
    backwards = csr_array(transition.T)
    now, visits = start, np.zeros(len(start))
    for _ in range(timesteps):
        visits += now
        now = backwards @ now
    return visits
