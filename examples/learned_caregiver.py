r"""The learned caregiver: a small network says what is best to do, which has learned it from `foresight`.

    PYTHONPATH=examples caregiver-mj evaluate --world grid --house house-20 --epsilon .5 --episodes 5 \
        --caregiver none expected-danger learned_caregiver:LearnedCaregiver

`scripts/train.py` trains it; here it runs on NumPy alone, with the weights in `learned.npz`. Every option (an opening,
a candle and a table for it, a thing on the floor, to stand aside, to stay) has features: what is to be expected of its
hazard, and of the others meanwhile, by the belief of `foresight`; how long the robot takes; and what a planner that
knows of no candles expects where the robot will then be. That one has a single layout to plan for, so that it is made in
a tenth of the time; what candles come to is what the network has learned. It scores each option, knowing what the
others are on an average, so that it serves houses with any number of hazards.
"""

from __future__ import annotations

import dataclasses
import functools
import pathlib
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import EPSILONS, Followers, child_chain
from caregiver_mj.caregivers.foresight.foresight import each_on_a_table
from caregiver_mj.caregivers.foresight.motion import motion
from caregiver_mj.caregivers.foresight.value_table import Objective, candles_at_a_time, value_tables
from caregiver_mj.caregivers.percept import Outlook, Pace, Percept, bare_tables
from caregiver_mj.danger.chain import discounted_entry, expected_hits, first_entry, first_passage
from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, Interventions
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, Where

# What it is trained for: a denied move costs four fifths of what it does `foresight`, so that it denies as many as the rule.
OBJECTIVE = Objective(price=1.2, random_price=0.24)
LOYAL = 0.5  # by how much, in score, something else must be better than what it is about
_COARSE = dataclasses.replace(OBJECTIVE, sweeps=40, tolerance=0.02)
_WITHIN = np.array([1, 2, 3, 5, 8, 12, 20, 30])  # timesteps within which a child may come to harm
_SHOWN = [0, 1, 3, 5]  # of what is to be expected, features of their own: at all, and within 1, 3 and 8 timesteps
_CANDLES = str.maketrans({kind.symbol: TABLE.symbol for kind in KINDS if kind.where is Where.ON_TABLE})
Weights = dict[str, np.ndarray]


@functools.cache
def shipped() -> Weights:
    """Return the weights beside this file, read once."""
    with np.load(pathlib.Path(__file__).with_name("learned.npz")) as file:
        return {name: value.astype(float) for name, value in file.items()}


