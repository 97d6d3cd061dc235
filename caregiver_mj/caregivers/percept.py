"""A caregiver's percept, pace, predictions and assessments."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator

import numpy as np

from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.chain import ChildChain, first_entry, first_passage, presence
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.plans.cell_graph import CellGraph
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

HORIZON = 15  # novice timesteps; enough to move a candle in most houses
_SURE = 0.9  # probability above which a child counts as following the caregiver


@dataclasses.dataclass(frozen=True)
class Pace:
    """Durations of a caregiver's actions in its world, in units of the time to walk a cell."""

    cells: float = 3.0  #: cells walked in a novice timestep, at full speed
    get: float = 1.0  #: time to take a candle from the table beside it
    place: float = 1.0  #: time to put one down there
    start: float = 0.0  #: time lost on each way by starting and stopping
    close: float = 1.0  #: time to close the gate before it
    pick_up: float = 1.0  #: time to pick up a thing from the floor
    #: time to walk into the next cell, by cells to a child ahead (row) and aside (column); 1 beyond, and with it behind
    beside: tuple[tuple[float, ...], ...] = ()

    def way(self, step: np.ndarray, child: np.ndarray) -> np.ndarray:
        """Return the time to walk into the next cell, (...).

        Row and column of the next cell (`step`) and of the child are relative to the present cell, (..., 2).
        """
        ahead = (step * child).sum(axis=-1)
        if not self.beside:
            return np.ones(ahead.shape)
        aside = np.abs(step[..., 0] * child[..., 1] - step[..., 1] * child[..., 0])
        known = np.pad(self.beside, ((1, 1), (0, 1)), constant_values=1.0)  # behind it, and beyond
        return known[np.clip(ahead + 1, 0, len(known) - 1), np.minimum(aside, known.shape[1] - 1)]


PAPER = Pace()  # in the paper's grid: 5.0 km/h over the child's 1.6 km/h, rounded down (section V.C)


@dataclasses.dataclass(frozen=True)
class Percept:
    """Observation of B worlds with K children each. For optional boolean arrays None means all False.

    Attributes:
        child_cell: Index of each child's free cell, (B, K).
        previous_cell: The cell in which each child made its last move, (B, K).
        previous_action: That move, an index into `ACTIONS`, or NOTHING for none, (B, K).
        caregiver_cell: Index of the caregiver's cell in `FloorPlan.caregiver_cells`, (B,).
        candle_table: Index of each candle's table, NOTHING for one in the hand or on the floor, (B, candles).
        holding: Index of the candle in the caregiver's hand, or NOTHING, (B,).
        candle_cell: Index of the free cell of each candle on the floor, or NOTHING, (B, candles). None in the grid.
        out_of_reach: Whether each hazard is in cooldown or needs nothing more, (B, hazards).
        shut: Whether each opening is shut, so that no child gets through, (B, openings).
        gone: Whether each hazard on the floor is gone, (B, hazards on the floor).
        time_left: Share of a novice timestep until the children's next moves, (B,). None for 1.
        clock: Novice timesteps since the start of the episode, with their fraction, (B,). None if not needed.
        under_way: Number of the hazard under intervention, or NOTHING, (B,). None if not needed.
        belief: Belief about children that may be unseen: `child_cell` is then the most probable cell, and the last
            move NOTHING. None if all are always in view.
        hears: Whether stairwells are valid targets with a candle in the hand, which is then put down sooner, (B,).
        frames: Renders the camera images, in a batch of one, by camera name, uint8 (240, 320, 3): the robot's `eye`
            and, with full sight, the `overview`. None in the grid.
    """

    child_cell: np.ndarray
    previous_cell: np.ndarray
    previous_action: np.ndarray
    caregiver_cell: np.ndarray
    candle_table: np.ndarray
    holding: np.ndarray
    candle_cell: np.ndarray | None = None
    out_of_reach: np.ndarray | None = None
    shut: np.ndarray | None = None
    gone: np.ndarray | None = None
    time_left: np.ndarray | None = None
    clock: np.ndarray | None = None
    under_way: np.ndarray | None = None
    hears: np.ndarray | None = None
    belief: Tracker | None = None
    frames: Callable[[], dict[str, np.ndarray]] | None = None

    def fallen(self, graph: CellGraph) -> Iterator[tuple[int, int, np.ndarray]]:
        """Yield each candle on the floor: its world, its number, and the moves to it from every cell, (cells,)."""
        if self.candle_cell is not None:
            for world, candle in np.argwhere(self.candle_cell != NOTHING).tolist():
                yield world, candle, graph.distances_from([int(self.candle_cell[world, candle])])[0]


