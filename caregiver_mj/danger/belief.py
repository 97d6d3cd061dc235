"""Belief about the goals and epsilons of children, inferred from their moves."""

from __future__ import annotations

import numpy as np

from caregiver_mj.danger.chain import ChildChain

# Probability that a child which has not moved continues with another epsilon: a stop ends a toddler's bout, with or
# without a goal. In 16 fresh houses, 20 episodes each of toddler:.5 and toddler:.05, two other models left no less
# damage: a kind with rests and goalless bouts among its goals (damage x 1.045, .99 to 1.09; moves denied .58 to .22),
# and a new epsilon after every stop, 1 or least with equal probability (x .97, .83 to 1.15; denied .58 to 1.22). The
# five novices never rest, and are unaffected.
STOP = 0.3
SURPRISE = 8.0  # log odds against the belief above which a child is not understood
_FADES = 0.98  # per timestep; decay of the counts of moves seen in a cell
_MARGIN = 2.0  # greatest excess of the log odds over `SURPRISE`, so that a child can be understood again


class Belief:
    """An exact Bayes filter over the goal and the epsilon of each child, for B worlds of K children at once.

    A child that reaches its goal draws another; until then it keeps it. With probability `change` per timestep it
    becomes another child, drawn from the prior, so that old evidence fades and changes are detected.

    `understood` tells where the model fails, as in confidence-aware prediction (Fridovich-Keil et al., arXiv
    1806.00109). The baseline predictor knows no house and no goals; it expects a child to repeat its earlier moves in a
    cell. A child does not fit the belief while the baseline's recent advantage (CUSUM of the log likelihood ratio)
    exceeds `SURPRISE`.

    Attributes:
        probability: Probability of every goal and epsilon, (B, K, G, E); the last two dimensions sum to 1.
    """

    def __init__(self, chain: ChildChain, batch: int = 1, children: int = 1, change: float = 0.0):
        self._chain, self._change = chain, change
        self._likelihood = np.ascontiguousarray(np.moveaxis(chain.moves, 3, 1))  # (cells, moves, G, E)
        self._of_goal = chain.prior / chain.prior.sum(axis=1, keepdims=True)  # prior of epsilon, (G, E)
        self.probability = np.tile(chain.prior, (batch, children, 1, 1))
        cells, moves = chain.next_cell.shape
        self._seen = np.zeros((batch, children, cells, moves), np.float32)  # fading counts of moves
        self._surprise = np.zeros((batch, children))

    def watch(self, cell: np.ndarray, move: np.ndarray, caregiver_cell: np.ndarray | None = None) -> None:
        """Update by a move of every child.

        Args:
            cell: The cell in which each move began, (B, K).
            move: The move, -1 for none, (B, K).
            caregiver_cell: The caregiver's cell at that time, (B,); None if no child can follow it.
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
        # A move that is impossible for every goal is no evidence.
        probability = np.divide(probability, total, out=self.probability.copy(), where=total > 0)
        ends = chain.ends[cell, move] & made[..., None]  # (B, K, G)
        worlds, children = np.nonzero(ends.any(axis=2))
        if worlds.size:
            before = probability[worlds, children]
            freed = np.where(ends[worlds, children][..., None], before, 0.0)
            # Summed goal by goal: rounding must not depend on the number of children.
            probability[worlds, children] = (
                before - freed + (freed[:, :, None] * chain.next_goal[..., None]).sum(axis=1)
            )
        if self._change:
            probability += self._change * (chain.prior - probability)
            still = np.where(made, 0.0, STOP)[..., None, None]
            probability += still * (self._of_goal * probability.sum(axis=3, keepdims=True) - probability)
        self.probability = probability

    def _compare(self, cell: np.ndarray, move: np.ndarray, expected: np.ndarray) -> None:
        """Compare the expected probability of each move, (B, K), with the baseline predictor's."""
        worlds, children = np.nonzero(move >= 0)
        if not worlds.size:
            return
        self._seen[worlds, children] *= _FADES  # of children that moved
        where = worlds, children, cell[worlds, children]
        seen, moves = self._seen[where], self._seen.shape[-1]
        what = move[worlds, children]
        usual = (seen[np.arange(len(what)), what] + 1.0 / moves) / (seen.sum(axis=1) + 1.0)
        odds = np.log(usual) - np.log(np.maximum(expected[worlds, children], 1e-12))
        surprise = np.clip(self._surprise[worlds, children] + odds, 0.0, SURPRISE + _MARGIN)
        self._surprise[worlds, children] = surprise
        self._seen[(*where, what)] += 1.0

    @property
    def understood(self) -> np.ndarray:
        """Whether each child fits the belief, bool (B, K)."""
        return self._surprise < SURPRISE

    @property
    def epsilon(self) -> np.ndarray:
        """Probability of every epsilon, (B, K, E)."""
        return self.probability.sum(axis=2)

    @property
    def goal(self) -> np.ndarray:
        """Probability of every goal, (B, K, G)."""
        return self.probability.sum(axis=3)
