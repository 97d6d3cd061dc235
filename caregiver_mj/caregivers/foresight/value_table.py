"""Value table: the damage to come for every cell of the child, cell of the caregiver and layout of the candles.

The state of the decision process is the child (cell, toy bin, epsilon: `danger.chain`), the caregiver's cell and the
layout. In a timestep the child moves, then the caregiver goes on to one of its places (a landing, a table with a
candle, aside, or where it is), by the routes that its world moves it by, and may think better of it in the next one.
What the child does depends on the caregiver: a move into it leaves the child where it is, and costs a price. Only while
a candle is in the hand, for the few timesteps that it takes to put it down, is the child thought to walk on regardless.

The values are found by value iteration (Bellman 1957; Puterman 1994, chapter 6).
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
from scipy.sparse import coo_array, csr_array

from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.layouts import AllLayouts
from caregiver_mj.caregivers.foresight.motion import motion
from caregiver_mj.caregivers.pace import PAPER, Pace
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.danger.passage import expected_hits
from caregiver_mj.plans.floor_plan import FloorPlan

LARGEST, LAYOUTS = 40_000_000, 128  # states, layouts: where there are more, fewer candles are planned for at a time
_BEGIN = 0.2  # share of the damage to a child alone to begin the iteration with: about what is left of it
_NEVER = 1e9  # damage of what cannot be done; finite, for beliefs of zero are multiplied with it
_CARRY_EVERY = 4  # sweeps after which what comes of carrying a candle is brought up to date

# By steps in a timestep: for each table what `ValueTable._fetched` finds.
_Fetched = dict[int, list[tuple[np.ndarray, np.ndarray]]]


@dataclasses.dataclass(frozen=True)
class Objective:
    """What is to be least: discounted damage, and what the child is denied.

    Attributes:
        discount: Of damage, a timestep.
        price: Of a denied move of the child's towards its toy bin, in damage.
        random_price: Of a denied move that it makes at random.
        sweeps: Of value iteration, at most.
        tolerance: Change of all values by a sweep, in damage, below which it ends.
    """

    discount: float = 0.985
    price: float = 1.5
    random_price: float = 0.3
    sweeps: int = 80
    tolerance: float = 0.003


OBJECTIVE = Objective()


def candles_at_a_time(plan: FloorPlan) -> int:
    """Return for how many candles at a time a house can be planned; -1 if it is too large even for none."""
    states = novice_chain(plan).size * len(plan.caregiver_cells)
    tables, candles = len(plan.tables), len(plan.candle_tables)
    layouts = {count: math.comb(tables, count) for count in range(candles + 1)}
    return max((n for n, ways in layouts.items() if ways <= LAYOUTS and states * ways <= LARGEST), default=-1)


@functools.lru_cache(maxsize=2)
def value_table(plan: FloorPlan, pace: Pace = PAPER, objective: Objective = OBJECTIVE) -> ValueTable:
    """Return the value table of a house at a pace of the caregiver; made once."""
    return ValueTable(plan, pace, objective)


class ValueTable:
    """Expected discounted damage to come just before a child's move.

    Attributes:
        plan: The house.
        motion: How the caregiver moves.
        layouts: The layouts of the candles that are planned for at a time.
        value: The damage, (layouts, C R, G E): by layout, by the cells of child and caregiver, c R + r, and by toy bin
            and epsilon.
        staying: Damage of a candle that stays on each table for ever, beyond that of a bare table, (C, tables, G E).
    """

    def __init__(self, plan: FloorPlan, pace: Pace = PAPER, objective: Objective = OBJECTIVE):
        self.plan, self.motion, self._objective = plan, motion(plan, pace), objective
        chain = novice_chain(plan)
        self._cells, self._places = chain.shape[0], len(plan.caregiver_cells)
        self._states = chain.shape[1] * chain.shape[2]
        stairwells, damage = len(plan.stairwells), plan.damage
        harm = np.array([damage.stairwell] * stairwells + [damage.table] * len(plan.tables))
        more = damage.candle - damage.table
        forever = expected_hits(chain, objective.discount)
        by_table = (self._cells, self._states, len(plan.tables))
        self.staying = (more * forever[:, stairwells:]).reshape(by_table).swapaxes(1, 2).astype(np.float32)
        self.layouts = AllLayouts(len(plan.tables), candles_at_a_time(plan))
        self._candle = np.asarray(more * chain.hits[:, stairwells:], np.float32)  # of the next move, (states, tables)
        self._open = (chain.hits @ harm).astype(np.float32)  # likewise of all else, if nobody is in the way
        self._alone = _single(objective.discount * chain.transition)
        self._ahead = np.empty(0)  # see `_arrivals`
        bare = (forever @ harm).astype(np.float32).reshape(self._cells, 1, self._states)
        self.value = self._solve(chain, bare)

    # -- What to expect --------------------------------------------------------------------------

    def at(self, layout: np.ndarray, child: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return the damage to come before the child's move, (..., G E), by layout, child's and caregiver's cell."""
        return self.value[layout, child * self._places + cell]

    def carried(
        self,
        layout: np.ndarray,
        source: np.ndarray,
        table: np.ndarray,
        child: np.ndarray,
        stand: np.ndarray,
        left: np.ndarray,
    ) -> np.ndarray:
        """Return the damage to come from the moment in which a candle has been taken, if it is put on a table.

        Args:
            layout: Layouts before it was taken, (n,).
            source: The tables from which it has been, (n,).
            table: The tables on which it is put, (n,).
            child: The child's cells, (n,).
            stand: Where the caregiver is, (n,).
            left: Steps until the child's next move, (n,).

        Returns:
            Array (n, G E), beyond all else where there is no such candle, or another one on that table.
        """
        after = self.layouts.after[layout, source, table]
        moves = np.minimum(self.motion.carry(stand, table, child, left), self.motion.longest)
        found = self._ahead[table, moves, self._column[table, after], self.motion.nearest[table, stand], child]
        found += self._meanwhile[layout, moves, child]
        found -= self._candle_meanwhile[moves, child, source]  # the one in the hand
        found[after < 0] = _NEVER
        return found

    # -- The programme ---------------------------------------------------------------------------

    def _solve(self, chain: ChildChain, bare: np.ndarray) -> np.ndarray:
        """Iterate from a share of the damage to a child alone."""
        cells, places, states = self._cells, self._places, self._states
        bears = self.layouts.bears
        transition, cost = self._dynamics(chain)
        candles = [self._candle[:, bears_candle].sum(axis=1).reshape(cells, 1, states) for bears_candle in bears]
        stay = [self.staying[:, bears_candle].sum(axis=1, keepdims=True) for bears_candle in bears]
        begin = (np.broadcast_to(_BEGIN * (bare + more), (cells, places, states)) for more in stay)
        value = np.stack([one.reshape(-1, states) for one in begin])
        first = np.arange(cells)[:, None] * places
        self._rows = {
            steps: (first + self.motion.after[steps]).reshape(self.motion.aside + 2, -1)
            for steps, _ in self.motion.turns
        }
        meanwhile = self._damage_meanwhile()
        self._candle_meanwhile = meanwhile[:, :, 1:]
        self._meanwhile = np.stack([meanwhile[:, :, np.concatenate([[True], bear])].sum(axis=2) for bear in bears])
        self._column = np.cumsum(bears, axis=0).T - 1  # of a layout among those with a candle on a table
        fetched: _Fetched = {}
        for sweep in range(self._objective.sweeps):
            if sweep % _CARRY_EVERY == 0 and bears.any():
                self._ahead = self._arrivals(value)
                fetched = {steps: self._fetched(steps) for steps, _ in self.motion.turns}
            change = 0.0
            for layout in range(len(bears)):
                best = self._best(value[layout], layout, fetched)
                new = (transition @ best.ravel()).reshape(cells, places, states) + cost + candles[layout]
                change = max(change, float(np.abs(new.reshape(-1, states) - value[layout]).max()))
                value[layout] = new.reshape(-1, states)
            if change < self._objective.tolerance:
                break
        if bears.any():
            self._ahead = self._arrivals(value)
        return value

    def _dynamics(self, chain: ChildChain) -> tuple[csr_array, np.ndarray]:
        """Return discounted transitions of child and caregiver, and the damage and price of the next move, (C, R, G E).

        The caregiver stands still; candles are left out.
        """
        cells, places, (goals, epsilons) = self._cells, self._places, chain.shape[1:]
        epsilon = chain.epsilons
        state = np.arange(cells * places * self._states).reshape(cells, places, goals, epsilons)
        here = np.arange(places)
        cost = np.zeros((cells, places, goals, epsilons), np.float32)
        rows, columns, chances = [], [], []
        for move in range(chain.moves.shape[-1]):
            chance = np.broadcast_to(chain.moves[:, None, :, :, move], state.shape).astype(np.float32)
            there, met = chain.next_cell[:, move], chain.object_at[:, move]
            denied = (there[:, None] == here) & (there != np.arange(cells))[:, None]  # (C, R)
            purposeful = (1.0 - epsilon) * chain.greedy[:, :, move, None]  # (C, G, E)
            price = self._objective.price * purposeful
            price += self._objective.random_price * epsilon / chain.moves.shape[-1]
            cost += denied[..., None, None] * price[:, None].astype(np.float32)
            falls = (met >= 0) & (met < len(self.motion.posts))
            landing = np.array([*self.motion.posts, -1])[np.where(falls, met, -1)]
            cost += self.plan.damage.stairwell * (falls[:, None] & (landing[:, None] != here))[..., None, None] * chance
            bumps = met >= len(self.motion.posts)
            cost += self.plan.damage.table * bumps[:, None, None, None] * chance
            after = state[np.where(denied, np.arange(cells)[:, None], there[:, None]), here]  # (C, R, G, E)
            reaches = chain.goal_at[:, move, None] == np.arange(goals)  # (C, G)
            reaches = np.broadcast_to(reaches[:, None, :, None], state.shape)
            goes_on = ~reaches & (chance > 0)
            rows.append(state[goes_on])
            columns.append(after[goes_on])
            chances.append(chance[goes_on])
            for goal in range(goals):  # the next one
                rows.append(state[reaches])
                columns.append(np.broadcast_to(state[:, :, goal : goal + 1], state.shape)[reaches])
                chances.append(chance[reaches] / goals)
        entries = np.concatenate(chances), (np.concatenate(rows), np.concatenate(columns))
        transition = coo_array(entries, shape=(state.size, state.size)).tocsr()
        return _single(self._objective.discount * transition), cost.reshape(cells, places, -1)

    def _best(self, value: np.ndarray, layout: int, fetched: _Fetched) -> np.ndarray:
        """Return the values after a child's move in a layout, (C R, G E), if the caregiver does what is best."""
        best = value.copy()  # to stay
        for place in (*range(len(self.motion.posts)), self.motion.aside):
            going = (share * value.take(self._rows[steps][place], axis=0) for steps, share in self.motion.turns)
            np.minimum(best, functools.reduce(np.add, going), out=best)
        for table in np.flatnonzero(self.layouts.bears[layout]):
            found = np.zeros_like(best)
            for steps, share in self.motion.turns:
                reached = value.take(self._rows[steps][len(self.motion.posts) + table], axis=0)
                where, in_hand = fetched[steps][table]
                reached[where] = in_hand[self._column[table, layout]]
                found += share * reached
            np.minimum(best, found, out=best)
        return best

    def _fetched(self, steps: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return for each table where its candle is in the hand after so many steps, and what is then to come.

        Returns:
            Numbers of rows of `value`, (n,), and the damage, (layouts with a candle there, n, G E).
        """
        child, cell = np.divmod(np.arange(self._cells * self._places), self._places)
        found = []
        for table in range(len(self.motion.stands)):
            got, stand, left = self.motion.fetch(table, child, cell, steps)
            rows = np.flatnonzero(got & (child != cell))
            # Many rows come to the same stand with the same time left.
            what = np.stack([child[rows], stand[rows], np.rint(1e6 * left[rows]).astype(int)])
            each, inverse = np.unique(what, axis=1, return_inverse=True)
            layouts = np.flatnonzero(self.layouts.bears[:, table])
            best = np.full((len(layouts) * each.shape[1], self._states), np.inf, np.float32)
            layout = np.repeat(layouts, each.shape[1])
            source = np.full(len(layout), table)
            where, stands, rest = (np.tile(part, len(layouts)) for part in each)
            for target in range(len(self.motion.stands)):
                if target != table:
                    there = np.full(len(layout), target)
                    np.minimum(best, self.carried(layout, source, there, where, stands, rest / 1e6), out=best)
            found.append((rows, best.reshape(len(layouts), -1, self._states)[:, inverse.ravel()]))
        return found

    def _arrivals(self, value: np.ndarray) -> np.ndarray:
        """Return the values of having put a candle on each table some moves of the child later.

        Returns:
            Array (tables, moves, layouts with a candle there, cells beside the table, C, G E).
        """
        by_cell = value.reshape(len(value), self._cells, self._places, self._states)
        bears, stands, moves = self.layouts.bears, self.motion.stands, self.motion.longest
        shape = bears[:, 0].sum(), stands.shape[1], self._cells, self._states
        found = np.empty((len(stands), moves + 1, *shape), np.float32)
        for table, cells in enumerate(stands):
            found[table, 0] = by_cell[bears[:, table]][:, :, cells].swapaxes(1, 2)
            ahead = np.ascontiguousarray(found[table, 0].reshape(-1, self._cells * self._states).T)
            for move in range(moves):
                ahead = self._alone @ ahead
                found[table, move + 1] = ahead.T.reshape(shape)
        return found

    def _damage_meanwhile(self) -> np.ndarray:
        """Return what is done in some moves of a child with nobody in its way, (moves, C, 1 + tables, G E).

        First of all by open stairwells and bare tables, then, beyond that, by a candle on each table.
        """
        cost = np.concatenate([self._open[:, None], self._candle], axis=1)
        total = [np.zeros_like(cost)]
        for _ in range(self.motion.longest):
            total.append(cost + self._alone @ total[-1])
        shape = len(total), self._cells, self._states, cost.shape[1]
        return np.ascontiguousarray(np.stack(total).reshape(shape).swapaxes(2, 3))


def _single(matrix: csr_array) -> csr_array:
    """Return the same in single precision, which is precise enough and takes half the time."""
    return csr_array(
        (matrix.data.astype(np.float32), matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)),
        shape=matrix.shape,
    )
