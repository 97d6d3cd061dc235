"""The switcher: a child whose toys are carried elsewhere in the middle of the episode."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.tape import EPISODE_TIMESTEPS, pick
from caregiver_mj.plans.floor_plan import FloorPlan

SWITCH = EPISODE_TIMESTEPS // 2  # the timestep before which the toys are carried, counted from 0


class Switcher(Novice):
    """A novice that wants to the bins with toys in them: to one half of the bins at first, then to the other half.

    The bins of a house stay where they are, for they are part of its walls to robot and child. What moves is what the
    child wants of them: before timestep `SWITCH` somebody carries all toys from the first half of the bins, in the
    order of the plan, to the others. The child sees that, and turns round on its way. A house with one bin has all toys
    in that one.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._half = (len(plan.bins) + 1) // 2
        self.reset(1)

    def reset(self, batch: int) -> None:
        self._timestep = 0

    def act(self, sight: Sight, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        self._timestep += 1
        return action

    def reconsider(self, goal: np.ndarray, draw: np.ndarray) -> np.ndarray:
        first, count = self._with_toys
        return np.where((goal >= first) & (goal < first + count), goal, self.next_bin(draw))

    def next_bin(self, draw: np.ndarray) -> np.ndarray:
        first, count = self._with_toys
        return first + pick(draw, count)

    @property
    def _with_toys(self) -> tuple[int, int]:
        """The first bin with toys in it, and how many such there are."""
        others = len(self.plan.bins) - self._half
        return (0, self._half) if self._timestep < SWITCH or not others else (self._half, others)
