"""Belief about children that are sometimes unseen: an exact Bayes filter over cell, goal and epsilon."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from caregiver_mj.danger.belief import SURPRISE, Belief
from caregiver_mj.danger.chain import ChildChain

_IMPOSSIBLE = 1e-6  # probability of a cell below which a child's appearance there is a surprise


class Tracker(Belief):
    """A `Belief` about children that are sometimes unseen.

    Its evidence is the place and move of a child in view, and visible cells without an unseen child. Unseen children
    move by the chain. A child that appears in an impossible cell is a surprise, which resets the belief about it.

    Attributes:
        joint: Probability of every cell, goal and epsilon, (B, K, cells, G, E), single precision.
        seen: Whether each child is in view, bool (B, K).
        cell: Its cell, or the most probable one, (B, K).
        surprised: Whether it appeared in an impossible cell in this timestep, bool (B, K).
    """

    def __init__(self, chain: ChildChain, batch: int = 1, children: int = 1, change: float = 0.0):
        """Begin with uniform presence of every child."""
        super().__init__(chain, batch, children, change)
        cells, goals, epsilons = chain.shape
        self._onwards = csr_array(chain.transition.T.astype(np.float32))
        self._prior = np.ascontiguousarray(
            np.broadcast_to(chain.prior / cells, (cells, goals, epsilons)).astype(np.float32)
        )
        self.joint = np.tile(self._prior, (batch, children, 1, 1, 1))
        self.seen, self._certain = np.zeros((2, batch, children), bool)
        self.cell = np.zeros((batch, children), int)
        self.surprised = np.zeros((batch, children), bool)

    @property
    def presence(self) -> np.ndarray:
        """Probability of each cell, (B, K, cells)."""
        return self.joint.sum(axis=(3, 4))

    def move(
        self,
        previous: np.ndarray,
        action: np.ndarray,
        cell: np.ndarray,
        in_view: np.ndarray,
        caregiver_cell: np.ndarray | None = None,
    ) -> None:
        """Update by a timestep of every child; -1 stands for anything unseen.

        Args:
            previous: The cell in which each move began, (B, K).
            action: The move, -1 also for none, (B, K).
            cell: The cell after it, (B, K).
            in_view: Whether each cell is in view now, bool (B, cells).
            caregiver_cell: The caregiver's cell, (B,).
        """
        known = (previous >= 0) & (cell >= 0)
        self.surprised[:] = False
        super().watch(np.where(known, previous, 0), np.where(known, action, -1), caregiver_cell)
        worlds, children = np.nonzero(~known)
        self._certain &= known
        if worlds.size:
            now = self.joint[worlds, children]
            then = (self._onwards @ now.reshape(len(now), -1).T).T.reshape(now.shape)
            then += np.float32(self._change) * (then.sum(axis=(2, 3), keepdims=True) * self._chain.prior - then)
            self.joint[worlds, children] = then
        worlds, children = np.nonzero(known)
        self._place(worlds, children, cell[worlds, children])
        self.look(cell, in_view, ~known)

    def look(self, cell: np.ndarray, in_view: np.ndarray, which: np.ndarray | bool = True) -> None:
        """Update by a new view, after a move or turn of the caregiver but not of a child.

        Args:
            cell: The cell of each child, -1 if unseen, (B, K).
            in_view: Whether each cell is in view, bool (B, cells).
            which: Children to update, bool (B, K).
        """
        self.seen = cell >= 0
        news = which & ~(self.seen & self._certain)
        found = news & self.seen
        worlds, children = np.nonzero(found)
        if worlds.size:
            at = cell[worlds, children]
            there = self.joint[worlds, children, at]
            chance = there.sum(axis=(1, 2))
            expected = chance > _IMPOSSIBLE
            self.surprised[worlds, children] = ~expected
            self._surprise[worlds[~expected], children[~expected]] = SURPRISE
            there = np.where(expected[:, None, None], there, self._chain.prior)
            self.probability[worlds, children] = there / there.sum(axis=(1, 2), keepdims=True)
            self._place(worlds, children, at)
        worlds, children = np.nonzero(news & ~self.seen)
        if worlds.size:
            hidden = ~in_view[worlds]
            left = self.joint[worlds, children] * hidden[..., None, None]
            total = left.sum(axis=(1, 2, 3), keepdims=True)
            lost = total[:, 0, 0, 0] <= _IMPOSSIBLE
            if lost.any():
                left[lost] = self._prior * hidden[lost][..., None, None]
                total[lost] = left[lost].sum(axis=(1, 2, 3), keepdims=True)
            left = np.divide(left, total, out=self.joint[worlds, children], where=total > 0)
            self.joint[worlds, children] = left
            self.probability[worlds, children] = left.sum(axis=1)
            self.cell[worlds, children] = left.sum(axis=(2, 3)).argmax(axis=1)

    def _place(self, worlds: np.ndarray, children: np.ndarray, cell: np.ndarray) -> None:
        """Make the cells of some children certain, (n,) each."""
        self.joint[worlds, children] = 0.0
        self.joint[worlds, children, cell] = self.probability[worlds, children]
        self.cell[worlds, children] = cell
        self._certain[worlds, children] = True
