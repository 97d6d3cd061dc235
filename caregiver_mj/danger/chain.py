"""A child that goes from place to place, as a Markov chain: what it does next, given where it is and what it wants.

Its state is its cell, the goal that it is on its way to, and its epsilon: the share of its moves that are random. That
of cell c, goal g and epsilon e has the number (c G + g) E + e, so that what belongs to a cell lies together.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from scipy.sparse import coo_array, csr_array


@dataclasses.dataclass(frozen=True, eq=False)
class ChildChain:
    """A house as a child walks through it. Wherever a move leads that is no other cell, the child stays in its cell.

    Attributes:
        greedy: Probability of every move of a child that makes none at random, (cells, G, moves).
        epsilons: The shares of random moves that there are, (E,).
        next_cell: The cell after each move, (cells, moves).
        goal_at: The goal that each move reaches for, -1 for none, likewise. A child that reaches its own draws the next
            one uniformly out of all.
        object_at: The object that each move bumps into, -1 for none, likewise.
        objects: How many objects there are.
    """

    greedy: np.ndarray
    epsilons: np.ndarray
    next_cell: np.ndarray
    goal_at: np.ndarray
    object_at: np.ndarray
    objects: int

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
        share = self.epsilons[:, None]
        return share / self.greedy.shape[-1] + (1.0 - share) * self.greedy[:, :, None]

    @functools.cached_property
    def transition(self) -> csr_array:
        """Probabilities from each state (row) to each (column), (states, states)."""
        _, goals, epsilons = self.shape
        reaches = self.goal_at[:, None] == np.arange(goals)[:, None]  # (cells, G, moves)
        next_goal = np.where(reaches[..., None], 1.0 / goals, np.eye(goals)[:, None, :])  # (cells, G, moves, next)
        cell, goal, move, after = np.nonzero(next_goal)
        each = np.arange(epsilons)
        chance = self.moves[cell, goal, :, move] * next_goal[cell, goal, move, after][:, None]
        row = ((cell * goals + goal) * epsilons)[:, None] + each
        column = ((self.next_cell[cell, move] * goals + after) * epsilons)[:, None] + each
        entries = chance.ravel(), (row.ravel(), column.ravel())
        transition = coo_array(entries, shape=(self.size, self.size)).tocsr()
        transition.eliminate_zeros()
        return transition

    @functools.cached_property
    def enters(self) -> csr_array:
        """Probability that the next move from each state leads into each other cell, (states, cells)."""
        cells, goals, epsilons = self.shape
        cell, move = np.nonzero(self.next_cell != np.arange(cells)[:, None])
        row = cell[:, None] * (goals * epsilons) + np.arange(goals * epsilons)
        column = np.broadcast_to(self.next_cell[cell, move][:, None], row.shape)
        chance = self.moves[cell, :, :, move]
        return coo_array((chance.ravel(), (row.ravel(), column.ravel())), shape=(self.size, cells)).tocsr()

    @functools.cached_property
    def hits(self) -> np.ndarray:
        """Probability that the next move from each state bumps into each object, (states, objects)."""
        cell, move = np.nonzero(self.object_at >= 0)
        hits = np.zeros((*self.shape, self.objects))
        where = cell, slice(None), slice(None), self.object_at[cell, move]
        np.add.at(hits, where, self.moves[cell, :, :, move])  # type: ignore[arg-type]  # NumPy's stubs know no slices
        return hits.reshape(self.size, self.objects)
