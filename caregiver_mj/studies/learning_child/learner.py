"""A child that learns by Q-learning; its table lasts from episode to episode."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, Sight
from caregiver_mj.plans.cell_graph import ACTIONS, Target
from caregiver_mj.plans.floor_plan import FloorPlan

TOY = 1.0  # reward for reaching the bin that it goes to; damage counts as it is, negative
RATE = 0.5  # share of an error that is learnt from at once
DISCOUNT = 0.95  # a move
TEMPERATURE = 0.5  # of the random moves of a wary child, in units of reward
_ALIKE = 1e-9  # values that only rounding tells apart


class Learner(Behaviour):
    """B children that learn, each for itself, of the same house.

    A child knows its cell and the bin that it goes to. A share epsilon of its moves is random, the others are those of
    greatest value, whichever of these. What is random is drawn among all four moves alike by the careless, and in
    proportion to exp(value / `TEMPERATURE`) by the wary, which so shun what they know to hurt.

    From every move it learns for all bins at once, for it is told where it led and what it hurt, and knows where the
    bins are: reaching a bin ends the way to that one alone.

    Attributes:
        values: Of every move on the way to every bin, (B, free cells, bins, 4); all 0 at first.
    """

    def __init__(self, plan: FloorPlan, epsilon: float, wary: np.ndarray):
        """Prepares children that know nothing.

        Args:
            plan: The house.
            epsilon: Share of moves that are random.
            wary: Whether each is wary, (B,).
        """
        super().__init__(plan, epsilon)
        self._wary, self._each = np.asarray(wary, bool), np.arange(len(wary))
        _, target, index = plan.graph.moves
        bins = np.arange(len(plan.bins))
        self._reaches = (target == Target.BIN)[..., None] & (index[..., None] == bins)  # (cells, 4, bins)
        self.values = np.zeros((len(wary), len(plan.free_cells), len(plan.bins), len(ACTIONS)))

    def act(self, sight: Sight, draws: np.ndarray) -> np.ndarray:
        values = self.values[self._each, sight.cell, sight.goal]
        best = values.max(axis=1, keepdims=True)
        at_random = np.where(self._wary[:, None], np.exp((values - best) / TEMPERATURE), 1.0)
        weight = np.where(draws[:, :1] < self.epsilon, at_random, values >= best - _ALIKE).cumsum(axis=1)
        return (draws[:, 1:2] * weight[:, -1:] >= weight).sum(axis=1)

    def learn(self, cell: np.ndarray, action: np.ndarray, damage: np.ndarray, next_cell: np.ndarray) -> None:
        """Learns from the last moves, (B,) each.

        Q(s, g, a) += `RATE` (r + `DISCOUNT` max_b Q(s', g, b) - Q(s, g, a)) for every bin g, without what is to come
        where the move has reached it.
        """
        reached = self._reaches[cell, action]  # (B, bins)
        to_come = self.values[self._each, next_cell].max(axis=2)
        aim = np.where(reached, TOY, DISCOUNT * to_come) - damage[:, None]
        known = self.values[self._each, cell, :, action]
        self.values[self._each, cell, :, action] = known + RATE * (aim - known)

    def believed_harmful(self) -> np.ndarray:
        """Which moves the children believe to do harm, bool (B, free cells, 4): of value below 0, the mean over bins.

        A move that has never hurt is worth 0 or more, and one that has just hurt by 1 or more less than that.
        """
        return self.values.mean(axis=2) < 0
