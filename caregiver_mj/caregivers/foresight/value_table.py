"""Value table: the expected damage to come for every cell of the child, cell of the caregiver and layout of candles.

The state of the decision process is the child (cell, toy bin, epsilon: `danger.chain`), the caregiver's cell and the
layout. In each timestep the child moves; then the caregiver goes towards one of its places (a landing, a gate, a table
with a candle, aside) along the routes of its world, or waits in any cell that it reaches meanwhile. It chooses anew in
every timestep.

The caregiver affects the child: a move into its cell leaves the child where it is, at a price. While a candle is in the
hand, for a few timesteps, the child is assumed to walk on regardless; the price of its denied moves still counts.

A closed gate stays closed. Each set of closed gates has its own table, computed after those with one more gate closed.

Things on the floor are in no table: each would double its size. Instead one step of policy improvement starts from
leaving all of them for ever. A thing that is left costs its damage, discounted to the child's first passage into its
cell with nobody in the way. Picking it up has the value of a fixed policy: go straight there, whatever the child does.
Once it is picked up, or taken by the child, the table holds. Other things that are worth the way follow, each evaluated
as if it were the only one and the child had not moved meanwhile.

Values are found by value iteration (Bellman 1957; Puterman 1994, chapter 6).
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from caregiver_mj.caregivers.foresight.cache import cached
from caregiver_mj.caregivers.foresight.motion import motion
from caregiver_mj.caregivers.percept import PAPER, Pace
from caregiver_mj.danger.chain import ChildChain, discounted_entry, expected_hits
from caregiver_mj.danger.child_model import child_chain
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, Where

# Most states of all tables, and layouts of each; beyond, fewer candles are planned for at a time.
LARGEST, LAYOUTS = 40_000_000, 128
MOST_TABLES = 63  # bits in an int64, the number of a layout
GATES = 3  # with more gates there is no plan
# Initial values as shares of a lone child's damage, about the final ones: of falls and candles, and of bare tables. By
# `waits`: who may wait in any cell can also keep a child from bare tables.
_BEGIN = {True: (0.03, 0.8), False: (0.05, 1.0)}
_NEVER = 1e9  # damage of the impossible; finite because it is multiplied by beliefs of zero
_STILL = 0.0001  # damage; a state whose value changes by no more in a sweep has converged
_EVERY = 3  # sweeps between updates of the values of carried candles
_REMADE = ("plan", "motion", "_rows", "_steps", "_child", "_cell")  # attributes left out of a table's file
Tables = dict[frozenset[int], "ValueTable"]  # by the set of openings with shut gates
# The caregiver's motion in a timestep, as rows of values: the row that follows each, (n,); indices of uncertain ones,
# (m,), which lead on to another row, (m,), with a probability, (m, 1).
_Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
_Fetched = list[tuple["_Fetch", np.ndarray]]  # for each table, with the result of `_Fetch.best`


@dataclasses.dataclass(frozen=True)
class Objective:
    """The planner's objective: discounted damage and the price of denied moves, to be minimised.

    Attributes:
        discount: Discount of damage a timestep.
        price: Damage equivalent of a denied move towards the child's toy bin.
        random_price: Damage equivalent of a denied move at random or towards anything else.
        sweeps: Most sweeps of value iteration.
        tolerance: Damage; iteration ends once the changes in a sweep have a smaller standard deviation over the states
            of a child's kind. A change common to all states alters no decision.
    """

    discount: float = 0.985
    price: float = 1.5
    random_price: float = 0.3
    sweeps: int = 120
    tolerance: float = 0.002


OBJECTIVE = Objective()


@dataclasses.dataclass(frozen=True)
class _Fetch:
    """The states in which a table's candle can be in the hand after a timestep, and the values of carrying it on.

    Many of these n states have the same child's cell, caregiver's cell and time left: m distinct combinations.

    Attributes:
        rows: The states as rows of `ValueTable.value`, (n,).
        unsure: Indices of states with a probability below 1, (k,).
        probability: Probability that the candle is in the hand there, (k, 1).
        which: Combination of each state, (n,).
        numbers: Rows of `ValueTable._ahead` by destination table, (layouts there, bare, m).
        meanwhile: Damage and price until the candle is put down, (layouts there, bare, m, J).
    """

    rows: np.ndarray
    unsure: np.ndarray
    probability: np.ndarray
    which: np.ndarray
    numbers: np.ndarray
    meanwhile: np.ndarray

    def best(self, ahead: np.ndarray) -> np.ndarray:
        """Return the damage to come with the best destination, (layouts there, m, J)."""
        by_layout = zip(self.numbers, self.meanwhile, strict=True)
        return np.stack([(ahead.take(some, axis=0) + more).min(axis=0) for some, more in by_layout])


def candles_at_a_time(plan: FloorPlan) -> int:
    """Return the number of candles that can be planned for at a time; -1 if the house is too large even for none."""
    if len(plan.mouths) > GATES:
        return -1
    states = len(plan.free_cells) * len(_possible(child_chain(plan))) * len(plan.caregiver_cells) << len(plan.mouths)
    states *= 1 + len(plan.floor_cells)
    tables, candles = len(plan.tables), len(plan.candle_tables)
    layouts = {count: math.comb(tables, count) for count in range((candles if tables <= MOST_TABLES else 0) + 1)}
    return max((n for n, ways in layouts.items() if ways <= LAYOUTS and states * ways <= LARGEST), default=-1)


def costs(plan: FloorPlan) -> tuple[float, float, float]:
    """Return the damage of a fall, of a bump into a bare table, and the additional damage of a thing on the table.

    Several kinds of hazard at openings, or on tables, all count as the worst of them.
    """
    falls, things = (plan.hazards.worst(where) for where in (Where.OPENING, Where.ON_TABLE))
    bare = plan.damage[TABLE.name]
    return falls, bare, things - bare


@functools.lru_cache(maxsize=2)
def _entries(plan: FloorPlan, discount: float) -> np.ndarray:
    """Return the expected discount of the first move into the cell of each thing on the floor, (C, things, J)."""
    chain = child_chain(plan)
    cells, goals, epsilons = chain.shape
    found = discounted_entry(chain, plan.floor_cells, discount)
    found = found.reshape(cells, goals * epsilons, len(plan.floor_cells))[:, _possible(chain)]
    return found.swapaxes(1, 2).astype(np.float32)


def _possible(chain: ChildChain) -> np.ndarray:
    """Return the numbers g E + e of the goals and epsilons with a positive prior, (J,)."""
    return np.flatnonzero(chain.prior)


@functools.lru_cache(maxsize=2)
def value_tables(
    plan: FloorPlan, pace: Pace = PAPER, objective: Objective = OBJECTIVE, *, waits: bool = True
) -> Tables:
    """Return the value tables of a house at a pace of the caregiver, by the set of shut gates; cached.

    With `waits` the caregiver may wait in any cell, else only at its places and where it is.
    """
    make = functools.partial(_made, plan, pace, objective, waits)
    tables = cached(repr((plan, pace, objective, KINDS, LAYOUTS)), make) if waits else make()
    for table in tables.values():
        table.attach(plan, pace)
    return tables


def _made(plan: FloorPlan, pace: Pace, objective: Objective, waits: bool) -> Tables:
    gates = range(len(plan.landings), len(plan.stairwells))
    tables: Tables = {}
    for count in range(len(gates), -1, -1):
        for shut in map(frozenset, itertools.combinations(gates, count)):
            tables[shut] = ValueTable(plan, pace, objective, shut, tables, waits=waits)
    return tables


class ValueTable:
    """Expected discounted damage to come just before a child's move.

    Attributes:
        plan: The house.
        motion: Motion model.
        layouts: Layouts of the candles that are planned for at a time.
        possible: Numbers g E + e of the possible goals and epsilons, (J,).
        value: Damage to come, (layouts, C R, J); the cells of child and caregiver have row c R + r.
        staying: Damage of a candle that stays on each table for ever, beyond that of a bare table, (C, tables, J).
        taken: Damage to come of each thing on the floor if it is left there, (C, things, J).
        going: For each thing, damage to come on the way to pick it up, its own included, as `value`.
        picked: For each thing, the same at the beginning of the pick-up, (layouts, C, J).
        others: Damage added by one more thing (second axis) if the caregiver goes for it from the cell of another,
            (things, things, layouts, C, J).
        closed: For each shut gate, damage to come when the caregiver begins to close it as the last one, (layouts, C,
            J).
    """

    def __init__(
        self,
        plan: FloorPlan,
        pace: Pace = PAPER,
        objective: Objective = OBJECTIVE,
        shut: frozenset[int] = frozenset(),
        tables: Tables | None = None,
        *,
        waits: bool = True,
    ):
        """Compute the table for openings whose gates are shut; see `value_tables` for `waits`.

        `tables` are those with one more gate shut. A gate without one is never closed.
        """
        self.plan, self.motion, self._objective, self._waits = plan, motion(plan, pace), objective, waits
        chain = child_chain(plan)
        self.possible = _possible(chain)
        self._cells, self._places, self._states = chain.shape[0], len(plan.caregiver_cells), len(self.possible)
        stairwells, fall, bump, more = len(plan.stairwells), *costs(plan)
        self._fall = np.array([fall * (opening not in shut) for opening in range(stairwells)])
        harm = np.append(self._fall, [bump] * len(plan.tables))
        left = harm * np.where(np.arange(len(harm)) < stairwells, *_BEGIN[waits])
        more_shut = {gate: (tables or {}).get(shut | {gate}) for gate in range(len(plan.landings), stairwells)}
        self._closed = [(self.motion.posts[gate], one.closed[gate]) for gate, one in more_shut.items() if one]
        self.closed: dict[int, np.ndarray] = {}
        self._next_cell = chain.next_cell
        among = (np.arange(self._cells)[:, None] * (chain.size // self._cells) + self.possible).ravel()
        forever, hits = expected_hits(chain, objective.discount)[among], chain.hits[among]
        by_table = (self._cells, self._states, len(plan.tables))
        self.staying = (more * forever[:, stairwells:]).reshape(by_table).swapaxes(1, 2).astype(np.float32)
        self.layouts = AllLayouts(len(plan.tables), candles_at_a_time(plan))
        self._candle = np.asarray(more * hits[:, stairwells:], np.float32)  # damage of the next move, (states, tables)
        self._open = (hits @ harm).astype(np.float32)  # the same of all else, with nobody in the way
        self._alone = _single(objective.discount * chain.transition[among][:, among])
        self._ahead = np.empty(0)  # see `_arrive`
        self._lying = plan.hazards.split(plan.hazards.damage)[2].astype(np.float32)
        self.taken = self._lying[:, None] * _entries(plan, objective.discount)
        self.going: list[np.ndarray] = []
        self.picked: list[np.ndarray] = []
        self.value = self._solve(chain, (forever @ left).astype(np.float32).reshape(self._cells, 1, self._states), shut)

    # A file leaves out what is shared or quickly recomputed, which is most of a table.

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in vars(self).items() if name not in _REMADE}
        return kept | {"_ahead": self._ahead.shape}

    def attach(self, plan: FloorPlan, pace: Pace) -> None:
        """Complete a table from a file."""
        if isinstance(self._ahead, tuple):
            self.plan, self.motion, self._ahead = plan, motion(plan, pace), np.zeros(self._ahead, np.float32)
            self._arrive(self.value)

    # -- Queries ---------------------------------------------------------------------------------

    def at(self, layout: np.ndarray, child: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return the damage to come before the child's move, (..., J), by layout and cells of child and caregiver."""
        return self.value[layout, child * self._places + cell]

    def picking_up(
        self, thing: int, layout: np.ndarray, child: np.ndarray, cell: np.ndarray, left: np.ndarray
    ) -> np.ndarray:
        """Return the damage to come, (n, groups, J), if the caregiver goes for a thing on the floor, the only one.

        Layouts are (n, groups); the cells of child and caregiver, and the steps left until the child's next move, are
        (n,).
        """
        place, first = self.motion.floor[thing], child * self._places
        begun = self.motion.picks_up(place, child, cell, left)
        here, then, share = self.motion.walk(place, child, cell, left)
        going, onwards = (self.going[thing][layout, (first + at)[:, None]] for at in (here, then))
        going = going + share[:, None, None] * (onwards - going)
        return np.where(begun[:, None, None], self.picked[thing][layout, child[:, None]], going)

    def carried(
        self,
        layout: np.ndarray,
        source: np.ndarray,
        table: np.ndarray,
        child: np.ndarray,
        stand: np.ndarray,
        left: np.ndarray,
    ) -> np.ndarray:
        """Return the damage to come, (..., J), after a candle has been taken from `source`, if it is put on `table`.

        The layout is the one before; `stand` is the caregiver's cell, and `left` the steps until the child's next move:
        they are broadcast. Without a candle on the source, or with one on the destination, the damage is 1e9.
        """
        numbers, found = self._leg(layout, source, table, child, stand, left)
        found += self._ahead.reshape(-1, self._states).take(numbers, axis=0)
        found[self.layouts.after[layout, source, table] < 0] = _NEVER
        return found

    def _leg(self, layout: np.ndarray, *leg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows of `_ahead` for `carried`, (...), and damage and price until the candle is put down, (..., J)."""
        source, table, child, stand, left = leg  # smaller than with the layouts, which most does not depend on
        after = self.layouts.after[layout, source, table]
        moves = np.minimum(self.motion.carry(stand, table, child, left), self.motion.longest)
        where = table, moves, self._column[table, after], self.motion.nearest[table, stand], child
        here, then, share = self.motion.walk(len(self.motion.posts) + table, child, stand, left)
        there = np.where(share > 0.5, then, here)
        denied = (moves > 0)[..., None] * self._denied[table, child * self._places + there]
        found = self._meanwhile[layout, moves, child]
        found += denied
        found -= self._candle_meanwhile[moves, child, source]  # the carried candle harms nobody
        return np.ravel_multi_index(where, self._ahead.shape[:-1]), found

    # -- Value iteration -------------------------------------------------------------------------

    def _solve(self, chain: ChildChain, bare: np.ndarray, shut: frozenset[int]) -> np.ndarray:
        """Iterate from about the final damage at `bare` tables and stairs, (C, 1, J), and at candles."""
        cells, places, states = self._cells, self._places, self._states
        bears, tolerance = self.layouts.bears, self._objective.tolerance
        transition, cost, price = self._dynamics(chain)
        self._child, self._cell = np.divmod(np.arange(cells * places), places)
        self._rows = [self._walked(place) for place in range(self.motion.aside + 1)]
        self._parts = max(1, int(self.motion.turn))  # of a timestep, with at most one cell each
        self._steps = [self._stepped(way) for way in range(len(self.motion.around))]
        self._denied = self._denied_meanwhile(transition, price)
        meanwhile = self._damage_meanwhile()
        self._candle_meanwhile = meanwhile[:, :, 1:]
        self._meanwhile = np.stack([meanwhile[:, :, np.concatenate([[True], bear])].sum(axis=2) for bear in bears])
        stand, child = self.motion.stands.ravel()[:, None], np.arange(cells)
        self._most = [  # most moves to carry a candle to each table
            min(int(self.motion.carry(stand, np.array(table), child, np.array(0.0)).max()), self.motion.longest)
            for table in range(len(self.motion.stands))
        ]
        self._column = np.cumsum(bears, axis=0).T - 1  # index of a layout among those with a candle on the table
        stay = np.einsum("ctj,lt->lcj", self.staying, bears)[:, :, None]
        value = np.broadcast_to(bare + _BEGIN[self._waits][0] * stay, (len(bears), cells, places, states))
        value = np.array(value, np.float32, order="C").reshape(len(bears), cells * places, states)
        kinds = chain.prior.ravel()[self.possible]
        # (Tables, moves, layouts with a candle there, cells beside the table, C, J).
        shape = len(self._most), self.motion.longest + 1, int(bears.sum(axis=0).max(initial=0))
        self._ahead = np.zeros((*shape, self.motion.stands.shape[1], cells, states), np.float32)
        fetches = self._fetches() if bears.any() else []
        fetched: _Fetched = []
        best, new = np.empty_like(value[0]), np.empty_like(value)
        for sweep in range(self._objective.sweeps):
            looks = sweep % _EVERY == 0
            if looks:
                self._arrive(value)
                fetched = [(one, one.best(self._ahead.reshape(-1, states))) for one in fetches]
            for layout, now in enumerate(value):  # singly: one layout fits into the processor's cache
                self._best(layout, now, fetched, best)
                np.add((transition @ best.ravel()).reshape(best.shape), cost[layout], out=new[layout])
                self._close(layout, new[layout])
            value, new = new, value
            if looks and _deviation(new, value) @ kinds < tolerance:
                break
        self._arrive(value)
        for gate in shut:
            self.closed[gate] = self._standing(value, transition, cost, self.motion.posts[gate], self.motion.pace.close)
        things = len(self._lying)
        for thing in range(things):
            self._pick_up(thing, value, transition, cost, fetched)
        self.others = np.zeros((things, things, len(bears), cells, states), np.float32)
        for thing, other in itertools.permutations(range(things), 2):
            more = (self.going[other] - value).reshape(-1, cells, places, states)
            self.others[thing, other] = more[:, :, self.plan.floor_cells[thing]]
        return value

    def _standing(
        self, value: np.ndarray, transition: csr_array, cost: np.ndarray, place: int, time: float
    ) -> np.ndarray:
        """Return the damage to come if the caregiver first stands in a cell for `time` steps, (layouts, C, J)."""
        for _ in range(round(time / self.motion.pace.cells)):
            value = (transition @ value.reshape(len(value), -1).T).T.reshape(value.shape) + cost
        return value.reshape(-1, self._cells, self._places, self._states)[:, :, place]

    def _pick_up(
        self, thing: int, value: np.ndarray, transition: csr_array, cost: np.ndarray, fetched: _Fetched
    ) -> None:
        """Evaluate, by iteration, going straight to a thing on the floor and picking it up."""
        place, here = self.motion.floor[thing], self.plan.floor_cells[thing]
        picked = self._standing(value, transition, cost, here, self.motion.pace.pick_up)
        child, cell = self._child, self._cell
        has_gone, harm = child == here, np.float32(self._lying[thing] / self._objective.discount)
        alone = self.taken[:, thing].repeat(self._places, axis=0)
        # Following rows; those beyond the rows of `value` are pick-ups, by the child's cell.
        first, some_, then, share = self._rows[place]
        first = np.where(self.motion.picks_up(place, child, cell, self.motion.turn), len(child) + child, first)
        second, shares = first.copy(), np.zeros((len(first), 1), np.float32)
        second[some_], shares[some_] = then, share
        going, best = value + alone, np.empty_like(value[0])
        for layout, now in enumerate(going):
            self._best(layout, value[layout], fetched, best)
            known = np.concatenate([now, picked[layout]])
            after = best + harm  # once the child has it, the thing no longer exists
            some, part, moved = np.arange(len(now)), transition, np.flatnonzero(~has_gone)
            for _ in range(self._objective.sweeps):
                after[moved] = known[first[moved]]
                if len(some_):
                    after[moved] += shares[moved] * (known[second[moved]] - after[moved])
                new = (part @ after.ravel()).reshape(-1, self._states) + cost[layout, some]
                change = np.abs(new - known[some]).max(axis=1)
                known[some] = new
                if np.square(change).sum() < len(known) * self._objective.tolerance**2:
                    break
                # Most states converge soon; sweep only the rest.
                changed = np.zeros(len(known), bool)
                changed[some[change > _STILL]] = True
                changes = (changed[first] | changed[second]) & ~has_gone
                moved, by_cell = np.flatnonzero(changes), changes.reshape(self._cells, self._places)
                left = (by_cell | by_cell[self._next_cell].any(axis=1)).ravel()
                if 2 * np.count_nonzero(left) < len(some) or np.count_nonzero(left[some]) < np.count_nonzero(left):
                    some = np.flatnonzero(left)
                    part = transition[(some[:, None] * self._states + np.arange(self._states)).ravel()]
            now[:] = np.where(has_gone[:, None], value[layout], known[: len(now)])
        self.picked.append(picked)
        self.going.append(going)

    def _close(self, layout: int, value: np.ndarray) -> None:
        """Let the caregiver close a gate before which it stands, where that is better; values are (C R, J)."""
        by_cell = value.reshape(self._cells, self._places, self._states)
        for post, closed in self._closed:
            np.minimum(by_cell[:, post], closed[layout], out=by_cell[:, post])

    def _dynamics(self, chain: ChildChain) -> tuple[csr_array, np.ndarray, np.ndarray]:
        """Return the effects of the child's next move while the caregiver stands still.

        Returns:
            Discounted transitions, (C R J, C R J); damage and price, (layouts, C R, J); the price alone, (C R, J).
        """
        cells, places, states = self._cells, self._places, self._states
        (_, bump, more), posts = costs(self.plan), len(self.motion.posts)
        goal, which = np.divmod(self.possible, chain.shape[2])
        epsilon, moves = chain.epsilons[which], chain.greedy.shape[-1]
        number = np.full(chain.shape[1:], -1)
        number[goal, which] = np.arange(states)
        price = np.where(chain.bin_of[goal] >= 0, self._objective.price, self._objective.random_price)
        state = np.arange(cells * places * states).reshape(cells, places, states)
        here = np.arange(places)
        follows = chain.follows and chain.follows(here, np.arange(cells)[:, None])  # (C, R, moves)
        denial, cost = np.zeros((2, *state.shape), np.float32)
        candle = np.zeros((*state.shape, len(self.motion.stands)), np.float32)
        rows, columns, chances = [], [], []
        for move in range(moves):
            purpose = np.broadcast_to(chain.greedy[:, None, goal, move], state.shape).copy()
            if follows is not None:
                purpose[..., goal == chain.shape[1] - 1] = follows[..., move, None]
            chance = epsilon / moves + (1.0 - epsilon) * purpose
            there, met = chain.next_cell[:, move], chain.object_at[:, move]
            denied = ((there[:, None] == here) & (there != np.arange(cells))[:, None])[..., None]  # (C, R, 1)
            # The caregiver denies nothing to a child that follows it.
            wants = price if chain.follows is None else np.where(goal == chain.shape[1] - 1, 0.0, price)
            denial += denied * (wants * (1.0 - epsilon) * purpose + self._objective.random_price * epsilon / moves)
            falls = (met >= 0) & (met < posts)
            landing = np.array([*self.motion.posts, -1])[np.where(falls, met, -1)]
            fall = np.append(self._fall, 0.0)[np.where(falls, met, -1)][:, None, None]
            cost += fall * (falls[:, None] & (landing[:, None] != here))[..., None] * chance
            bumps = np.flatnonzero(met >= posts)
            cost[bumps] += bump * chance[bumps]
            candle[bumps, :, :, met[bumps] - posts] += more * chance[bumps]
            after = np.where(denied, state, state[there])
            ends = np.broadcast_to(chain.ends[:, move, goal][:, None], state.shape)
            goes_on = ~ends & (chance > 0)
            rows.append(state[goes_on])
            columns.append(after[goes_on])
            chances.append(chance[goes_on])
            cell, place, before = np.nonzero(ends & (chance > 0))
            for then in range(chain.shape[1]):
                share = chain.next_goal[goal[before], then]
                some = share > 0
                rows.append(state[cell, place, before][some])
                columns.append(state[cell, place, number[then, which[before]]][some])
                chances.append((chance[cell, place, before] * share)[some])
        entries = np.concatenate(chances), (np.concatenate(rows), np.concatenate(columns))
        transition = coo_array(entries, shape=(state.size, state.size)).tocsr()
        of_layout = self.layouts.bears.astype(np.float32) @ candle.reshape(state.size, -1).T
        cost = (of_layout + (cost + denial).ravel()).reshape(-1, cells * places, states)
        return _single(self._objective.discount * transition), cost, denial.reshape(-1, states)

    def _walked(self, place: int) -> _Rows:
        """Return the caregiver's motion in a timestep towards a place, from every cell."""
        here, then, share = self.motion.walk(place, self._child, self._cell, self.motion.turn)
        some, first = np.flatnonzero(share), self._child * self._places
        return first + here, some, (first + then)[some], share[some, None]

    def _stepped(self, way: int) -> _Rows:
        """Return the caregiver's motion in a part of a timestep in one of the four directions, from every cell."""
        there = self.motion.around[way]
        steps = np.where(there < 0, np.inf, self.motion.enters[:, way - 2, there]).ravel()  # opposite direction
        share = np.minimum(self.motion.turn / self._parts / steps, 1.0).astype(np.float32)
        here, then = (self._child * self._places + cell for cell in (self._cell, there[self._cell]))
        some = np.flatnonzero((share > 0.0) & (share < 1.0))
        return np.where(share < 1.0, here, then), some, then[some], share[some, None]

    def _best(self, layout: int, value: np.ndarray, fetched: _Fetched, best: np.ndarray) -> None:
        """Write the values after a child's move in a layout, (C R, J), under the best choice, into `best`."""
        np.copyto(best, value)  # to stay
        for _ in range(self._parts if self._waits else 0):  # to wait in a reachable cell
            before = best.copy()
            for rows in self._steps:
                np.minimum(best, _gone(before, rows), out=best)
        posts = len(self.motion.posts)
        for place in (*range(posts), self.motion.aside):
            np.minimum(best, _gone(value, self._rows[place]), out=best)
        for table in np.flatnonzero(self.layouts.bears[layout]).tolist():
            fetch, damage = fetched[table]
            gone = _gone(value, self._rows[posts + table])
            in_hand = damage[self._column[table, layout]].take(fetch.which, axis=0)
            not_in_hand = (1.0 - fetch.probability) * gone[fetch.rows[fetch.unsure]]
            in_hand[fetch.unsure] = not_in_hand + fetch.probability * in_hand[fetch.unsure]
            gone[fetch.rows] = in_hand
            np.minimum(best, gone, out=best)

    def _fetches(self) -> list[_Fetch]:
        """Return, for each table, the values of its candle after a timestep on the way to it."""
        child, cell = self._child, self._cell
        found = []
        for table in range(len(self.motion.stands)):
            got, stand, left = self.motion.fetch(table, child, cell, self.motion.turn)
            rows = np.flatnonzero((got > 0.0) & (child != cell))
            what = np.stack([child[rows], stand[rows], np.rint(1e6 * left[rows]).astype(int)])
            each, which = np.unique(what, axis=1, return_inverse=True)
            layouts = np.flatnonzero(self.layouts.bears[:, table])
            bare = np.nonzero(~self.layouts.bears[layouts])[1].reshape(len(layouts), -1)
            shape = *bare.shape, each.shape[1]
            here, source, target = (
                np.broadcast_to(part, shape).ravel() for part in (layouts[:, None, None], table, bare[:, :, None])
            )
            child_, stand_, left_ = (np.broadcast_to(part, shape).ravel() for part in each)
            numbers, meanwhile = self._leg(here, source, target, child_, stand_, left_ / 1e6)
            parts = numbers.reshape(shape), meanwhile.reshape(*shape, self._states)
            chance = got[rows, None].astype(np.float32)
            unsure = np.flatnonzero(chance < 1.0)
            found.append(_Fetch(rows, unsure, chance[unsure], which.ravel(), *parts))
        return found

    def _arrive(self, value: np.ndarray) -> None:
        """Update `_ahead`: values of having put a candle on each table after some more moves of the child."""
        by_cell = value.reshape(len(value), self._cells, self._places, self._states)
        for table, most in enumerate(self._most if self._ahead.size else []):
            taken = np.delete(self.motion.stands, table, axis=0)  # cells in which candles of other tables are taken
            for beside in np.unique(self.motion.nearest[table, taken]).tolist():
                found = by_cell[self.layouts.bears[:, table], :, self.motion.stands[table, beside]]
                ahead = np.ascontiguousarray(found.reshape(len(found), -1).T)
                for move in range(most + 1):
                    ahead = self._alone @ ahead if move else ahead
                    self._ahead[table, move, :, beside] = ahead.T.reshape(found.shape)

    def _damage_meanwhile(self) -> np.ndarray:
        """Return the damage during some moves of a child with nobody in its way, (moves, C, 1 + tables, J).

        The first is that of open stairwells and bare tables, the others the additional damage of a candle on each
        table.
        """
        cost = np.concatenate([self._open[:, None], self._candle], axis=1)
        total = [np.zeros_like(cost)]
        for _ in range(self.motion.longest):
            total.append(cost + self._alone @ total[-1])
        shape = len(total), self._cells, self._states, cost.shape[1]
        return np.ascontiguousarray(np.stack(total).reshape(shape).swapaxes(2, 3))

    def _denied_meanwhile(self, transition: csr_array, price: np.ndarray) -> np.ndarray:
        """Return the price of moves denied while a candle is carried to each table, (tables, C R, J).

        It counts from before a child's move, by the cells of child and caregiver with the candle in its hand. Here a
        denied move does leave the child where it is, and the caregiver walks round it.
        """
        found = np.zeros((len(self.motion.stands), *price.shape), np.float32)
        for table, denied in enumerate(found):
            place = len(self.motion.posts) + table
            steps = self.motion.turn  # in a timestep
            carries = self.motion.distance[place].reshape(-1, 1) > steps - min(steps, self.motion.handling)
            for _ in range(self.motion.longest):
                after = carries * _gone(denied, self._rows[place])
                before = denied.copy()
                denied[:] = price + (transition @ after.ravel()).reshape(price.shape)
                if np.abs(denied - before).max() < self._objective.tolerance:
                    break
        return found


def _gone(value: np.ndarray, rows: _Rows) -> np.ndarray:
    """Return the values, (n, J), after a timestep of the caregiver's motion."""
    first, some, then, share = rows
    found = value.take(first, axis=0)
    if len(some):
        found[some] += share * (value.take(then, axis=0) - found[some])
    return found


def _deviation(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the changes of values over all layouts and cells, (J,)."""
    sums = np.zeros((2, after.shape[-1]))
    for change in map(np.subtract, after, before):
        sums += change.sum(axis=0, dtype=float), np.square(change).sum(axis=0, dtype=float)
    mean, square = sums / after[..., 0].size
    return np.sqrt(np.maximum(square - mean**2, 0.0))


def _single(matrix: csr_array) -> csr_array:
    """Return a matrix in single precision, which suffices and halves the time."""
    return csr_array(
        (matrix.data.astype(np.float32), matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)),
        shape=matrix.shape,
    )


class AllLayouts:
    """Every choice of as many tables as there are candles, which are interchangeable.

    Attributes:
        candles: Number of candles.
        bears: Whether a candle is on each table, bool (layouts, tables).
        after: Layout after a candle is moved from one table to another, (layouts, tables, tables); NOTHING without a
            candle on the first, or with one on the other.
    """

    def __init__(self, tables: int, candles: int):
        if candles and tables > MOST_TABLES:
            raise CaregiverError(f"tables must be at most {MOST_TABLES} to plan for candles, got {tables}")
        self.candles = candles
        chosen = itertools.combinations(range(tables), candles)
        self.bears = np.array([[table in some for table in range(tables)] for some in chosen], bool)
        bits = np.int64(1) << np.arange(tables)
        masks = self.bears @ bits
        self._order = np.argsort(masks)
        self._masks = masks[self._order]
        moved = masks[:, None, None] - bits[:, None] + bits
        valid = self.bears[:, :, None] & ~self.bears[:, None, :]
        self.after = np.where(valid, self._find(np.where(valid, moved, masks[:, None, None])), NOTHING)

    def _find(self, masks: np.ndarray) -> np.ndarray:
        return self._order[np.searchsorted(self._masks, masks)]

    def __len__(self) -> int:
        return len(self.bears)

    def now(self, tables: np.ndarray) -> np.ndarray:
        """Return the present layout, (...), by the table of each candle, (..., candles)."""
        return self._find((np.int64(1) << tables).sum(axis=-1))
