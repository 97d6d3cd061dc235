"""What is to come, for everything that the caregiver can be about: a dynamic programme over layouts of candles.

Where children go does not depend on the caregiver, but for the few moves that its body blocks. So all damage by candles
is the sum of that which each would do if it stayed where it is for ever, and of what relocations change about it; bumps
into bare tables are always the same. Values here are differences from candles that stay and stairwells that are shut.

The caregiver is at a *post* (in a stairwell) or beside a table where it has just put a candle down. From there it goes
to a post, or carries a candle from one table to another; it does not turn round on the way. Time counts in children's
moves: what is left until the next one when a candle has been put down is lost.
"""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.departure import Departure
from caregiver_mj.caregivers.foresight.layouts import AllLayouts, count_stands
from caregiver_mj.caregivers.foresight.reckoning import SOUND, Reckoning
from caregiver_mj.caregivers.foresight.transit import Transit, single
from caregiver_mj.caregivers.foresight.travel import travel
from caregiver_mj.caregivers.pace import PAPER, Pace
from caregiver_mj.danger.passage import expected_hits
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

LARGEST = 6_000_000  # states of a child times columns, above which there are no such values of a house
GUARDING, WAITS = 8, 15  # rounds of iteration over posts alone, and over how long to wait in each of any round


def values(plan: FloorPlan, pace: Pace = PAPER, reckoning: Reckoning = SOUND) -> Values:
    """The values of a house at some pace of the caregiver; made once."""
    return _made(plan, pace, reckoning)


@functools.lru_cache(maxsize=2)
def _made(plan: FloorPlan, pace: Pace, reckoning: Reckoning) -> Values:
    return Values(plan, pace, reckoning)


