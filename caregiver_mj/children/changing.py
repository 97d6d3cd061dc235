"""Children that change in the middle of an episode: their epsilon does, or their toys are carried elsewhere."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, pick
from caregiver_mj.plans.floor_plan import FloorPlan

DRIFT = 0.35  # by how much epsilon differs, at the ends of an episode, from its mean: 0.05 to 0.75 around 0.4
STRIDE = 0.03  # of the walk of epsilon in a timestep; in an episode that would be 0.03 sqrt(200) = 0.42, were it free
_DIGITS = 2**20  # a draw times this has a fraction that is uniform too, and that tells nothing of the next bin
SWITCH = EPISODE_TIMESTEPS // 2  # the timestep before which the toys are carried, counted from 0


class _Timed(Novice):
    def reset(self, batch: int) -> None:
        self._timestep = 0

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        self._timestep += 1
        return action


class Drifter(_Timed):
    """A novice that grows careless: a child that tires.

    In every timestep its epsilon is higher by as much, from one end of its range to the other, and stays there after an
    episode's length. The epsilon by which it is called is the mean: the range is as wide on either side of that, and
    `DRIFT` at most.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._drift = min(DRIFT, self.epsilon, 1.0 - self.epsilon)
        self.reset(1)

    def epsilons(self, batch: int) -> np.ndarray:
        share = min(1.0, self._timestep / (EPISODE_TIMESTEPS - 1))
        return np.full(batch, self.epsilon + self._drift * (2.0 * share - 1.0))


class Waverer(Novice):
    """A novice whose epsilon goes up and down at random: now careful, now careless.

    It begins with the epsilon by which it is called. After every move that is higher or lower by `STRIDE`, with equal
    probability; what would be below 0 or above 1 is reflected there.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self.reset(1)

    def reset(self, batch: int) -> None:
        self._epsilons = np.full(batch, self.epsilon)

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        up = draws[:, 2] * _DIGITS % 1.0 < 0.5
        walked = np.abs(self._epsilons + np.where(up, STRIDE, -STRIDE))
        self._epsilons = 1.0 - np.abs(1.0 - walked)
        return action

    def epsilons(self, batch: int) -> np.ndarray:
        return self._epsilons.copy()


class Switcher(_Timed):
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
