"""Where children are that are not seen all the time: an exact Bayes filter over cell, goal and epsilon."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from caregiver_mj.danger.belief import SURPRISE, Belief
from caregiver_mj.danger.chain import ChildChain

_IMPOSSIBLE = 1e-6  # probability of a cell below which a child that turns up there is a surprise


class Tracker(Belief):
    """A `Belief` of children of whom the caregiver sees some, sometimes.

    What it goes by: a child that is seen is where it is seen, and made the move that it was seen to make; one that is
    not seen is in none of the cells in view; in between it moves as the chain says. One that turns up where it cannot
    be is a surprise: then nothing that was believed of it holds.

    Attributes:
        joint: Probability of every cell, goal and epsilon, (B, K, cells, G, E), single precision.
        seen: Whether each child is seen now, bool (B, K).
        cell: Its cell, or the most probable one, (B, K).
        surprised: Whether it has turned up where it could not be, in this timestep, bool (B, K).
    """

    def __init__(self, chain: ChildChain, batch: int = 1, children: int = 1, change: float = 0.0):
        """Believe of each child that it may be anywhere."""
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
        """Take in a timestep of every child, as far as it has been seen; -1 is for what has not.

        That is the previous cell, in which its move began, the action, -1 also if it made none, and the cell in which
        it is now, (B, K) each. The cells in view now are bool (B, cells), the caregiver's is (B,).
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
        """Take in what is seen after the caregiver has moved, or turned, and no child has.

        Args:
            cell: The cell in which each child is, (B, K), or -1 for a child that is not seen.
            in_view: Which cells are seen, bool (B, cells).
            which: Children of whom that is news, bool (B, K).
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
        """Know some children to be in some cells, (n,) each."""
        self.joint[worlds, children] = 0.0
        self.joint[worlds, children, cell] = self.probability[worlds, children]
        self.cell[worlds, children] = cell
        self._certain[worlds, children] = True
