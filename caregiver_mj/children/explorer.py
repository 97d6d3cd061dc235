"""The explorer: a child that does not know the house (paper: "the rest of the environment is unknown")."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Novice
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

_FAR = np.iinfo(np.int16).max  # distance without a known way


class Explorer(Novice):
    """Goes the shortest way to its bin through a house of which it knows only the obstacles that it has bumped into.

    It knows its place, that of its bin and the size of the house, and assumes that all other cells are free. It
    remembers obstacles, stairs included, to the end of the episode, but not a caregiver in its way. A share epsilon of
    its moves is random, like the novice's.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._target, self._index = plan.graph.moves[1:]
        self._free, self._bins = np.array(plan.free_cells), np.array(plan.bins)  # rows and columns
        self.reset(1)

    def reset(self, batch: int) -> None:
        shape = (batch, *self.plan.shape)
        self._closed = np.zeros(shape, bool)  # cells that it has bumped into
        self._distance = np.full(shape, _FAR, np.int16)  # believed moves to its bin
        self._planned = np.full(batch, NOTHING)  # the bin of these distances; NOTHING if outdated

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        self._learn(sight, action)
        return action

    def ways(self, sight: ChildPercept) -> tuple[np.ndarray, np.ndarray]:
        stale = np.flatnonzero(self._planned != sight.goal)
        if stale.size:
            self._distance[stale] = self._distances(self._closed[stale], self._bins[sight.goal[stale]])
            self._planned[stale] = sight.goal[stale]
        (rows, columns), worlds = self._free[sight.cell].T, np.arange(len(sight.cell))
        (down, right) = np.array(ACTIONS).T
        there = self._distance[worlds[:, None], rows[:, None] + down, columns[:, None] + right]  # (B, 4)
        closer = there < self._distance[worlds, rows, columns][:, None]
        return closer.sum(axis=1), (~closer).argsort(axis=1, kind="stable")  # moves that lead closer come first

    def _learn(self, sight: ChildPercept, action: np.ndarray) -> None:
        """Remember the obstacle of the present move, for the next move."""
        target, index = self._target[sight.cell, action], self._index[sight.cell, action]
        guarded = (target == Target.STAIRWELL) & (len(self._free) + index == sight.caregiver_cell)
        worlds = np.flatnonzero((target != Target.FREE) & ~guarded)
        rows, columns = (self._free[sight.cell] + np.array(ACTIONS)[action])[worlds].T
        news = ~self._closed[worlds, rows, columns]
        self._closed[worlds, rows, columns] = True
        self._planned[worlds[news]] = NOTHING

    @staticmethod
    def _distances(closed: np.ndarray, goal: np.ndarray) -> np.ndarray:
        """Return the moves to a goal cell of each house, (n, 2), round closed cells, (n, rows, columns)."""
        distance = np.full(closed.shape, _FAR, np.int16)
        front = np.zeros(closed.shape, bool)
        front[np.arange(len(goal)), *goal.T] = True
        unseen = ~closed & ~front
        moves = 0
        while front.any():
            distance[front] = moves
            around = np.zeros_like(front)
            around[:, 1:] |= front[:, :-1]
            around[:, :-1] |= front[:, 1:]
            around[:, :, 1:] |= front[:, :, :-1]
            around[:, :, :-1] |= front[:, :, 1:]
            front = around & unseen
            unseen &= ~front
            moves += 1
        return distance
