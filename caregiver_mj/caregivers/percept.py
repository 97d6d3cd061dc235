"""What a caregiver sees, how fast it is, what it believes of the children, and the numbers behind its decisions."""

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

HORIZON = 15  # timesteps: in as many the caregiver gets anywhere in most houses, and has moved a candle
_SURE = 0.9  # probability from which on a child is taken to follow the caregiver


@dataclasses.dataclass(frozen=True)
class Pace:
    """What the world of a caregiver tells it about its own speed. All times are in that of walking a cell."""

    cells: float = 3.0  #: cells that it walks in a novice timestep, once it is on its way
    get: float = 1.0  #: time to take a candle from a table that it stands beside
    place: float = 1.0  #: time to put one down there
    start: float = 0.0  #: time that it loses on each way by setting off and stopping
    close: float = 1.0  #: time to close a gate before which it stands
    pick_up: float = 1.0  #: time to pick up what lies on the floor where it stands
    #: time to walk into the next cell with a child so many cells ahead of this one, a row each, and so many to the
    #: side, a column each; beyond these, and with a child behind it, it is 1
    beside: tuple[tuple[float, ...], ...] = ()

    def way(self, step: np.ndarray, child: np.ndarray) -> np.ndarray:
        """Return the time to walk into the next cell, (...), by rows and columns of that and of the child, (..., 2).

        Both count from the cell in which it is.
        """
        ahead = (step * child).sum(axis=-1)
        if not self.beside:
            return np.ones(ahead.shape)
        aside = np.abs(step[..., 0] * child[..., 1] - step[..., 1] * child[..., 0])
        known = np.pad(self.beside, ((1, 1), (0, 1)), constant_values=1.0)  # behind it, and beyond
        return known[np.clip(ahead + 1, 0, len(known) - 1), np.minimum(aside, known.shape[1] - 1)]


PAPER = Pace()  # of the caregiver in the paper's grid: 5.0 km/h over the child's 1.6 km/h, rounded down (section V.C)


@dataclasses.dataclass(frozen=True)
class Percept:
    """What the caregiver sees of B worlds with K children each at one moment.

    Attributes:
        child_cell: Index of each child's free cell, (B, K).
        previous_cell: The cell in which it made its last move, (B, K).
        previous_action: That move, an index into `ACTIONS`, or NOTHING before the first one and for a child that made
            none, (B, K).
        caregiver_cell: Index of the caregiver's own cell in `FloorPlan.caregiver_cells`, (B,).
        candle_table: Index of the table on which each candle is, (B, candles), or NOTHING for one that is on none
            (it is in the caregiver's hand, or on the floor).
        holding: Index of the candle in the caregiver's hand, or NOTHING, (B,).
        candle_cell: Index of the free cell on whose floor each candle is, (B, candles), or NOTHING. Left out where
            no candle can be on the floor, as in the grid.
        out_of_reach: Whether a hazard is to be passed over, because the caregiver could not get to it lately, or there
            is nothing more to be done about it, (B, hazards). Left out if there is none.
        shut: Whether each opening is shut, so that no child gets through, (B, openings). Left out if none is.
        gone: Whether each hazard on the floor is gone, (B, hazards on the floor). Left out if none is.
        time_left: Share of a novice timestep until the children make their next moves, those of which `child_cell`
            does not know yet, (B,). Left out where all of it is left.
        clock: Novice timesteps since the start of the episode, with their fraction, (B,). Left out where nobody asks.
        under_way: Number of the hazard that the caregiver is about, or NOTHING, (B,). Left out likewise.
        belief: What is believed of the children, some of which are not seen: `child_cell` is then the most probable
            cell, and the last move NOTHING. Left out where all are seen, always.
        hears: Whether, with a candle in the hand, it takes notice of stairwells, and puts it down the sooner, (B,).
            Left out where it does not.
        frames: Draws what cameras see now, in a batch of one: by their names, uint8 (240, 320, 3). They are the robot's
            `eye` and, where everything is seen, the `overview`. Left out where there are none, as in the grid.
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
    #: what decides between the hazards: their dangers, put together over the children and divided by the greatest 1 -
    #: P(safe) of any child, (B, hazards)
    urgency: np.ndarray
    #: belief about the children and what follows from it, of a caregiver that looks ahead
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


# Made once for a chain.
_passages = functools.lru_cache(maxsize=4)(first_passage)
_entries = functools.lru_cache(maxsize=4)(first_entry)


class Followers:
    """Finds out which children go wherever the caregiver is: what it stands beside they stand beside."""

    def __init__(self, plan: FloorPlan, batch: int, children: int):
        self.belief = Belief(child_chain(plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        """Take in the children's last moves."""
        if percept.belief:
            self.belief = percept.belief
        else:
            self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    @property
    def there(self) -> np.ndarray:
        """Whether some child follows the caregiver and hardly ever strays, bool (B,)."""
        return np.any(self.belief.probability[..., -1, 0] > _SURE, axis=1)
