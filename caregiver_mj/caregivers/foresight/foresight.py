"""The caregiver that sees harm coming: it looks ahead to where the children may go, and to what it could still do.

Two others stand beside it: one that is told the goals of the children, and the paper's rule with its prediction.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import CHANGE, EPSILONS, child_chain
from caregiver_mj.caregivers.foresight.motion import Motion, motion
from caregiver_mj.caregivers.foresight.value_table import (
    OBJECTIVE,
    Objective,
    Tables,
    ValueTable,
    candles_at_a_time,
    value_tables,
)
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import HORIZON, Assessment, Outlook, Percept, bare_tables
from caregiver_mj.caregivers.told import ToldCaregiver, Truth
from caregiver_mj.danger.belief import Belief
from caregiver_mj.interventions.verb import DO_NOTHING, LOOK, STAND_ASIDE, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.visibility import lookouts, visibility

# By how much something else must be better than what it is about, as a share of all damage that is to come: so that it
# does not turn round for a trifle. On 34 houses of train-100 and shapes-train-100 .001 was no better (damage by 0.0 %,
# standard error 0.8 %, of 60 episodes a house), and in 15 tiny houses farther from the optimum at epsilon .05.
HYSTERESIS = 0.004
_CASES = 12  # cells in which a child that is not seen is thought to be at most, ...
_LEAST = 0.05  # ... and how probable each is at least, as a share of the most probable one


@dataclasses.dataclass(frozen=True)
class Options:
    """Everything that can be done in W worlds, and what is then to be expected.

    In this order: to block each stairwell or close its gate, to stand aside, to stay, to relocate each candle, to pick
    up each thing on the floor, to look from each lookout.

    Attributes:
        damage: Expected damage to come, (W, options).
        table: The best table for each candle, (W, candles), or NOTHING if none is bare.
    """

    damage: np.ndarray
    table: np.ndarray


@dataclasses.dataclass(frozen=True)
class _Sums:
    """What is to be expected of children in N cases, added up. A case is a world, and where a child may be in it.

    Attributes:
        values: The planner's tables.
        motion: How the caregiver moves.
        which: The world of each case, (N,).
        percept: What is seen.
        worlds: The indices of the worlds in that, (W,).
        going: Damage to come by where the caregiver goes now and by the candles that are planned for, (N, posts, aside,
            stay, candles, things and lookouts, groups of candles).
        carried: The same if a candle is in the hand by the child's next move, (N, candles, bare tables, groups).
        got: Whether it is, bool (N, candles).
        lying: Damage to come of each thing on the floor if it is left there, (N, things).
        then: By how much it is more to pick up one thing after another, (N, things, things, groups).
    """

    values: ValueTable
    motion: Motion
    which: np.ndarray
    percept: Percept
    worlds: np.ndarray
    going: np.ndarray
    carried: np.ndarray
    got: np.ndarray
    lying: np.ndarray
    then: np.ndarray

    @classmethod
    def zeros(
        cls, values: ValueTable, motion: Motion, which: np.ndarray, percept: Percept, worlds: np.ndarray
    ) -> _Sums:
        """Expect nothing yet."""
        count, candles, things = len(which), percept.candle_table.shape[1], len(motion.floor)
        groups = math.comb(candles, values.layouts.candles)
        options = len(motion.posts) + 2 + candles + things + len(motion.lookouts)
        bare = len(motion.stands) - np.count_nonzero(percept.candle_table[worlds[:1]] != NOTHING)
        return cls(
            values,
            motion,
            which,
            percept,
            worlds,
            going=np.zeros((count, options, groups), np.float32),
            carried=np.zeros((count, candles, bare, groups), np.float32),
            got=np.ones((count, candles), bool),
            lying=np.zeros((count, things), np.float32),
            then=np.zeros((count, things, things, groups), np.float32),
        )

    def add(self, here: np.ndarray, belief: np.ndarray) -> None:
        """Add what is to be expected of a child in each case.

        Args:
            here: The cell in which it may be, (N,).
            belief: Probability that it is there, by what it may want, (N, J).
        """
        values, motion, candles = self.values, self.motion, self.got.shape[1]
        worlds = self.worlds[self.which]
        cell, tables = self.percept.caregiver_cell[worlds], self.percept.candle_table[worlds]
        left = np.ones(len(worlds)) if self.percept.time_left is None else self.percept.time_left[worlds]
        left = left * motion.pace.cells
        steps = np.clip(np.rint(left), 0, len(motion.after) - 1).astype(int)
        # Every choice of as many candles as are planned for at a time; the others are thought to stay for ever.
        groups = list(itertools.combinations(range(candles), values.layouts.candles))
        chosen = np.array(groups, int).reshape(len(groups), values.layouts.candles)
        layout = values.layouts.now(tables[:, chosen])  # (N, groups)
        stays = np.array([[candle not in group for candle in range(candles)] for group in groups])
        bare = np.nonzero(bare_tables(tables, len(motion.stands)))[1].reshape(len(tables), -1)  # (N, bare tables)
        places = [*range(len(motion.posts)), motion.aside, motion.aside + 1]
        numbers = dict(enumerate(places)) | dict(enumerate(motion.lookouts, self.things.stop))
        staying = np.einsum("wcs,ws->wc", values.staying[here[:, None], tables], belief) @ stays.T  # (N, groups)
        self.going[:] += staying[:, None]
        self.lying[:] += np.einsum("wos,ws->wo", values.taken[here], belief)
        self.then[:] += np.einsum("towgs,ws->wtog", values.others[:, :, layout, here[:, None]], belief)
        for option, place in numbers.items():
            there = motion.after[steps, place, here, cell]
            self.going[:, option] += np.einsum("wgs,ws->wg", values.at(layout, here[:, None], there[:, None]), belief)
        for thing, option in enumerate(range(self.things.start, self.things.stop)):
            self.going[:, option] += np.einsum(
                "wgs,ws->wg", values.picking_up(thing, layout, here, cell, left), belief
            )
        # What is to come on the way, and from when a candle is in the hand if it is by the child's next move.
        for candle, source in enumerate(tables.T):
            in_hand, there, rest = motion.fetch(source, here, cell, left)
            self.got[:, candle] &= in_hand
            found = np.einsum("wgs,ws->wg", values.at(layout, here[:, None], there[:, None]), belief)
            self.going[:, len(places) + candle] += found
            stand = np.where(in_hand, there, motion.stands[source, motion.nearest[source, cell]])
            shape = len(tables), bare.shape[1], len(groups)
            every = (np.broadcast_to(one[:, None, None], shape).ravel() for one in (source, here, stand, rest))
            source_, *others = every
            target = np.broadcast_to(bare[:, :, None], shape).ravel()
            which = np.broadcast_to(layout[:, None], shape).ravel()
            found = values.carried(which, source_, target, *others).reshape(*shape, -1)
            self.carried[:, candle] += np.einsum("wbgs,ws->wbg", found, belief) + staying[:, None]

    def by_world(self) -> _Sums:
        """Return what is to be expected of a child in each world, by cases that are ordered by world."""
        first = np.flatnonzero(np.diff(self.which, prepend=-1))
        sums = {name: np.add.reduceat(getattr(self, name), first) for name in ("going", "carried", "lying", "then")}
        got = np.logical_and.reduceat(self.got, first)
        return dataclasses.replace(self, which=self.which[first], got=got, **sums)

    def plus(self, other: _Sums) -> _Sums:
        """Return what is to be expected of all children, by that of some and others in each world."""
        sums = {name: getattr(self, name) + getattr(other, name) for name in ("going", "carried", "lying", "then")}
        return dataclasses.replace(self, got=self.got & other.got, **sums)

    @property
    def things(self) -> slice:
        """The options of picking things up."""
        first = len(self.motion.posts) + 2 + self.got.shape[1]
        return slice(first, first + len(self.motion.floor))

    def options(self) -> Options:
        """Return what can be done in each case, and the best tables for it."""
        worlds, motion = self.worlds[self.which], self.motion
        tables, candles = self.percept.candle_table[worlds], self.got.shape[1]
        bare = np.nonzero(bare_tables(tables, len(motion.stands)))[1].reshape(len(tables), -1)
        gone = np.zeros(self.lying.shape, bool) if self.percept.gone is None else self.percept.gone[worlds]
        relocates, things = slice(len(motion.posts) + 2, self.things.start), self.things
        lying = self.lying * ~gone
        all_left = lying.sum(axis=1, keepdims=True)
        going = self.going.copy()
        # Of the other things those are picked up after one for which that is better than to leave them.
        going[:, things] += np.minimum(self.then, lying[:, None, :, None]).sum(axis=2) - all_left[..., None]
        damage = going.min(axis=2) + all_left
        damage[:, things][gone] = np.inf
        if not self.carried.size:
            damage[:, relocates] = np.inf
            return Options(damage, np.full((len(worlds), candles), NOTHING))
        by_table = self.carried.min(axis=3) + all_left[..., None]  # (N, candles, bare tables)
        damage[:, relocates] = np.where(self.got, by_table.min(axis=2), damage[:, relocates])
        return Options(damage, np.take_along_axis(bare, _first_of_least(by_table), axis=1))


def _cases(belief: np.ndarray, possible: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where a child may be: cases as of `_Sums`, the most probable `_CASES` of each world.

    Args:
        belief: Probability of each cell, goal and epsilon, (W, cells, G, E).
        possible: The goals and epsilons that it can have, (J,).

    Returns:
        The world of each case, (N,), in order; the child's cell, (N,); and its belief, (N, J), which sums to 1 over the
        cases of a world.
    """
    presence = belief.sum(axis=(2, 3))
    most = min(_CASES, presence.shape[1])
    likely = np.sort(np.argpartition(-presence, most - 1, axis=1)[:, :most], axis=1)
    share = np.take_along_axis(presence, likely, axis=1)
    taken = share >= _LEAST * share.max(axis=1, keepdims=True)
    share = np.where(taken, share, 0.0).sum(axis=1)
    which, number = np.nonzero(taken)
    here = likely[which, number]
    wants = belief[which, here].reshape(len(which), -1)[:, possible] / share[which, None]
    return which, here, wants.astype(np.float32)