@dataclasses.dataclass(frozen=True)
class Assessment:
    """The numbers behind a decision."""

    safe: np.ndarray  #: P(safe|tau) of every child, (B, K)
    reach: np.ndarray  #: P(reach_o|tau) of every hazard by every child, (B, K, hazards)
    danger: np.ndarray  #: expected danger of every hazard to every child, equation (2), (B, K, hazards)
    #: score that decides between hazards: their dangers, summed over the children and divided by the greatest
    #: 1 - P(safe) of any child, (B, hazards)
    urgency: np.ndarray
    #: belief about the children and its consequences, from a caregiver that looks ahead
    prediction: Prediction | None = None


def bare_tables(candle_table: np.ndarray, tables: int) -> np.ndarray:
    """Return which tables bear no candle, bool (B, tables), by the table of each candle, (B, candles)."""
    bare = np.ones((len(candle_table), tables), bool)
    worlds, candles = np.nonzero(candle_table != NOTHING)
    bare[worlds, candle_table[worlds, candles]] = False
    return bare


@dataclasses.dataclass(frozen=True)
class Prediction:
    """Belief about K children in each of B worlds, and predictions from it."""

    chain: ChildChain  #: model of the children's moves; some of its goals are toy bins
    cell: np.ndarray  #: free cell of each child, (B, K)
    probability: np.ndarray  #: of every goal and epsilon of each child, (B, K, G, E)
    #: of every cell, goal and epsilon, (B, K, cells, G, E), where some children are unseen
    joint: np.ndarray | None = None

    @property
    def goal(self) -> np.ndarray:
        """Probability of every goal, (B, K, G)."""
        return self.probability.sum(axis=3)

    @property
    def toy_bin(self) -> np.ndarray:
        """Probability that each child is on its way to each toy bin, (B, K, bins)."""
        return self.goal @ (self.chain.bin_of[:, None] == np.arange(self.chain.bin_of.max() + 1))

    @property
    def epsilon(self) -> np.ndarray:
        """Probability of every epsilon in `chain.epsilons`, (B, K, E)."""
        return self.probability.sum(axis=2)

    def reach(self, plan: FloorPlan, percept: Percept, timesteps: int = HORIZON) -> np.ndarray:
        """Return the probability that each child runs into each hazard within some timesteps, (B, K, hazards).

        For a candle on the floor the probability is one over its distance in moves.
        """
        cells, goals, epsilons = self.chain.shape
        passage = _passages(self.chain, timesteps).reshape(cells, goals * epsilons, -1)
        reach = self.expected(passage)  # stairwells, then tables
        stairwells, tables = np.split(reach, [len(plan.stairwells)], axis=2)
        table = percept.candle_table[:, None]
        candles = np.take_along_axis(tables, np.where(table == NOTHING, 0, table), axis=2) if tables.size else tables
        candles = np.where(table == NOTHING, 0.0, candles)
        for world, candle, steps in percept.fallen(plan.graph):
            candles[world, :, candle] = 1.0 / np.maximum(1, steps[self.cell[world]])
        entry = _entries(self.chain, plan.floor_cells, timesteps)
        entry = entry.reshape(cells, goals * epsilons, len(plan.floor_cells))
        lying = self.expected(entry)
        if percept.gone is not None:
            lying = np.where(percept.gone[:, None], 0.0, lying)
        return plan.hazards.join(stairwells, candles, lying)

    def expected(self, values: np.ndarray) -> np.ndarray:
        """Return the expectation for each child, (B, K, n), of values by its state, (cells, G E, n)."""
        if self.joint is not None:
            return np.einsum("bkcg,cgo->bko", self.joint.reshape(*self.cell.shape, *values.shape[:2]), values)
        belief = self.probability.reshape(*self.cell.shape, values.shape[1])
        return np.einsum("bkg,bkgo->bko", belief, values[self.cell])

    def presence(self, timesteps: int) -> np.ndarray:
        """Return the probability of each child in each free cell within some timesteps, (B, K, free cells)."""
        cells = self.chain.shape[0]
        found = np.empty((*self.cell.shape, cells))
        for child in np.ndindex(self.cell.shape):
            now = np.zeros(self.chain.shape)
            if self.joint is None:
                now[self.cell[child]] = self.probability[child]
            else:
                now[:] = self.joint[child]
            found[child] = presence(self.chain, now.ravel(), timesteps)
        return found


# cached, by chain
_passages = functools.lru_cache(maxsize=4)(first_passage)
_entries = functools.lru_cache(maxsize=4)(first_entry)


class Followers:
    """Detects children that follow the caregiver, and so would come along to every hazard."""

    def __init__(self, plan: FloorPlan, batch: int, children: int):
        self.belief = Belief(child_chain(plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        """Observe the children's last moves."""
        if percept.belief:
            self.belief = percept.belief
        else:
            self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    @property
    def there(self) -> np.ndarray:
        """Whether a child follows the caregiver almost surely, bool (B,)."""
        return np.any(self.belief.probability[..., -1, 0] > _SURE, axis=1)
