"""What can be known of children that are only seen to move: what they want, and how much they stray."""

from __future__ import annotations

import numpy as np

from caregiver_mj.danger.chain import ChildChain

# Probability that a child which has not moved goes on with another epsilon: toddlers move in bouts, some with a goal
# and some without, and a stop ends one.
STOP = 0.3
SURPRISE = 8.0  # log of the odds against all that is believed, from which on a child is not understood
_FADES = 0.98  # of what was seen of a child in a cell, a timestep
_GOES_BACK = 2.0  # how far beyond `SURPRISE` the log odds can get, so that a child can be understood again


class Belief:
    """An exact Bayes filter over the goal and the epsilon of each child, for B worlds of K children at once.

    Every move makes those goals and epsilons more probable under which it was to be expected. A child that reaches its
    bin draws another goal: one that is seen to reach for a bin has done so if that was its goal. In between it keeps
    its goal; with probability `change`, in a timestep, it is another child from then on, drawn by the prior, so that
    what is long past counts less and less, and a child that changes is found out.

    It also says where it is at a loss (`understood`), as confidence-aware prediction does (Fridovich-Keil et al., arXiv
    1806.00109): it is compared with a predictor that knows nothing of houses, goals or bins, and expects a child to do
    in a cell what it did there before. Where that has been better by `SURPRISE` lately (CUSUM of the log likelihood
    ratio), the child does something else than what is believed in.

    Attributes:
        probability: Of every goal and epsilon, (B, K, G, E); the last two dimensions sum to 1.
    """

    def __init__(self, chain: ChildChain, batch: int = 1, children: int = 1, change: float = 0.0):
        self._chain, self._change = chain, change
        self._likelihood = np.ascontiguousarray(np.moveaxis(chain.moves, 3, 1))  # (cells, moves, G, E)
        self.probability = np.tile(chain.prior, (batch, children, 1, 1))
        cells, moves = chain.next_cell.shape
        self._seen = np.zeros((batch, children, cells, moves), np.float32)  # how often, lately
        self._surprise = np.zeros((batch, children))

    def watch(self, cell: np.ndarray, move: np.ndarray, caregiver_cell: np.ndarray | None = None) -> None:
        """Take in a move of every child, -1 for none, and the cell in which it was made, (B, K) both.

        The caregiver's cell is that in which it was then, (B,). Left out, no child goes after it.
        """
        chain = self._chain
        made = move >= 0
        likelihood = np.where(made[..., None, None], self._likelihood[cell, move], 1.0)
        if chain.follows is not None and caregiver_cell is not None:
            follows = chain.at_random(chain.follows(caregiver_cell[:, None], cell)[:, :, None])  # (B, K, E, moves)
            follows = np.take_along_axis(follows, np.maximum(move, 0)[..., None, None], axis=3)[..., 0]
            likelihood[..., -1, :] = np.where(made[..., None], follows, 1.0)
        probability = self.probability * likelihood
        total = probability.sum(axis=(2, 3), keepdims=True)
        self._compare(cell, move, total[..., 0, 0])
        # What no child does that there is: it tells nothing.
        probability = np.divide(probability, total, out=self.probability.copy(), where=total > 0)
        ends = chain.ends[cell, move] & made[..., None]  # (B, K, G)
        worlds, children = np.nonzero(ends.any(axis=2))
        if worlds.size:
            before = probability[worlds, children]
            freed = np.where(ends[worlds, children][..., None], before, 0.0)
            # Goal after goal, so that what is added up does not depend on how many children there are.
            probability[worlds, children] = (
                before - freed + (freed[:, :, None] * chain.next_goal[..., None]).sum(axis=1)
            )
        if self._change:
            probability += self._change * (chain.prior - probability)
            still = np.where(made, 0.0, STOP)[..., None, None]
            of_goal = probability.sum(axis=3, keepdims=True)
            share = chain.prior / chain.prior.sum(axis=1, keepdims=True)
            probability += still * (share * of_goal - probability)
        self.probability = probability

    def _compare(self, cell: np.ndarray, move: np.ndarray, expected: np.ndarray) -> None:
        """Hold what was expected of each move, (B, K), against what such children did where they were before."""
        worlds, children = np.nonzero(move >= 0)
        if not worlds.size:
            return
        self._seen[worlds, children] *= _FADES  # of those alone that moved: the others of a batch are none of theirs
        where = worlds, children, cell[worlds, children]
        seen, moves = self._seen[where], self._seen.shape[-1]
        what = move[worlds, children]
        usual = (seen[np.arange(len(what)), what] + 1.0 / moves) / (seen.sum(axis=1) + 1.0)
        odds = np.log(usual) - np.log(np.maximum(expected[worlds, children], 1e-12))
        surprise = np.clip(self._surprise[worlds, children] + odds, 0.0, SURPRISE + _GOES_BACK)
        self._surprise[worlds, children] = surprise
        self._seen[(*where, what)] += 1.0

    @property
    def understood(self) -> np.ndarray:
        """Whether each child does what is to be expected of those that are believed in, bool (B, K)."""
        return self._surprise < SURPRISE

    @property
    def epsilon(self) -> np.ndarray:
        """Probability of every epsilon, (B, K, E)."""
        return self.probability.sum(axis=2)

    @property
    def goal(self) -> np.ndarray:
        """Probability of every goal, (B, K, G)."""
        return self.probability.sum(axis=3)
