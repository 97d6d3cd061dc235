"""The planner's options and their expected damage, with children seen, or unseen and possibly in many cells."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.foresight.motion import Motion
from caregiver_mj.caregivers.foresight.value_table import ValueTable
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.plans.hazards import NOTHING

_CASES = 12  # most cells considered for an unseen child
_LEAST = 0.05  # least probability of each, relative to the most probable cell
_MOST = 1e4  # damage; replaces that of impossible options in sums
_SUMMED = ("going", "carried", "lying", "then")  # fields of `Sums` that are added up over cases and children


class OptionIndex:
    """Numbering of the options. Options of a kind are contiguous; kinds are in the order below.

    Attributes:
        stairs: Block each stairwell or close its gate, a slice, as are all plurals.
        aside: Stand aside.
        stay: Stay.
        relocations: Relocate each candle.
        pick_ups: Pick up each thing from the floor.
        looks: Look from each lookout.
        waits: Wait in each cell.
        stairwells, candles, things, lookouts, cells: Number of each.
    """

    def __init__(self, stairwells: int, candles: int, things: int, lookouts: int, cells: int):
        self.stairwells, self.candles, self.things = stairwells, candles, things
        self.lookouts, self.cells = lookouts, cells
        ends = itertools.accumulate((stairwells, 1, 1, candles, things, lookouts, cells), initial=0)
        parts = itertools.starmap(slice, itertools.pairwise(ends))
        self.stairs, aside, stay, self.relocations, self.pick_ups, self.looks, self.waits = parts
        self.aside, self.stay = aside.start, stay.start

    def __len__(self) -> int:
        return self.waits.stop

    def hazard(self, option: np.ndarray) -> np.ndarray:
        """Return the number of each option's hazard, NOTHING for options without one."""
        idle = self.stay + 1 - self.aside  # options between stairwells and other hazards
        on_tables_and_floor = np.where((option > self.stay) & (option < self.pick_ups.stop), option - idle, NOTHING)
        return np.where(option < self.aside, option, on_tables_and_floor)

    def of_hazards(self, values: np.ndarray, others: float | bool) -> np.ndarray:
        """Return values by option, (W, options), from values by hazard, (W, hazards), and one value for all others."""
        hazard = self.hazard(np.arange(len(self)))
        return np.where(hazard == NOTHING, others, np.pad(values, ((0, 0), (0, 1)))[:, hazard])

    @staticmethod
    def among(options: slice, option: np.ndarray) -> np.ndarray:
        """Return the positions of options within a slice, NOTHING for options outside of it."""
        return np.where((option >= options.start) & (option < options.stop), option - options.start, NOTHING)


@dataclasses.dataclass(frozen=True)
class Options:
    """The options in W worlds.

    Attributes:
        damage: Expected damage to come, (W, options), in the order of `OptionIndex`; infinite for impossible options,
            such as waiting in a cell out of reach before the child's next move.
        table: Best destination of each candle, (W, candles), or NOTHING if no table is bare.
    """

    damage: np.ndarray
    table: np.ndarray


@dataclasses.dataclass(frozen=True)
class Cases:
    """Possible cells of one child: N cases in W worlds, at least one in each.

    Attributes:
        which: World of each case, (N,), in order.
        cell: The child's cell, (N,).
        wants: Probability of each case, goal and epsilon, (N, J); it sums to 1 over the cases of a world.
    """

    which: np.ndarray
    cell: np.ndarray
    wants: np.ndarray

    @classmethod
    def likely(cls, belief: np.ndarray, possible: np.ndarray) -> Cases:
        """Return the most probable cells, at most `_CASES` a world, by the belief, (W, cells, G, E).

        `possible` are the numbers g E + e of the possible goals and epsilons, (J,).
        """
        presence = belief.sum(axis=(2, 3))
        most = min(_CASES, presence.shape[1])
        likely = np.sort(np.argpartition(-presence, most - 1, axis=1)[:, :most], axis=1)
        share = np.take_along_axis(presence, likely, axis=1)
        taken = share >= _LEAST * share.max(axis=1, keepdims=True)
        which, number = np.nonzero(taken)
        cell, share = likely[which, number], np.where(taken, share, 0.0).sum(axis=1)
        wants = belief[which, cell].reshape(len(which), -1)[:, possible] / share[which, None]
        return cls(which, cell, wants.astype(np.float32))

    def each_world(self, values: np.ndarray, combine: np.ufunc = np.add) -> np.ndarray:
        """Combine values by case, (N, ...), into values by world, (W, ...); by default add them up."""
        return combine.reduceat(values, np.flatnonzero(np.diff(self.which, prepend=-1)))


