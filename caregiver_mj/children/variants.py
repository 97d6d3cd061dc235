"""Variants of the novice: children that react to the caregiver, change, or do not know the house."""

from __future__ import annotations

import numpy as np

from caregiver_mj.children.behaviour import Behaviour, ChildPercept
from caregiver_mj.children.novice import Novice, shortest_path_actions
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, pick
from caregiver_mj.plans.cell_graph import ACTIONS, UNREACHABLE, Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

DRIFT = 0.35  # greatest deviation of epsilon from its mean in an episode: 0.05 to 0.75 around 0.4
STRIDE = 0.03  # step of epsilon's random walk in a timestep; without bounds 0.03 sqrt(200) = 0.42 in an episode
_DIGITS = 2**20  # a draw times this has a uniform fraction, practically independent of the next bin
SWITCH = EPISODE_TIMESTEPS // 2  # timestep, from 0, at whose start the toys move
_FAR = np.iinfo(np.int16).max  # distance without a known way


class Seeker(Novice):
    """Goes to the caregiver, except for a share epsilon of random moves; without a caregiver, a novice."""

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._adversary = Adversary(plan, epsilon)

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        seeks = (draws[:, 0] >= self.epsilons(len(draws))) & (sight.caregiver_cell != NOTHING)
        return np.where(seeks, self._adversary.act(sight, draws), super().act(sight, draws))


class Avoider(Novice):
    """A novice that treats the caregiver's cell as closed, and without another way runs into a caregiver that stays."""

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._round: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # by caregiver cell, as `shortest_path_actions`

    def ways(self, sight: ChildPercept) -> tuple[np.ndarray, np.ndarray]:
        count, actions = super().ways(sight)
        for cell in np.unique(sight.caregiver_cell).tolist():
            if 0 <= cell < len(self.plan.free_cells):  # a landing is on no path to a toy
                which = np.flatnonzero(sight.caregiver_cell == cell)
                if cell not in self._round:
                    self._round[cell] = self._ways_round(cell)
                counts, choices = self._round[cell]
                count[which] = counts[sight.cell[which], sight.goal[which]]
                actions[which] = choices[sight.cell[which], sight.goal[which]]
        return count, actions

    def _ways_round(self, cell: int) -> tuple[np.ndarray, np.ndarray]:
        graph, cells = self.plan.graph, len(self.plan.free_cells)
        landings = range(cells, len(self.plan.caregiver_cells))  # closed to children
        distance = graph.distances_from(graph.beside(self.plan.bins), [cell, *landings])[:, :cells].T.astype(int) + 1
        count, actions = shortest_path_actions(self.plan, distance)
        none = distance > UNREACHABLE
        count[none], actions[none] = self._greedy_count[none], self._greedy_actions[none]
        return count.astype(np.int8), actions.astype(np.int8)  # to save memory


class Adversary(Behaviour):
    """Runs into the caregiver by the shortest way; without a caregiver it goes north for ever."""

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        cells = len(plan.caregiver_cells)
        self._known = np.zeros(cells, bool)
        self._moves = np.zeros((cells, len(plan.free_cells)), np.int8)  # takes no memory until written

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        there = sight.caregiver_cell != NOTHING
        return np.where(there, self.towards(np.where(there, sight.caregiver_cell, 0), sight.cell), 0)

    def towards(self, goal: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return its moves towards caregiver cells from free cells, (...), computed on first use of a goal."""
        for new in np.unique(goal[~self._known[goal]]).tolist():
            self._moves[new] = self._ways(new)
            self._known[new] = True
        return self._moves[goal, cell].astype(int)

    def _ways(self, goal: int) -> np.ndarray:
        """Return its move towards a caregiver's cell from every free cell, (free cells,)."""
        plan = self.plan
        distance = plan.graph.distances_from([goal])[0].astype(float)
        distance[len(plan.free_cells) :] = np.inf  # it avoids stairs
        distance[goal] = 0.0  # except with the robot there
        distance = np.append(distance, np.inf)  # index -1: no cell
        return distance[plan.graph.around[: len(plan.free_cells)]].argmin(axis=1)


class _Timed(Novice):
    def reset(self, batch: int) -> None:
        self._timestep = 0

    def act(self, sight: ChildPercept, draws: np.ndarray) -> np.ndarray:
        action = super().act(sight, draws)
        self._timestep += 1
        return action


class Drifter(_Timed):
    """A novice that becomes careless, like a tiring child.

    Its epsilon rises linearly over an episode, then stays constant. The given epsilon is the mean of the range, which
    extends by at most `DRIFT` to either side.
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

    It begins with the given epsilon, and changes by `STRIDE` up or down after every move, equally likely, reflected at
    0 and 1.
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
    """A novice whose toys move during the episode.

    At timestep `SWITCH` all toys move from the first half of the bins, in the order of the plan, to the others. The
    child notices at once, and turns round on its way. With a single bin nothing changes.
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


class Explorer(Novice):
    """Takes the shortest way to its bin through a house of which it knows only the obstacles that it has bumped into.

    It knows its place, its bin and the size of the house, and assumes that all other cells are free. It remembers
    obstacles, stairs included, until the episode ends, but not a caregiver in its way. A share epsilon of its moves is
    random.
    """

    def __init__(self, plan: FloorPlan, epsilon: float):
        super().__init__(plan, epsilon)
        self._target, self._index = plan.graph.moves[1:]
        self._free, self._bins = np.array(plan.free_cells), np.array(plan.bins)  # rows and columns
        self.reset(1)

    def reset(self, batch: int) -> None:
        shape = (batch, *self.plan.shape)
        self._closed = np.zeros(shape, bool)  # known obstacles
        self._distance = np.full(shape, _FAR, np.int16)  # believed moves to its bin
        self._planned = np.full(batch, NOTHING)  # bin of these distances, NOTHING if outdated

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
        return closer.sum(axis=1), (~closer).argsort(axis=1, kind="stable")  # closer moves first

    def _learn(self, sight: ChildPercept, action: np.ndarray) -> None:
        """Remember the obstacle of the present move for the next one."""
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