def layers(net: Weights, rows: np.ndarray, worlds: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return what the network makes of options: its layers, and the score of each, (N,).

    The rows are the features of the options, (N, features), of B worlds one after the other, so many (B,) of each;
    those of the worlds are (B, features).
    """
    first = np.cumsum(counts) - counts
    x = np.clip((rows - net["mean"]) / net["spread"], -6.0, 6.0)
    world = np.clip((worlds - net["mean_world"]) / net["spread_world"], -6.0, 6.0)
    one = np.maximum(x @ net["w1"] + (world @ net["v1"] + net["b1"]).repeat(counts, axis=0), 0.0)
    around = np.add.reduceat(one, first) / counts[:, None].astype(one.dtype)
    two = np.maximum(one @ net["w2"] + (around @ net["u2"] + net["b2"]).repeat(counts, axis=0), 0.0)
    return x, world, one, around, two, two @ net["w3"] + x @ net["skip"]


@functools.lru_cache(maxsize=4)
def _prospects(plan: FloorPlan) -> np.ndarray:
    """Return what is to be expected of openings, tables and things on the floor, (cells, G E, (1 + horizons) places).

    That is, in this order, the discounted bumps to come, and the probability of one within each horizon.
    """
    chain, things, discount = child_chain(plan), plan.floor_cells, OBJECTIVE.discount
    found = [expected_hits(chain, discount), discounted_entry(chain, things, discount)]
    for timesteps in _WITHIN.tolist():
        found += [first_passage(chain, timesteps), first_entry(chain, things, timesteps)]
    return np.concatenate(found, axis=1).reshape(chain.shape[0], chain.size // chain.shape[0], -1).astype(np.float32)


@functools.lru_cache(maxsize=4)
def _without_candles(plan: FloorPlan, pace: Pace) -> tuple[np.ndarray, np.ndarray]:
    """Return the damage to come if there were no candles, and the goals and epsilons that it is by, (J,).

    It is (sets of shut gates, 1 + things, C R, J), as in `ValueTable.value`: whatever the caregiver does, and if it
    goes for each thing on the floor. Of a house that is too large even for that nothing is expected.
    """
    bare = dataclasses.replace(plan, rows=tuple(row.translate(_CANDLES) for row in plan.rows))
    if candles_at_a_time(bare) < 0:
        none = np.zeros((1, 1, 1, 1), np.float32)
        shape = 1 << len(plan.mouths), 1 + len(plan.floor_cells), len(plan.free_cells) * len(plan.caregiver_cells), 1
        return np.broadcast_to(none, shape), np.zeros(1, int)
    tables = value_tables(bare, pace, _COARSE)
    by_gates = {sum(1 << (gate - len(plan.landings)) for gate in shut): table for shut, table in tables.items()}
    values = [np.stack([one.value[0], *(going[0] for going in one.going)]) for _, one in sorted(by_gates.items())]
    return np.stack(values), next(iter(tables.values())).possible


class LearnedCaregiver(Caregiver):
    """Does what a network scores highest, and thinks better of it when the children have moved, or it is done.

    Attributes:
        net: Its weights; those of `shipped`, if left out.
        hazard: The hazard of each option, NOTHING for the last two: to stand aside, and to stay.
        table: The table that each option takes a candle to, or NOTHING.
        followers: What it believes of the children, too.
    """

    net: Weights | None = None
    followers: Followers

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        hazards, openings, tables = plan.hazards, len(plan.stairwells), len(plan.tables)
        candles, each = len(plan.candle_tables), np.arange(len(hazards))
        pairs = np.arange(candles * tables)
        fetched, others = pairs // max(1, tables), each[openings + candles :]
        self.hazard = np.concatenate([each[:openings], openings + fetched, others, [NOTHING, NOTHING]])
        self.table = np.full(len(self.hazard), NOTHING)
        self.table[openings : openings + len(pairs)] = pairs % max(1, tables)
        self._pair = self.table != NOTHING
        self._candle = np.where(self._pair, self.hazard - openings, 0)
        self._of = np.append(self.hazard[:-2], [len(hazards)] * 2)
        is_thing = self.hazard >= openings + candles
        self._thing = np.where(is_thing, self.hazard - openings - candles, NOTHING)
        # Damage of each hazard, for one on a table that beyond the bare table's.
        self._more = hazards.damage - hazards.weights[TABLE.name] * hazards.are_at(Where.ON_TABLE, each)
        opens = (self.hazard >= 0) & (self.hazard < openings)
        gate, idle = opens & (self.hazard >= len(plan.landings)), np.eye(len(self.hazard))[:, -2:]
        self._kind = np.column_stack(
            [opens, gate, self._pair, is_thing, idle, np.append(self._more, 0.0)[self._of] / 5]
        )
        self._apart = plan.graph.distances_from(range(len(plan.caregiver_cells)))
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.followers = Followers(self.plan, batch, children)
        self._about, self._moved = np.full(batch, NOTHING), np.ones(batch, bool)

    def watch(self, percept: Percept) -> None:
        super().watch(percept)
        self._moved[:] = True

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        percept, every = each_on_a_table(self.plan, percept), np.arange(len(self._about))
        goes_on = ~self._moved & self.can_be(percept)[every, self._about] & (self._about != NOTHING)
        worlds = np.flatnonzero((percept.holding == NOTHING) & ~goes_on)
        if worlds.size:
            score = self.scores(percept, worlds)
            old = self._about[worlds]
            score[old != NOTHING, old[old != NOTHING]] += LOYAL
            self._about[worlds] = score.argmax(axis=1)
            self._moved[worlds] = False
        return self.take(self._about)

    def scores(self, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return how good each option is in some worlds, (W,), -inf for what cannot be: (W, options)."""
        return self.judged(*self.features(percept, worlds))

    def judged(self, options: np.ndarray, world: np.ndarray, there: np.ndarray) -> np.ndarray:
        """Return the same by what `features` returns."""
        score = np.full(there.shape, -np.inf)
        # Rounded, for sums may come out otherwise in another batch.
        score[there] = layers(self.net or shipped(), options[there], world, there.sum(axis=1))[-1].round(9)
        return score

    def take(self, option: np.ndarray) -> Interventions:
        """Return the interventions of options, (B,)."""
        hazard = self.hazard[option]
        idle = np.where(option == len(self.hazard) - 1, DO_NOTHING, STAND_ASIDE)
        verb = np.append(self.plan.hazards.verb, "")[hazard]
        return Interventions(np.where(hazard == NOTHING, idle, verb), hazard, self.table[option])

    def can_be(self, percept: Percept, worlds: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return which options there are in some worlds, bool (W, options)."""
        there = np.ones((len(percept.candle_table[worlds]), len(self.hazard)), bool)
        if percept.out_of_reach is not None:
            there[:, :-2] = ~percept.out_of_reach[worlds][:, self._of[:-2]]
        there[:, self._pair] &= bare_tables(percept.candle_table[worlds], len(self.plan.tables))[
            :, self.table[self._pair]
        ]
        there[:, :-2] &= ~self.followers.there[worlds, None]
        return there

    def features(self, percept: Percept, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what the network goes by, and what there is, in some worlds, (W,), in which all candles are on tables.

        Returns:
            Features of the options, (W, options, features), and of the worlds, (W, features); and which options there
            are, bool (W, options).
        """
        plan, pair, ways = self.plan, self._pair, motion(self.plan, self.pace)
        openings, hazards, candles = len(plan.stairwells), len(plan.hazards), len(plan.candle_tables)
        child, cell, table = percept.child_cell[worlds], percept.caregiver_cell[worlds], percept.candle_table[worlds]
        count, each = len(worlds), np.arange(len(worlds))
        left = np.ones(count) if percept.time_left is None else percept.time_left[worlds]
        there = self.can_be(percept, worlds)

        # What is to be expected of each place, of the hazard that is there, and if the candle is on the other table.
        belief = self.followers.belief.probability[worlds]
        wants = belief.reshape(*child.shape, 1, -1)
        joint = None if percept.belief is None else percept.belief.joint[worlds]
        if joint is None:
            expected = (wants @ _prospects(plan)[child]).sum(axis=(1, 2))
        else:
            expected = Outlook(child_chain(plan), child, belief, joint).expected(_prospects(plan)).sum(axis=1)
        expected = expected.reshape(count, 1 + len(_WITHIN), -1)
        place = np.broadcast_to(np.arange(expected.shape[2]), (count, expected.shape[2]))
        place = np.concatenate([place[:, :openings], openings + table, place[:, openings + len(plan.tables) :]], axis=1)
        alive = np.ones((count, hazards), bool) if percept.out_of_reach is None else ~percept.out_of_reach[worlds]
        now = np.zeros((count, 1 + len(_WITHIN), hazards + 1))  # the last one is for idling
        now[..., :-1] = np.take_along_axis(expected, place[:, None], axis=2) * (self._more * alive)[:, None]
        before, gain = now[..., self._of], now[..., self._of]
        gain[..., pair] -= expected[..., openings + self.table[pair]] * self._more[self.hazard[pair]]

        # How long it takes to get there, and to be done; where it will be at the next move, and in the end.
        near = self._apart[cell[:, None], child]
        nearest, here = child[each, near.argmin(axis=1)][:, None], cell[:, None]
        idle = [ways.aside, ways.aside + 1]
        static = np.concatenate([range(openings), np.zeros(pair.sum(), int), ways.floor, idle]).astype(int)
        spot = np.where(pair, len(ways.posts) + table[:, self._candle], static) if candles else static[None]
        goal = np.minimum(spot, ways.aside - 1)
        way = ways.distance[goal, nearest, here].astype(float)
        barred = (way == UNREACHABLE) & (spot < ways.aside)
        way = np.where(spot < ways.aside, np.where(barred, ways.open_distance[goal, here] + 6.0, way), 0.0)
        steps = np.clip(np.rint(left * self.pace.cells), 0, len(ways.after) - 1).astype(int)
        after = ways.after[steps[:, None], spot, nearest, here].astype(int)
        end, carry = np.where(spot < ways.aside, ways.end[goal, here], after), np.zeros(way.shape)
        if pair.any():
            to, stand = len(ways.posts) + self.table[pair], end[:, pair]
            carry[:, pair] = ways.open_distance[to, stand] + self.pace.get + self.pace.place
            end[:, pair] = ways.end[to, stand]
        soon = np.maximum(way / self.pace.cells - left[:, None], 0.0)
        done = np.maximum((way + carry) / self.pace.cells - left[:, None], 0.0)

        # What is to be expected where it will be, were there no candles.
        value, possible = _without_candles(plan, self.pace)
        shut = np.zeros((count, openings), bool) if percept.shut is None else percept.shut[worlds]
        gates = shut[:, len(plan.landings) :] @ (1 << np.arange(len(plan.mouths)))
        cells = np.concatenate([after, end, here], axis=1)[:, None] + child[:, :, None] * len(plan.caregiver_cells)
        goes_for = np.concatenate([self._thing + 1, np.zeros(len(self.hazard) + 1, int)])
        found = value[gates[:, None, None], goes_for, cells] @ wants[:, :, 0, possible, None].astype(np.float32)
        then, last, stays = np.split(found[..., 0].sum(axis=1).astype(float), [len(self.hazard), -1], axis=1)
        lying = now[:, 0, openings + candles : -1]
        then = then + lying.sum(axis=1, keepdims=True)
        then[:, self._thing != NOTHING] -= lying

        best, greatest = np.zeros((count, hazards + 1)), np.where(there, gain[:, 0], 0.0)
        np.maximum.at(best, (each[:, None], self._of), greatest)
        most = best.max(axis=1, keepdims=True)
        soon_hit, too_late, later = (_within(before, moves) for moves in (soon, done, done + 1.0))
        in_hand = pair & (way + self.pace.get <= left[:, None] * self.pace.cells + 1e-6)
        saved = np.where(pair, np.maximum(gain[:, 0] - too_late, 0.0), 0.0)
        # What the others may do until it could get to them afterwards, and what could then still be saved.
        target = np.concatenate([table + len(ways.posts), np.tile(ways.floor, (count, 1))], axis=1).astype(int)
        onwards = ways.open_distance[target[:, None], end[..., None]] / self.pace.cells + done[..., None]
        harm = _within(now[:, :, None, openings:-1], onwards)
        rest = np.where(self.hazard[:, None] == np.arange(openings, hazards), 0.0, 1.0)
        saves = np.maximum(best[:, None, openings:-1] - harm, 0.0) * rest
        onwards = [(harm * rest).sum(axis=2), saves.sum(axis=2), saves.max(axis=2, initial=0.0)]
        on_tables = now[..., openings : openings + candles].sum(axis=2)
        meanwhile = _within(np.repeat(on_tables[..., None], len(self.hazard), axis=2), done) - np.where(
            pair, too_late, 0.0
        )
        worse, worse_saved, worse_last = (_beyond_least(some, there) for some in (then, then - saved, last))
        options = [
            _log(worse), worse, _log(worse_saved), worse_saved, _log(worse_last), worse_last, last - stays,
            then - stays - lying.sum(axis=1, keepdims=True), _log(gain[:, 0]), gain[:, 0], _log(saved),
            gain[:, 0] / np.maximum(most, 1e-6), best[:, self._of] - gain[:, 0], _log(soon_hit),
            _log(too_late), _log(later - too_late), _log(meanwhile), soon / 5, done / 5, np.ceil(done - 1e-6) / 5, in_hand,
            np.where(in_hand, _log(saved), 0.0), *map(_log, onwards), onwards[1], way == 0, way <= 1, barred,
            *(_log(before[:, column]) for column in (*_SHOWN[1:], 0)), *(_log(gain[:, column]) for column in _SHOWN[1:]), carry / 15,
            *np.broadcast_to(self._kind.T[:, None], (self._kind.shape[1], *there.shape)),
        ]  # fmt: skip
        bumps = expected[:, :, openings : openings + len(plan.tables)].sum(axis=2)
        sums = now[..., :openings].sum(axis=2), on_tables, now[..., openings + candles : -1].sum(axis=2), bumps
        some = there[:, :openings], there[:, pair] / 5, there[:, self._thing != NOTHING]
        children = np.full(count, child.shape[1])
        world = [
            *(_log(some[:, _SHOWN]) for some in sums), stays, _log(np.where(there, then, np.inf).min(axis=1)),
            _log(most), belief.sum(axis=2).mean(axis=1) @ np.linspace(0, 1, len(EPSILONS)), left,
            np.minimum(near.min(axis=1), 15) / 5, children, *(one.sum(axis=1) for one in some),
            np.tile([candles, len(plan.tables) - candles], (count, 1)),
        ]  # fmt: skip
        return np.stack(options, axis=2), np.column_stack(world), there


def _log(damage: np.ndarray) -> np.ndarray:
    """Return the same on a scale that tells small ones apart."""
    return np.log1p(100.0 * np.maximum(damage, 0.0)) / 3.0


def _beyond_least(damage: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Return by how much each option is worse than the best that there is, (B, options)."""
    return damage - np.where(there, damage, np.inf).min(axis=1, keepdims=True)


def _within(harm: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return what is to be expected within some moves, (B, ...), by that within each horizon, (B, horizons, ...)."""
    moves = np.minimum(moves, _WITHIN[-1])
    column = np.searchsorted(_WITHIN, moves)  # of the horizon from there on; in between it is taken to be linear
    ends = np.append(_WITHIN, 0)
    share = (moves - ends[column - 1]) / (ends[column] - ends[column - 1])
    above = np.take_along_axis(harm, column[:, None] + 1, axis=1)[:, 0]
    below = np.take_along_axis(harm, np.maximum(column, 1)[:, None], axis=1)[:, 0] * (column > 0)
    return below + share * (above - below)
