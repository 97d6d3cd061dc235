"""Children that change during an episode: their epsilon changes, or their toys move."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import ChildPercept
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, pick
from caregiver_mj.plans.floor_plan import FloorPlan

DRIFT = 0.35  # difference of epsilon at the ends of an episode from its mean: 0.05 to 0.75 around 0.4
STRIDE = 0.03  # step of epsilon's random walk per timestep; unbounded, 0.03 sqrt(200) = 0.42 in an episode
_DIGITS = 2**20  # the fraction of a draw times this is uniform and practically independent of the next bin
SWITCH = EPISODE_TIMESTEPS // 2  # timestep, from 0, before which the toys move


class _Timed(Novice):
    def reset(self, batch: int) -> None:
        self._timestep = 0

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        self._timestep += 1
        return action


class Drifter(_Timed):
    """A novice that becomes careless, like a tiring child.

    Its epsilon rises linearly over an episode, and stays constant afterwards. The given epsilon is the mean of the
    range, which extends by at most `DRIFT` to either side.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._drift = min(DRIFT, self.epsilon, 1.0 - self.epsilon)
        self.reset(1)

    def epsilons(self, batch: int) -> np.ndarray:
        share = min(1.0, self._timestep / (EPISODE_TIMESTEPS - 1))
        return np.full(batch, self.epsilon + self._drift * (2.0 * share - 1.0))


class Waverer(Novice):
    """A novice whose epsilon is a random walk.

    It begins with the given epsilon, and changes by `STRIDE` up or down after every move, with equal probability,
    reflected at 0 and 1.
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
    """A novice that goes to one half of the toy bins at first, then to the other half.

    Before timestep `SWITCH` all toys move from the first half of the bins, in the order of the plan, to the others. The
    child notices at once, and turns round on its way. In a house with one bin nothing changes.
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
        """The first bin with toys, and the number of bins with toys."""
        others = len(self.plan.bins) - self._half
        return (0, self._half) if self._timestep < SWITCH or not others else (self._half, others)
