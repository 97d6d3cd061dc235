"""What can be known of children that are only seen to move: where they are heading, and how much they stray."""

from __future__ import annotations

import numpy as np

from caregiver_mj.danger.chain import ChildChain


class Belief:
    """An exact Bayes filter over the goal and the epsilon of each child, for B worlds of K children at once.

    Every move makes those goals and epsilons more probable under which it was to be expected. A child that reaches its
    goal draws another one, each with the same probability: one that is seen to reach for something has done so if that
    was its goal. In between it keeps its goal; its epsilon it draws anew now and then, so that what is long past
    counts less and less, and a child that changes is found out.

    Attributes:
        probability: Of every goal and epsilon, (B, K, G, E); the last two dimensions sum to 1.
    """

    def __init__(self, chain: ChildChain, batch: int = 1, children: int = 1, change: float = 0.0):
        """Begins with every goal and every epsilon equally probable.

        Args:
            chain: How the children are thought to move.
            batch: B.
            children: K.
            change: Probability, in a timestep, that a child's epsilon is drawn anew.
        """
        self._goals, epsilons = chain.shape[1:]
        self._goal_at, self._change = chain.goal_at, change
        self._likelihood = np.ascontiguousarray(np.moveaxis(chain.moves, 3, 1))  # (cells, moves, G, E)
        self._prior = 1.0 / epsilons
        self.probability = np.full((batch, children, self._goals, epsilons), 1.0 / (self._goals * epsilons))

    def watch(self, cell: np.ndarray, move: np.ndarray) -> None:
        """Takes in a move of every child.

        Args:
            cell: The cell in which it was made, (B, K).
            move: The move, (B, K), or -1 for a child that made none: it tells nothing.
        """
        made = move >= 0
        probability = self.probability * np.where(made[..., None, None], self._likelihood[cell, move], 1.0)
        total = probability.sum(axis=(2, 3), keepdims=True)
        # What no child does that there is: it tells nothing either.
        probability = np.divide(probability, total, out=self.probability.copy(), where=total > 0)
        reached = np.where(made, self._goal_at[cell, move], -1)
        worlds, children = np.nonzero(reached >= 0)
        if worlds.size:
            goal = reached[worlds, children]
            freed = probability[worlds, children, goal].copy()  # (n, E)
            probability[worlds, children, goal] = 0.0
            probability[worlds, children] += freed[:, None] / self._goals
        if self._change:
            of_goal = probability.sum(axis=3, keepdims=True)
            probability += self._change * (self._prior * of_goal - probability)
        self.probability = probability

    @property
    def epsilon(self) -> np.ndarray:
        """Probability of every epsilon, (B, K, E)."""
        return self.probability.sum(axis=2)

    @property
    def goal(self) -> np.ndarray:
        """Probability of every goal, (B, K, G)."""
        return self.probability.sum(axis=3)
