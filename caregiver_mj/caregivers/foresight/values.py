"""What is to come, for everything that the caregiver can be about: a dynamic programme over layouts of candles.

Where children go does not depend on the caregiver, but for the few moves that its body blocks. So all damage by candles
is the sum of that which each would do if it stayed where it is for ever, and of what relocations change about it; bumps
into bare tables are always the same. Values here are differences from candles that stay and stairwells that are shut.

The caregiver is at a *post* (in a stairwell) or beside a table where it has just put a candle down. From there it goes
to a post, or carries a candle from one table to another; it does not turn round on the way. Time counts in children's
moves.
"""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.layouts import Layouts
from caregiver_mj.caregivers.foresight.travel import (
    ACTIONS_PER_TIMESTEP,
    HANDLING,
    Start,
    Travel,
    timesteps,
    travel,
)
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.danger.passage import expected_hits
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

DISCOUNT = 0.985  # of damage, a timestep
ROUNDS, WAITS = 8, 15  # rounds of iteration over the options, and over how long to wait for one in each
# Of a caregiver that has put a candle down: actions that it has left in that timestep, on an average.
_LEFT_AFTER = 1


@functools.lru_cache(maxsize=2)
def values(plan: FloorPlan) -> Values:
    """The values of a house; made once."""
    return Values(plan)