@dataclasses.dataclass(frozen=True)
class Sums:
    """Expected damage of the options in N cases, summed over children.

    Attributes:
        values: Value table for the present gates.
        motion: Motion model.
        which: World of each case, (N,), in order.
        percept: Observation of all worlds.
        worlds: Indices of the W worlds in the percept, (W,).
        index: Numbering of the options.
        going: Damage to come of each option, by the group of candles planned for, (N, options, groups).
        carried: Damage to come of each relocation if the candle is in the hand by the child's next move, (N, candles,
            bare tables, groups).
        got: Probability that it is, (N, candles).
        near: Whether the caregiver can reach each cell by then, bool (N, R).
        lying: Damage to come of each thing on the floor if it is left there, (N, things).
        then: Damage added by a thing (third axis) that is picked up after another (second axis), (N, things, things,
            groups).
    """

    values: ValueTable
    motion: Motion
    which: np.ndarray
    percept: Percept
    worlds: np.ndarray
    index: OptionIndex
    going: np.ndarray
    carried: np.ndarray
    got: np.ndarray
    near: np.ndarray
    lying: np.ndarray
    then: np.ndarray

    @classmethod
    def zeros(cls, values: ValueTable, motion: Motion, which: np.ndarray, percept: Percept, worlds: np.ndarray) -> Sums:
        """Return sums over no children."""
        count, candles, things = len(which), percept.candle_table.shape[1], len(motion.floor)
        groups = math.comb(candles, values.layouts.candles)
        cells = motion.around.shape[1]
        index = OptionIndex(len(motion.posts), candles, things, len(motion.lookouts), cells)
        bare = len(motion.stands) - np.count_nonzero(percept.candle_table[worlds[:1]] != NOTHING)
        return cls(
            values,
            motion,
            which,
            percept,
            worlds,
            index,
            going=np.zeros((count, len(index), groups), np.float32),
            carried=np.zeros((count, candles, bare, groups), np.float32),
            got=np.ones((count, candles), np.float32),
            near=np.ones((count, cells), bool),
            lying=np.zeros((count, things), np.float32),
            then=np.zeros((count, things, things, groups), np.float32),
        )

    def add(self, cases: Cases) -> None:
        """Add the expected damage from one child."""
        here, belief = cases.cell, cases.wants
        values, motion, index, candles = self.values, self.motion, self.index, self.index.candles
        worlds = self.worlds[self.which]
        cell, tables = self.percept.caregiver_cell[worlds], self.percept.candle_table[worlds]
        left = np.ones(len(worlds)) if self.percept.time_left is None else self.percept.time_left[worlds]
        left = left * motion.pace.cells
        # Groups of candles planned for at a time; candles outside of the group are assumed never to move.
        groups = list(itertools.combinations(range(candles), values.layouts.candles))
        chosen = np.array(groups, int).reshape(len(groups), values.layouts.candles)
        layout = values.layouts.now(tables[:, chosen])  # (N, groups)
        stays = np.array([[candle not in group for candle in range(candles)] for group in groups])
        bare = np.nonzero(bare_tables(tables, len(motion.stands)))[1].reshape(len(tables), -1)  # (N, bare tables)
        places = dict(enumerate(range(index.stairwells))) | {index.aside: motion.aside, index.stay: motion.aside + 1}
        places |= dict(enumerate(motion.lookouts, index.looks.start))
        staying = np.einsum("wcs,ws->wc", values.staying[here[:, None], tables], belief) @ stays.T  # (N, groups)
        self.going[:] += staying[:, None]
        self.lying[:] += np.einsum("wos,ws->wo", values.taken[here], belief)
        self.then[:] += np.einsum("towgs,ws->wtog", values.others[:, :, layout, here[:, None]], belief)
        for option, place in places.items():
            there, then, share = motion.walk(place, here, cell, left)
            found, onwards = (values.at(layout, here[:, None], at[:, None]) for at in (there, then))
            found += share[:, None, None] * (onwards - found)
            self.going[:, option] += np.einsum("wgs,ws->wg", found, belief)
        self._wait(layout, here, cell, left, belief)
        for thing in range(index.things):
            option = index.pick_ups.start + thing
            self.going[:, option] += np.einsum("wgs,ws->wg", values.picking_up(thing, layout, here, cell, left), belief)
        # Damage of relocations: on the way to the candle, and with the candle in the hand by the child's next move.
        for candle, source in enumerate(tables.T):
            got, there, rest = motion.fetch(source, here, cell, left)
            in_hand = got == 1.0
            np.minimum(self.got[:, candle], got, out=self.got[:, candle])
            found = np.einsum("wgs,ws->wg", values.at(layout, here[:, None], there[:, None]), belief)
            self.going[:, index.relocations.start + candle] += found
            stand = np.where(in_hand, there, motion.stands[source, motion.nearest[source, cell]])
            taken, *others = (one[:, None, None] for one in (source, here, stand, rest))
            found = values.carried(layout[:, None], taken, bare[:, :, None], *others)
            self.carried[:, candle] += np.einsum("wbgs,ws->wbg", found, belief) + staying[:, None]

    def _wait(
        self, layout: np.ndarray, child: np.ndarray, cell: np.ndarray, left: np.ndarray, belief: np.ndarray
    ) -> None:
        """Add the expected damage with the caregiver in each cell at the child's next move."""
        state, there, before, share = self.motion.waits(child, cell, left)
        near = np.zeros(self.near.shape, bool)
        near[state, there] = True
        self.near[:] &= near
        found, onwards = (self.values.at(layout[state], child[state, None], at[:, None]) for at in (before, there))
        found += share[:, None, None] * (onwards - found)
        self.going[state, self.index.waits.start + there] += np.einsum("mgs,ms->mg", found, belief[state])

    def by_world(self, cases: Cases) -> Sums:
        """Return sums by world, from those by case."""
        sums: dict[str, Any] = {name: cases.each_world(getattr(self, name)) for name in _SUMMED}
        near = cases.each_world(~self.near) == 0  # reachable in every case
        got = cases.each_world(self.got, np.minimum)
        return dataclasses.replace(self, which=np.unique(self.which), got=got, near=near, **sums)

    def plus(self, other: Sums) -> Sums:
        """Return sums over the children of both operands, which are by world."""
        sums: dict[str, Any] = {name: getattr(self, name) + getattr(other, name) for name in _SUMMED}
        got, near = np.minimum(self.got, other.got), self.near & other.near
        return dataclasses.replace(self, got=got, near=near, **sums)

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the cell that each option ends in, and the number of a child's moves until then, (W, options) each."""
        motion, index, cell = self.motion, self.index, self.percept.caregiver_cell[self.worlds][:, None]
        place = np.full((len(cell), len(index)), NOTHING)  # standing aside counts as staying
        place[:, index.stairs] = range(index.stairwells)
        place[:, index.relocations] = index.stairwells + self.percept.candle_table[self.worlds]
        place[:, index.pick_ups] = motion.floor
        place[:, index.looks] = motion.lookouts
        left = 1.0 if self.percept.time_left is None else self.percept.time_left[self.worlds][:, None]
        moves = np.maximum(0.0, motion.open_distance[place, cell] / motion.pace.cells - left)
        stays = place == NOTHING
        ends, moves = np.where(stays, cell, motion.end[place, cell]), np.where(stays, 0.0, moves)
        ends[:, index.waits] = range(index.cells)
        return ends, moves

    def options(self) -> Options:
        """Return the options of each case, with the best destinations."""
        worlds, motion = self.worlds[self.which], self.motion
        tables, index = self.percept.candle_table[worlds], self.index
        bare = np.nonzero(bare_tables(tables, len(motion.stands)))[1].reshape(len(tables), -1)
        gone = np.zeros(self.lying.shape, bool) if self.percept.gone is None else self.percept.gone[worlds]
        lying = self.lying * ~gone
        all_left = lying.sum(axis=1, keepdims=True)
        going = self.going.copy()
        # After one thing, each other thing is picked up or left, whichever is better.
        going[:, index.pick_ups] += np.minimum(self.then, lying[:, None, :, None]).sum(axis=2) - all_left[..., None]
        damage = _least(going) + all_left
        damage[:, index.pick_ups][gone] = np.inf
        damage[:, index.waits][~self.near] = np.inf
        if not self.carried.size:
            damage[:, index.relocations] = np.inf
            return Options(damage, np.full((len(worlds), index.candles), NOTHING))
        by_table = _least(self.carried) + all_left[..., None]  # (N, candles, bare tables)
        damage[:, index.relocations] *= 1.0 - self.got
        damage[:, index.relocations] += self.got * by_table.min(axis=2)
        return Options(damage, np.take_along_axis(bare, first_of_least(by_table), axis=1))