_OPTIONS = tuple(field.name for field in dataclasses.fields(Options))


class ForesightCaregiver(Caregiver):
    """Does that from which the least damage is to be expected, later interventions included.

    It believes in every toy bin that a child may be going to, and every epsilon that it may have, as far as the child's
    moves speak for them. What follows for each of them is in a `ValueTable`; those expectations are weighed by the
    belief (QMDP: Littman, Cassandra and Kaelbling 1995), and added up over the children.

    Where a child does what none of those does that it believes in (`Belief.understood`) it follows the rule, equation
    (2). So it does in a house that is too large for a table, there with the P(reach) of its belief.
    """

    looks = True
    horizon = 8

    def __init__(
        self,
        plan: FloorPlan,
        seed: int = 0,
        *,
        hysteresis: float = HYSTERESIS,
        change: float = CHANGE,
        objective: Objective = OBJECTIVE,
    ):
        """Look ahead.

        Args:
            plan: The house.
            seed: Of the paper's model of safety beside it; what it does draws no lots.
            hysteresis: By what share of the damage to come another intervention must be better than this one.
            change: Probability, in a timestep, that a child's epsilon changes.
            objective: What is to be least.
        """
        super().__init__(plan, seed)
        self._plans = candles_at_a_time(plan) >= min(1, len(plan.candle_tables))
        self._hysteresis, self._change, self._objective = hysteresis, change, objective
        self._rule = PaperCaregiver(plan, seed)  # for whoever looks on; it decides nothing
        self._begin(1, 1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        if self._plans:
            self._values()  # now, so that no decision has to wait for it
        self._rule.reset(batch, seeds, children)
        self._rule.followers = None  # its own belief knows them
        self._begin(batch, children)

    def _begin(self, batch: int, children: int) -> None:
        self.belief = Belief(child_chain(self.plan), batch, children, self._change)
        self._begun, self._table = np.full((2, batch), NOTHING)  # number of the option, and destination

    def _values(self) -> Tables:
        return value_tables(self.plan, self.pace, self._objective)

    def watch(self, percept: Percept) -> None:
        self._believe(percept)
        self._rule.watch(percept)

    def _believe(self, percept: Percept) -> None:
        if percept.belief is not None:
            self.belief.probability = percept.belief.sum(axis=2)
        else:
            self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    def assess(self, percept: Percept) -> Assessment:
        """Return what it believes, beside the paper's P(safe|tau); P(reach) in equation (2) follows from that belief.

        It decides by more than these numbers: by `options`, which count what it could still do.
        """
        outlook = Outlook(child_chain(self.plan), percept.child_cell, self.belief.probability)
        return dataclasses.replace(self._rule.weigh(outlook.reach(self.plan, percept)), outlook=outlook)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        answer = Interventions.idle(len(percept.caregiver_cell))
        lying = self._within_reach_on_the_floor(percept)
        # Whoever has a candle in the hand puts it down first, and one on the floor is picked up before anything else.
        empty = percept.holding == NOTHING
        stairwells = len(self.plan.stairwells)
        for world in np.flatnonzero(empty & lying.any(axis=1)):
            candle = lying[world].argmax()
            destination = self.destination(percept, np.full(len(lying), candle))[world]
            self._order(answer, np.array([world]), np.array([stairwells + 2 + candle]), np.array([destination]))
        free = empty & ~lying.any(axis=1)
        understood = self.belief.understood.all(axis=1)
        by_rule = free & ~(understood & self._plans)
        if by_rule.any():
            foreseen = self._rule.target(percept, self.assess(percept))
            answer = self.protect(percept, np.where(understood, foreseen, self._rule.choose(percept))).where(
                by_rule, answer
            )
            self._begun[by_rule] = NOTHING
        worlds = np.flatnonzero(free & ~by_rule)
        if worlds.size and len(self.plan.hazards):
            options = self.options(each_on_a_table(self.plan, percept), worlds)
            chosen = self._best(options, percept, worlds)
            number = np.where(chosen - 2 < len(self.plan.hazards), chosen - 2, NOTHING)
            candle = self.plan.hazards.among(Where.ON_TABLE, number)
            each = np.arange(len(worlds))
            table = options.table[each, candle] if options.table.size else candle
            self._order(answer, worlds, chosen, np.where(candle == NOTHING, NOTHING, table))
        return answer

    def options(self, percept: Percept, worlds: np.ndarray) -> Options:
        """Return what can be done in some worlds, (W,), in which all candles are on tables."""
        landings = len(self.plan.landings)
        shut = np.zeros((len(worlds), 0), bool) if percept.shut is None else percept.shut[worlds, landings:]
        ways, which = np.unique(shut, axis=0, return_inverse=True)
        parts = [
            self._options(values, percept, worlds[which.ravel() == way])
            for way, values in enumerate(
                self._values()[frozenset((landings + np.flatnonzero(row)).tolist())] for row in ways
            )
        ]
        order = np.argsort(np.argsort(which.ravel(), kind="stable"))
        return Options(*(np.concatenate([getattr(part, name) for part in parts])[order] for name in _OPTIONS))

    def _options(self, values: ValueTable, percept: Percept, worlds: np.ndarray) -> Options:
        """Return the same for worlds in which the same gates are shut."""
        if percept.belief is None:  # where each child is is known, and so what is to come can be added up at once
            every = np.arange(len(worlds))
            sums = _Sums.zeros(values, values.motion, every, percept, worlds)
            for child, probability in enumerate(np.moveaxis(self.belief.probability[worlds], 1, 0)):
                belief = probability.reshape(len(worlds), -1)[:, values.possible].astype(np.float32)
                sums.add(percept.child_cell[worlds, child], belief)
            return sums.options()
        ways = motion(self.plan, self.pace, lookouts(self.plan))
        cases = [_cases(percept.belief[worlds, child], values.possible) for child in range(percept.child_cell.shape[1])]
        parts = []
        for which, here, belief in cases:
            part = _Sums.zeros(values, ways, which, percept, worlds)
            part.add(here, belief)
            parts.append(part)
        by_world = [part.by_world() for part in parts]
        options = functools.reduce(_Sums.plus, by_world).options()
        if self.looks:
            options.damage[:] += self._ignorance(parts, by_world, cases)
        else:
            options.damage[:, parts[0].things.stop :] = np.inf
        return options

    def _ignorance(self, parts, by_world, cases) -> np.ndarray:
        """Return what not knowing where children are costs with every option, (W, options)."""
        one = parts[0]
        percept, motion, worlds = one.percept, one.motion, one.worlds
        cell = percept.caregiver_cell[worlds]
        options = one.going.shape[1]
        there = np.tile(cell[:, None], (1, options))  # where it ends
        far = np.zeros((len(worlds), options))
        posts, candles = len(motion.posts), one.got.shape[1]
        there[:, :posts] = motion.posts[: len(motion.posts)]
        far[:, :posts] = motion.open_distance[:posts, cell].T
        for candle in range(candles):
            source = percept.candle_table[worlds, candle]
            there[:, posts + 2 + candle] = motion.stands[source, motion.nearest[source, cell]]
            far[:, posts + 2 + candle] = motion.open_distance[posts + source, cell] + motion.pace.get
        there[:, one.things] = self.plan.floor_cells
        far[:, one.things] = motion.open_distance[motion.floor][:, cell].T
        there[:, one.things.stop :] = lookouts(self.plan)
        far[:, one.things.stop :] = motion.open_distance[motion.lookouts][:, cell].T
        left = np.ones(len(worlds)) if percept.time_left is None else percept.time_left[worlds]
        moves = np.clip(far / motion.pace.cells - left[:, None], 0, self.horizon)
        seen = visibility(self.plan, self.sight).seen[:, -1]
        each = [np.minimum(part.options().damage[:, : one.things.stop], 1e4) for part in parts]
        mean = [np.minimum(part.options().damage[:, : one.things.stop], 1e4) for part in by_world]
        cost = np.zeros((len(worlds), options))
        for child, ((which, here, belief), damage) in enumerate(zip(cases, each)):
            rest = sum([one_ for i, one_ in enumerate(mean) if i != child], np.zeros_like(mean[0]))
            damage = damage + belief.sum(axis=1)[:, None] * rest[which]
            hidden = ~seen[there[which], here[:, None]]  # (N, options)
            first = np.flatnonzero(np.diff(which, prepend=-1))
            blind = np.add.reduceat(hidden[:, :, None] * damage[:, None], first)
            told = np.add.reduceat(hidden * damage.min(axis=1)[:, None], first)
            loss = blind.min(axis=2) - told
            cost += moves * loss[:, posts + 1][:, None] + (self.horizon - moves) * loss
        return cost

    def expected_damage(self, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return the expected discounted damage to come after the caregiver's last action in a timestep, (W,).

        Args:
            percept: What is seen.
            worlds: Indices of worlds in which all candles are on tables, (W,).
        """
        nothing_left = dataclasses.replace(percept, time_left=np.zeros(len(percept.caregiver_cell)))
        return self.options(nothing_left, worlds).damage.min(axis=1)

    def _best(self, options: Options, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return the number of the option to take in some worlds, (W,)."""
        damage = options.damage.copy()
        if percept.out_of_reach is not None:
            openings, *others = self.plan.hazards.split(percept.out_of_reach[worlds])
            barred = np.concatenate([openings, np.zeros((len(worlds), 2), bool), *others], axis=1)
            looks = damage.shape[1] - barred.shape[1]
            barred = np.pad(barred, ((0, 0), (0, looks)))
            damage = np.where(barred, np.inf, damage)
        goes_on = np.arange(damage.shape[1]) == self._begun[worlds, None]
        return _first_of_least(damage - goes_on * self._hysteresis * damage.min(axis=1, keepdims=True))

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Return the table that was chosen with the candle, as long as it is bare; else the farthest one."""
        chosen = np.where(self._begun == len(self.plan.stairwells) + 2 + candle, self._table, NOTHING)
        bare = bare_tables(percept.candle_table, len(self.plan.tables))[np.arange(len(chosen)), chosen]
        return np.where(bare & (chosen != NOTHING), chosen, super().destination(percept, candle))

    def _order(self, answer: Interventions, worlds: np.ndarray, option: np.ndarray, table: np.ndarray) -> None:
        stairwells = len(self.plan.stairwells)
        rest = np.where(option == stairwells, STAND_ASIDE, DO_NOTHING)
        hazards = len(self.plan.hazards)
        hazard = np.where(option < stairwells, option, np.where(option < stairwells + 2, NOTHING, option - 2))
        looks = option - hazards - 2  # from which lookout
        hazard = np.where(looks >= 0, NOTHING, hazard)
        rest = np.where(looks >= 0, LOOK, rest)
        verb = np.append(self.plan.hazards.verb, "")[hazard]
        answer.hazard[worlds], answer.verb[worlds] = hazard, np.where(hazard == NOTHING, rest, verb)
        answer.destination[worlds] = self._table[worlds] = np.where(looks >= 0, looks, table)
        self._begun[worlds] = option

    def _within_reach_on_the_floor(self, percept: Percept) -> np.ndarray:
        """Return which candles are to be picked up, bool (B, candles)."""
        if percept.candle_cell is None:
            return np.zeros(percept.candle_table.shape, bool)
        lying = percept.candle_cell != NOTHING
        if percept.out_of_reach is None:
            return lying
        return lying & ~self.plan.hazards.split(percept.out_of_reach)[1]


def _first_of_least(damage: np.ndarray) -> np.ndarray:
    """Return the first of the least along the last axis; numbers that only rounding tells apart count as equal."""
    return (damage <= damage.min(axis=-1, keepdims=True) * (1.0 + 1e-5)).argmax(axis=-1)


def each_on_a_table(plan: FloorPlan, percept: Percept) -> Percept:
    """Return the percept with a candle that lies on the floor, or shares a table, on the nearest bare one.

    That happens in the house only, and seldom. Those in the hand stay there.
    """
    if percept.candle_cell is None:
        return percept
    tables = percept.candle_table.copy()
    places = np.array([plan.position(cell) for cell in plan.tables])
    for world, lying in enumerate(percept.candle_cell):
        first = np.unique(tables[world], return_index=True)[1]
        for candle in range(len(lying)):
            table = tables[world, candle]
            if candle == percept.holding[world] or (table != NOTHING and candle in first):
                continue
            here = plan.position(plan.free_cells[lying[candle]]) if table == NOTHING else places[table]
            distance = np.linalg.norm(places - here, axis=1)
            distance[tables[world][tables[world] != NOTHING]] = np.inf
            tables[world, candle] = distance.argmin()
    return dataclasses.replace(percept, candle_table=tables)


class KnowsGoalCaregiver(ForesightCaregiver, ToldCaregiver):
    """Is told the toy bin and the epsilon of each child, but not what will come by chance, nor of which kind it is.

    It is no bound: its planner is the same, with the same approximations. An epsilon between two that it has plans for
    is believed to be either, so that it is right on an average.
    """

    def hear(self, truth: Truth) -> None:
        goals = self.belief.probability.shape[2]
        bins = len(self.plan.bins)
        at_goal = truth.goal[..., None] == np.arange(goals)  # (B, K, G): as a novice
        known = np.array(EPSILONS)
        epsilon = np.clip(truth.epsilon, known[0], known[-1])
        above = np.clip(np.searchsorted(known, epsilon), 1, len(known) - 1)
        share = (epsilon - known[above - 1]) / (known[above] - known[above - 1])
        each = np.eye(len(known))
        of_epsilon = (1 - share)[..., None] * each[above - 1] + share[..., None] * each[above]
        novice = self.belief.probability[:, :, :bins].sum(axis=(2, 3), keepdims=True)
        told = novice * at_goal[..., None] * of_epsilon[:, :, None]
        self.belief.probability = np.where(np.arange(goals)[:, None] < bins, told, self.belief.probability)


class PaperPredictiveCaregiver(PaperCaregiver):
    """The rule, equation (2), in which P(reach) is the probability that the child runs into the hazard soon.

    Soon is within `horizon` timesteps.

    That follows from where it is and from what its moves have told of its toy bin and its epsilon. P(safe), and with it
    what tells between several children, is the paper's.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0, *, horizon: int = HORIZON):
        self._horizon = horizon
        super().__init__(plan, seed)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.belief = Belief(child_chain(self.plan), batch, children, CHANGE)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)

    def assess(self, percept: Percept) -> Assessment:
        return dataclasses.replace(super().assess(percept), outlook=self._outlook(percept))

    def reach(self, percept: Percept) -> np.ndarray:
        return self._outlook(percept).reach(self.plan, percept, self._horizon)

    def _outlook(self, percept: Percept) -> Outlook:
        return Outlook(child_chain(self.plan), percept.child_cell, self.belief.probability)