class Values:
    """Expected discounted damage to come for one child, of which cell, goal and epsilon are known.

    Those of a cell are one row of numbers, G E of them, one for each goal and epsilon.

    Attributes:
        ways: The caregiver's ways.
        transit: What happens on them.
        stairwells: How many stairwells there are.
        layouts: The layouts of the candles.
        arrival: Value of being at a post, or of having put a candle down, so many timesteps later, (timesteps, columns,
            cells, G E). There is a column for every layout and post, and one for every layout and table that bears a
            candle. With the latter comes the damage of open stairwells until then, and all of that candle from then on.
        post_column: Columns of the posts, (layouts, posts).
        table_column: Columns of the tables, (layouts, tables).
        staying: Damage from then on of a candle that stays on a table, so many timesteps later,
            (timesteps, tables, cells, G E).
        at_large: Damage of stairwells that stay open, (cells, G E).
    """

    def __init__(self, plan: FloorPlan, pace: Pace = PAPER, reckoning: Reckoning = SOUND):
        chain, self.ways = novice_chain(plan), travel(plan, pace, reckoning.obstacle)
        discount = reckoning.discount
        self.layouts = AllLayouts(len(plan.tables), len(plan.candle_tables))
        stairwells = self.stairwells = len(plan.stairwells)
        posts = len(self.ways.posts)
        self._rows = chain.shape[0], chain.shape[1] * chain.shape[2]
        self._next = single(discount * chain.transition)
        fall = (plan.damage.stairwell * chain.hits[:, :stairwells]).astype(np.float32)
        self._open = fall.sum(axis=1)  # damage of the next move if all stairwells are open, (states,)
        self._guarded = self._open[:, None] - fall if stairwells else np.zeros((chain.size, 1), np.float32)
        self.transit = Transit(chain, self.ways, self._open, discount, reckoning.price)
        harm = plan.damage.candle - plan.damage.table
        forever = expected_hits(chain, discount).astype(np.float32)
        falls = plan.damage.stairwell * forever[:, :stairwells]
        self.at_large = self._by_cell(falls.sum(axis=1))
        self._longest = self.ways.longest
        self.staying = self._ahead(harm * forever[:, stairwells:])
        self._exposed = self._by_time(self._open)
        count = len(self.layouts)
        self.post_column = np.arange(count * posts).reshape(count, posts)
        self.table_column = np.full((count, len(plan.tables)), NOTHING)
        self.table_column[self.layouts.bears] = count * posts + np.arange(self.layouts.bears.sum())
        self._posts = [self._departure(cell, pace.cells) for cell in self.ways.posts]
        self._tables = [self._departure(cell, 0.0) for cell in self.ways.central]
        others = falls.sum(axis=1, keepdims=True) - (falls if stairwells else 0.0)  # if it stays in a post for ever
        self.arrival = self._solve(others, reckoning.rounds)

    def guards(self, departure: Departure, arrival: np.ndarray, column: np.ndarray, child: np.ndarray) -> np.ndarray:
        """Values of going to a post.

        Args:
            departure: Where from, with n children.
            arrival: As the attribute of that name.
            column: Columns of the posts, (posts, ..., n), in which n may be 1.
            child: The children's cells, (n,).

        Returns:
            Array (posts, ..., n, G E).
        """
        between = (slice(None), *[None] * (column.ndim - 2))
        when = np.minimum(departure.to_post, self._longest)[between]
        state = np.arange(self._rows[1])
        return arrival[when, column[..., None], child[:, None], state] + departure.cost[between]

    # -- The programme ---------------------------------------------------------------------------

    def _departure(self, cell: int, left: float) -> Departure:
        """From one cell, with a child in each."""
        child = np.arange(self._rows[0])
        return Departure(self.ways, self.transit, child, np.full(len(child), cell), left)

    def _solve(self, guard: np.ndarray, rounds: int) -> np.ndarray:
        """Begins with a caregiver that never leaves its post, (states, posts), and lets it do more, round by round."""
        size, posts = self._next.shape[0], len(self._posts)
        columns = int(self.table_column.max(initial=self.post_column.max())) + 1
        child, column = np.arange(self._rows[0]), np.arange(posts)[:, None]
        for _ in range(GUARDING):  # which post it should be in does not depend on the layout
            arrival = self._ahead(guard)
            leave = [self._flat(self.guards(d, arrival, column, child).min(axis=0)) for d in self._posts]
            guard = self._wait(guard, np.stack(leave, axis=1))
        value = np.empty((size, columns), np.float32)
        value[:, self.post_column] = guard[:, None]
        arrival = self._ahead(guard)
        for table, departure in enumerate(self._tables):
            found = self.table_column[:, table]
            best = self.guards(departure, arrival, column, child).min(axis=0)
            value[:, found[found != NOTHING]] = self._flat(best)[:, None]
        everywhere = np.arange(len(self.layouts))
        for _ in range(rounds if self.layouts.bears.any() else 0):
            arrival = self._arrival(value)
            leaving = np.stack([self._flat(self._best(d, arrival, everywhere)) for d in self._posts], axis=2)
            value = value.copy()
            at_posts = value[:, : self.post_column.size]
            at_posts[:] = self._wait(at_posts, leaving.reshape(size, -1))
            for table, departure in enumerate(self._tables):
                which = np.flatnonzero(self.layouts.bears[:, table])
                value[:, self.table_column[which, table]] = self._flat(self._best(departure, arrival, which))
        return self._arrival(value)

    def _wait(self, value: np.ndarray, leave: np.ndarray) -> np.ndarray:
        """Values of being at a post when a child is about to move, if one may leave after any of its moves.

        Args:
            value: Those found so far, (states, columns), in which the post runs fastest.
            leave: Values of leaving after a move, likewise.
        """
        cost = np.tile(self._guarded, value.shape[1] // self._guarded.shape[1])
        for _ in range(WAITS):
            value = cost + self._next @ np.minimum(value, leave)
        return value

    def _best(self, departure: Departure, arrival: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Value of the best thing to do in some layouts, (layouts, cells, G E)."""
        child = np.arange(self._rows[0])
        best = self.guards(departure, arrival, self.post_column[which].T[..., None], child).min(axis=0)
        after = self.layouts.after[which]
        get, place = (np.minimum(when, self._longest) for when in (departure.to_get, departure.to_place))
        for source, target in zip(*np.nonzero((after != NOTHING).any(axis=0)), strict=True):
            here = np.flatnonzero(after[:, source, target] != NOTHING)
            column = self.table_column[after[here, source, target], target]
            found = arrival[place[source, target], column[:, None], child]
            found -= self.staying[get[source], source, child]
            found += self._of_goals(departure.denied[source])
            best[here] = np.minimum(best[here], found)
        return best

    def _arrival(self, value: np.ndarray) -> np.ndarray:
        arrival = self._ahead(value)
        arrival[:, self.post_column.size :] += self._exposed[:, None]
        for table, column in enumerate(self.table_column.T):
            arrival[:, column[column != NOTHING]] += self.staying[:, table, None]
        return arrival

    def _of_goals(self, value: np.ndarray) -> np.ndarray:
        """Values that are the same whatever epsilon is, (..., G), for all of them, (..., G E)."""
        return np.repeat(value, self._rows[1] // value.shape[-1], axis=-1)

    # -- Arrays ----------------------------------------------------------------------------------

    def _by_cell(self, value: np.ndarray) -> np.ndarray:
        """Values of states (states,) or (states, columns) as (cells, G E) or (columns, cells, G E)."""
        return np.ascontiguousarray(value.T).reshape(*value.shape[1:], *self._rows)

    def _flat(self, value: np.ndarray) -> np.ndarray:
        """The reverse of `_by_cell`."""
        return value.reshape(*value.shape[:-2], self._next.shape[0]).T

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


def has_values(plan: FloorPlan) -> bool:
    """Whether a house is small enough for them."""
    return novice_chain(plan).size * count_stands(plan) <= LARGEST