def _least(damage: np.ndarray) -> np.ndarray:
    """Return the least along a short last axis, of which NumPy's own takes ten times as long."""
    return functools.reduce(np.minimum, np.moveaxis(damage, -1, 0))


def regret(parts: Sequence[tuple[Cases, Sums]], seen: np.ndarray, timesteps: int) -> np.ndarray:
    """Return the expected cost of not seeing children: the negative value of information, (W, options), in damage.

    At each move of an unseen child the caregiver takes the option that is best on average over the child's possible
    cells, not the best for its actual cell. The difference in damage, its regret, counts for a number of timesteps:
    with the present view until the option has taken the caregiver to its place, then with the view from there.

    `parts` are cases and expected damage of each child, in the same W worlds; `seen` tells whether each free cell is
    visible from each of the caregiver's, bool (caregiver cells, free cells).
    """
    _, one = parts[0]
    place, moves = one.ends()
    moves = np.minimum(moves, timesteps)
    decisions = one.index.looks.start  # looks and waits are not among them: a look puts a decision off
    each = [np.minimum(sums.options().damage[:, :decisions], _MOST) for _, sums in parts]
    means = [cases.each_world(damage) for (cases, _), damage in zip(parts, each, strict=True)]
    regrets = np.zeros(place.shape)
    for (cases, _), damage, mean in zip(parts, each, means, strict=True):
        others = sum(means) - mean  # expected damage from the other children
        damage = damage + cases.wants.sum(axis=1)[:, None] * others[cases.which]
        hidden = ~seen[place[cases.which], cases.cell[:, None]]  # (N, options)
        done = cases.each_world(hidden[:, :, None] * damage[:, None]).min(axis=2)
        best = cases.each_world(hidden * damage.min(axis=1)[:, None])
        now = (done - best)[:, [one.index.stay]]
        regrets += moves * now + (timesteps - moves) * (done - best)
    return regrets


def first_of_least(damage: np.ndarray) -> np.ndarray:
    """Return the first index of the least value along the last axis; rounding differences count as equal."""
    least = damage.min(axis=-1, keepdims=True)  # rounding can make it slightly negative
    return (damage <= least + 1e-5 * np.abs(least)).argmax(axis=-1)