class Values:
    """Expected discounted damage to come for one child, of which cell, goal and epsilon are known.

    Those of a cell are one row of numbers, G E of them, one for each goal and epsilon.

    Attributes:
        ways: The caregiver's ways.
        stairwells: How many stairwells there are.
        layouts: The layouts of the candles.
        arrival: Value of being at a post, or of having put a candle down, after so many timesteps in which all
            stairwells are open, (timesteps, columns, cells, G E). There is a column for every layout and post, and one
            for every layout and table that bears a candle; that candle's own damage from then on is counted, too.
        post_column: Columns of the posts, (layouts, posts).
        table_column: Columns of the tables, (layouts, tables).
        staying: Damage from then on of a candle that stays on a table after so many timesteps,
            (timesteps, tables, cells, G E).
        at_large: Damage of stairwells that stay open, (cells, G E).
    """

    def __init__(self, plan: FloorPlan, rounds: int = ROUNDS, waits: int = WAITS):
        self._chain, self.ways = novice_chain(plan), travel(plan)
        chain, ways = self._chain, self.ways
        self.layouts = Layouts(len(plan.tables), len(plan.candle_tables))
        stairwells = self.stairwells = len(plan.stairwells)
        cells, goals, epsilons = chain.shape
        self._rows = cells, goals * epsilons
        self._next = (DISCOUNT * chain.transition).astype(np.float32)
        self._next.indices, self._next.indptr = (a.astype(np.int32) for a in (self._next.indices, self._next.indptr))
        fall = (plan.damage.stairwell * chain.hits[:, :stairwells]).astype(np.float32)
        self._open = fall.sum(axis=1)  # damage of the next move if all stairwells are open, (states,)
        self._guarded = self._open[:, None] - fall if stairwells else np.zeros((chain.size, 1), np.float32)
        harm = plan.damage.candle - plan.damage.table
        forever = expected_hits(chain, DISCOUNT)
        self.at_large = self._by_cell(plan.damage.stairwell * forever[:, :stairwells].sum(axis=1).astype(np.float32))
        self._longest = _longest(ways)
        self.staying = self._ahead((harm * forever[:, stairwells:]).astype(np.float32))
        self._exposed = self._by_time(self._open)
        count, posts = len(self.layouts), ways.posts
        self.post_column = np.arange(count * posts).reshape(count, posts)
        self.table_column = np.full((count, len(plan.tables)), NOTHING)
        self.table_column[self.layouts.bears] = count * posts + np.arange(self.layouts.bears.sum())
        self._posts = [_Departure(ways.from_post(post), ACTIONS_PER_TIMESTEP) for post in range(posts)]
        self._tables = [_Departure(ways.from_table(table), _LEFT_AFTER) for table in range(len(plan.tables))]
        self.arrival = self._solve(rounds, waits)

    # -- The programme ---------------------------------------------------------------------------

    def _solve(self, rounds: int, waits: int) -> np.ndarray:
        """Begins with a caregiver that only ever guards, and lets it do more and more, round by round."""
        posts = len(self._posts)
        columns = int(self.table_column.max(initial=self.post_column.max())) + 1
        # Guarding does not depend on the layout.
        guard = np.zeros((self._chain.size, posts), np.float32)
        for _ in range(rounds):
            arrival = self._ahead(guard) + self._exposed[:, None]
            leave = np.stack([self._flat(d.guards(arrival, np.arange(posts)).min(axis=0)) for d in self._posts], axis=1)
            guard = self._wait(guard, leave, waits)
        value = np.empty((self._chain.size, columns), np.float32)
        value[:, self.post_column] = guard[:, None]
        arrival = self._ahead(guard) + self._exposed[:, None]
        for table, departure in enumerate(self._tables):
            best = self._flat(departure.guards(arrival, np.arange(posts)).min(axis=0))
            column = self.table_column[:, table]
            value[:, column[column != NOTHING]] = best[:, None]
        for _ in range(rounds if self.table_column.size else 0):
            arrival = self._arrival(value)
            leave = np.empty((self._chain.size, *self.post_column.shape), np.float32)
            for post, departure in enumerate(self._posts):
                leave[:, :, post] = self._flat(self._best(departure, arrival, np.arange(len(self.layouts))))
            at_posts = value[:, : self.post_column.size].reshape(leave.shape)
            waited = self._wait(at_posts.reshape(len(value), -1), leave.reshape(len(value), -1), waits)
            value = value.copy()
            value[:, : self.post_column.size] = waited
            for table, departure in enumerate(self._tables):
                which = np.flatnonzero(self.layouts.bears[:, table])
                value[:, self.table_column[which, table]] = self._flat(self._best(departure, arrival, which))
        return self._arrival(value)

    def _wait(self, value: np.ndarray, leave: np.ndarray, waits: int) -> np.ndarray:
        """Values of being at a post when a child is about to move, if one may leave after any of its moves.

        Args:
            value: Those found so far, (states, columns), in which the post runs fastest.
            leave: Values of leaving after a move, likewise.
            waits: For how many moves more it may wait.
        """
        cost = np.tile(self._guarded, value.shape[1] // self._guarded.shape[1])
        for _ in range(waits):
            value = cost + self._next @ np.minimum(value, leave)
        return value

    def _best(self, departure: _Departure, arrival: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Value of the best thing to do in some layouts, (layouts, cells, G E)."""
        best = departure.guards(arrival, self.post_column[which].T).min(axis=0)
        after = self.layouts.after[which]
        for source, target in zip(*np.nonzero((after != NOTHING).any(axis=0)), strict=True):
            here = np.flatnonzero(after[:, source, target] != NOTHING)
            column = self.table_column[after[here, source, target], target]
            found = departure.relocates(arrival, self.staying, source, target, column)
            best[here] = np.minimum(best[here], found)
        return best

    def _arrival(self, value: np.ndarray) -> np.ndarray:
        arrival = self._ahead(value)
        arrival += self._exposed[:, None]
        for table, column in enumerate(self.table_column.T):
            arrival[:, column[column != NOTHING]] += self.staying[:, table, None]
        return arrival

    # -- Arrays ----------------------------------------------------------------------------------

    def _by_cell(self, value: np.ndarray) -> np.ndarray:
        """Values of states (states,) or (states, columns) as (cells, G E) or (columns, cells, G E)."""
        return np.ascontiguousarray(value.T).reshape(*value.shape[1:], *self._rows)

    def _flat(self, value: np.ndarray) -> np.ndarray:
        """The reverse of `_by_cell`."""
        return value.reshape(*value.shape[:-2], -1).T

    def _ahead(self, value: np.ndarray) -> np.ndarray:
        """Discounted expectations of values (states, columns) so many timesteps later: (timesteps, columns, ...)."""
        ahead = np.empty((self._longest + 1, value.shape[1], *self._rows), np.float32)
        for timestep in range(len(ahead)):
            ahead[timestep] = self._by_cell(value)
            if timestep < self._longest:
                value = self._next @ value
        return ahead

    def _by_time(self, cost: np.ndarray) -> np.ndarray:
        """Discounted sums of a cost (states,) over so many timesteps, (timesteps, cells, G E)."""
        total, sums = np.zeros_like(cost), []
        for _ in range(self._longest + 1):
            sums.append(self._by_cell(total))
            total = cost + self._next @ total
        return np.stack(sums)


class _Departure:
    """Somewhere from where the caregiver sets out: what it can do, and how long that takes.

    Attributes:
        to_post: Timesteps to each post, (posts, cells of the child).
        to_get: Timesteps until the candle of each table is in its hand, (tables, cells).
        to_place: Timesteps until it has been put down on another one, (tables, tables, cells).
    """

    def __init__(self, start: Start, left: int):
        self.to_post = timesteps(start.landings, left).T
        get = start.tables.T + HANDLING
        self.to_get = timesteps(get, left)
        self.to_place = timesteps(get[:, None] + start.onward[..., None] + HANDLING, left)
        self._cell = np.arange(get.shape[1])

    def guards(self, arrival: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Values of going to a post, whose columns are (posts, ...): (posts, ..., cells, G E)."""
        when = self.to_post.reshape(len(column), *[1] * (column.ndim - 1), -1)
        return arrival[when, column[..., None], self._cell]

    def relocates(
        self, arrival: np.ndarray, staying: np.ndarray, source: int, target: int, column: np.ndarray
    ) -> np.ndarray:
        """Values of carrying a candle from a table to another one, to columns (n,): (n, cells, G E)."""
        saved = staying[self.to_get[source], source, self._cell]
        return arrival[self.to_place[source, target], column[:, None], self._cell] - saved


def _longest(ways: Travel) -> int:
    """The most timesteps that anything takes."""
    actions = ways.to_landing.max(initial=0)
    if ways.to_table.size:
        actions = max(actions, int(ways.to_table.max()) + int(ways.onward.max()) + 2 * HANDLING)
    return int(timesteps(actions, 1))
