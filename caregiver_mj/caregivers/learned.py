"""The learned caregiver: a small network that imitates `foresight`.

`scripts/train.py` trains it; here it runs on NumPy alone, with the weights in `learned.npz`. Its options are: an
opening; a candle and a table for it; a thing on the floor; standing aside; staying. Their features are the expected
damage of the option's hazard, and of the others meanwhile, by the belief of `foresight`; the robot's durations; and the
value of the robot's next place in a planner without candles, which has a single layout. The network scores each option
together with the mean of all, so that any number of hazards is possible.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib.resources
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import each_on_a_table
from caregiver_mj.caregivers.foresight.motion import Motion, motion
from caregiver_mj.caregivers.foresight.value_table import Objective, candles_at_a_time, value_tables
from caregiver_mj.caregivers.percept import Followers, Pace, Percept, Prediction, bare_tables
from caregiver_mj.danger.chain import discounted_entry, expected_hits, first_entry, first_passage
from caregiver_mj.danger.child_model import EPSILONS, child_chain
from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, Interventions
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, Where

# Objective of the training: a denied move costs four fifths of its price in `foresight`.
OBJECTIVE = Objective(price=1.2, random_price=0.24)
LOYAL = 0.5  # score; least advantage of another option over the present one
_WITHIN = np.array([1, 2, 3, 5, 8, 12, 20, 30])  # novice timesteps; horizons of expected damage
_SHOWN = [0, 1, 3, 5]  # horizons that are features: unlimited, and 1, 3 and 8 timesteps
_CANDLES = str.maketrans({kind.symbol: TABLE.symbol for kind in KINDS if kind.where is Where.ON_TABLE})
Weights = dict[str, np.ndarray]


@functools.cache
def shipped() -> Weights:
    """Return the packaged weights."""
    with (importlib.resources.files(__package__) / "learned.npz").open("rb") as content, np.load(content) as file:
        return {name: value.astype(float) for name, value in file.items()}


def layers(net: Weights, rows: np.ndarray, worlds: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the network's layers, the last of which is the score of each option, (N,).

    `rows` are features of the options, one world after the other, (N, features), `worlds` those of the worlds, (B,
    features), and `counts` the numbers of options in each world, (B,).
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
    """Return the expected bumps into openings, tables and things on the floor, (cells, G E, (1 + horizons) places).

    First their discounted number, then the probability of one within each horizon.
    """
    chain, things, discount = child_chain(plan), plan.floor_cells, OBJECTIVE.discount
    found = [expected_hits(chain, discount), discounted_entry(chain, things, discount)]
    for timesteps in _WITHIN.tolist():
        found += [first_passage(chain, timesteps), first_entry(chain, things, timesteps)]
    return np.concatenate(found, axis=1).reshape(chain.shape[0], chain.size // chain.shape[0], -1).astype(np.float32)


def _ways(plan: FloorPlan, pace: Pace) -> Motion:
    """Return its motion model: that of the grid, its training world, where a child beside it does not slow it down."""
    return motion(plan, dataclasses.replace(pace, beside=()))


@functools.lru_cache(maxsize=4)
def _without_candles(plan: FloorPlan, pace: Pace) -> tuple[np.ndarray, np.ndarray]:
    """Return the damage to come without candles, and the goals and epsilons of its last dimension, (J,).

    The damage is (sets of shut gates, 1 + things, C R, J): `ValueTable.value`, then `ValueTable.going` of each thing on
    the floor. It is zero for a house too large for tables.
    """
    bare = dataclasses.replace(plan, rows=tuple(row.translate(_CANDLES) for row in plan.rows))
    if candles_at_a_time(bare) < 0:
        none = np.zeros((1, 1, 1, 1), np.float32)
        shape = 1 << len(plan.mouths), 1 + len(plan.floor_cells), len(plan.free_cells) * len(plan.caregiver_cells), 1
        return np.broadcast_to(none, shape), np.zeros(1, int)
    # The network was trained on tables of a planner without waiting cells.
    pace, objective = dataclasses.replace(pace, beside=()), dataclasses.replace(OBJECTIVE, sweeps=40)
    tables = value_tables(bare, pace, objective, waits=False)
    by_gates = {sum(1 << (gate - len(plan.landings)) for gate in shut): table for shut, table in tables.items()}
    values = [np.stack([one.value[0], *(going[0] for going in one.going)]) for _, one in sorted(by_gates.items())]
    return np.stack(values), next(iter(tables.values())).possible


class LearnedCaregiver(Caregiver):
    """Takes the option with the highest score, and reconsiders after every move of the children or once it is done.

    Attributes:
        net: Its weights; None for `shipped`.
        hazard: Hazard of each option, NOTHING for the last two: to stand aside, and to stay.
        table: Destination of each relocation, else NOTHING; `pair` marks relocations, `candle` is the candle.
        of: Hazard of each option, for the last two the number of hazards; `thing` the one on the floor, or NOTHING.
        kind: Features of each option's kind.
        more: Damage of each hazard; for one on a table, beyond the bare table's.
        apart: Steps between the caregiver's cells.
        followers: Detects followers; also holds the belief about the children.
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
        self.pair = self.table != NOTHING
        self.candle = np.where(self.pair, self.hazard - openings, 0)
        self.of = np.append(self.hazard[:-2], [len(hazards)] * 2)
        is_thing = self.hazard >= openings + candles
        self.thing = np.where(is_thing, self.hazard - openings - candles, NOTHING)
        self.more = hazards.damage - hazards.weights[TABLE.name] * hazards.are_at(Where.ON_TABLE, each)
        opens = (self.hazard >= 0) & (self.hazard < openings)
        gate, idle = opens & (self.hazard >= len(plan.landings)), np.eye(len(self.hazard))[:, -2:]
        self.kind = np.column_stack([opens, gate, self.pair, is_thing, idle, np.append(self.more, 0.0)[self.of] / 5])
        self.apart = plan.graph.distances_from(range(len(plan.caregiver_cells)))
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
        if worlds.size and len(self.plan.hazards):
            score, old = self.scores(percept, worlds), self._about[worlds]
            score[old != NOTHING, old[old != NOTHING]] += LOYAL
            self._about[worlds] = score.argmax(axis=1)
            self._moved[worlds] = False
        return self.take(self._about)

    def scores(self, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return the score of each option in some worlds (W,), -inf for an impossible one, (W, options)."""
        return self.judged(*self.features(percept, worlds))

    def judged(self, options: np.ndarray, world: np.ndarray, there: np.ndarray) -> np.ndarray:
        """Return the scores from the result of `features`."""
        score = np.full(there.shape, -np.inf)
        # rounded: sums may depend on the batch
        score[there] = layers(self.net or shipped(), options[there], world, there.sum(axis=1))[-1].round(9)
        return score

    def take(self, option: np.ndarray) -> Interventions:
        """Return the interventions of options, (B,)."""
        hazard = self.hazard[option]
        idle = np.where(option == len(self.hazard) - 1, DO_NOTHING, STAND_ASIDE)
        verb = np.append(self.plan.hazards.verb, "")[hazard]
        return Interventions(np.where(hazard == NOTHING, idle, verb), hazard, self.table[option])

    def can_be(self, percept: Percept, worlds: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return whether each option is possible in some worlds, bool (W, options)."""
        there = np.ones((len(percept.candle_table[worlds]), len(self.hazard)), bool)
        if percept.out_of_reach is not None:
            there[:, :-2] = ~percept.out_of_reach[worlds][:, self.of[:-2]]
        bare = bare_tables(percept.candle_table[worlds], len(self.plan.tables))
        there[:, self.pair] &= bare[:, self.table[self.pair]]
        there[:, :-2] &= ~self.followers.there[worlds, None]
        return there

    def features(self, percept: Percept, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return features of options, (W, options, features), and of worlds, and which options are possible."""
        look = _Look(self, percept, worlds)
        return look.options(), look.world(), look.there


class _Look:
    """Inputs of the features: the present state of W worlds."""

    def __init__(self, caregiver: LearnedCaregiver, percept: Percept, worlds: np.ndarray):
        self.by, self.plan, self.count = caregiver, caregiver.plan, len(worlds)
        plan, pair, more = self.plan, caregiver.pair, caregiver.more
        openings, candles, hazards = len(plan.stairwells), len(plan.candle_tables), len(plan.hazards)
        self.openings, self.on_tables = slice(openings), slice(openings, openings + candles)
        self.others, self.lying = slice(openings, hazards), slice(openings + candles, hazards)
        self.child, self.cell = percept.child_cell[worlds], percept.caregiver_cell[worlds]
        self.table, self.there = percept.candle_table[worlds], caregiver.can_be(percept, worlds)
        self.left = np.ones(self.count) if percept.time_left is None else percept.time_left[worlds]
        shut = np.zeros((self.count, openings), bool) if percept.shut is None else percept.shut[worlds]
        self.gates = shut[:, len(plan.landings) :] @ (1 << np.arange(len(plan.mouths)))

        # Expected damage of each option's hazard, and its decrease by the option.
        belief = caregiver.followers.belief.probability[worlds]
        self.epsilon, self.wants = belief.sum(axis=2).mean(axis=1), belief.reshape(*self.child.shape, 1, -1)
        prospects = _prospects(plan)
        if percept.belief is None:
            expected = (self.wants @ prospects[self.child]).sum(axis=(1, 2))
        else:
            prediction = Prediction(child_chain(plan), self.child, belief, percept.belief.joint[worlds])
            expected = prediction.expected(prospects).sum(axis=1)
        expected = expected.reshape(self.count, 1 + len(_WITHIN), -1)
        self.bumps = expected[:, :, openings : openings + len(plan.tables)].sum(axis=2)
        place = np.tile(np.arange(expected.shape[2]), (self.count, 1))
        place = np.concatenate([place[:, :openings], openings + self.table, place[:, openings + len(plan.tables) :]], 1)
        alive = np.ones((self.count, hazards), bool)
        if percept.out_of_reach is not None:
            alive = ~percept.out_of_reach[worlds]
        self.now = np.zeros((self.count, 1 + len(_WITHIN), hazards + 1))  # last: idling
        self.now[..., :-1] = np.take_along_axis(expected, place[:, None], axis=2) * (more * alive)[:, None]
        self.before, self.gain = self.now[..., caregiver.of], self.now[..., caregiver.of]
        self.gain[..., pair] -= expected[..., openings + caregiver.table[pair]] * more[caregiver.hazard[pair]]
        self._time()

    def _time(self) -> None:
        """Compute each option's durations, and its places at the next move and at the end."""
        by, pace, ways, pair = self.by, self.by.pace, _ways(self.plan, self.by.pace), self.by.pair
        near = by.apart[self.cell[:, None], self.child]
        self.near, here, left = near.min(axis=1), self.cell[:, None], self.left[:, None]
        nearest = self.child[np.arange(self.count), near.argmin(axis=1)][:, None]
        static = np.concatenate([np.arange(self.openings.stop), np.zeros(pair.sum()), ways.floor, [0, 0]]).astype(int)
        static[-2:] = ways.aside, ways.aside + 1
        spot = np.where(pair, len(ways.posts) + self.table[:, by.candle], static) if pair.any() else static[None]
        goal, goes = np.minimum(spot, ways.aside - 1), spot < ways.aside
        way = ways.distance[goal, nearest, here].astype(float)
        self.barred = (way == UNREACHABLE) & goes
        self.way = way = np.where(goes, np.where(self.barred, ways.open_distance[goal, here] + 6.0, way), 0.0)
        self.after = ways.walk(spot, nearest, here, np.rint(left * pace.cells))[0]
        self.end, self.carry = np.where(goes, ways.end[goal, here], self.after), np.zeros(way.shape)
        if pair.any():
            to, stand = len(ways.posts) + by.table[pair], self.end[:, pair]
            self.carry[:, pair] = ways.open_distance[to, stand] + pace.get + pace.place
            self.end[:, pair] = ways.end[to, stand]
        self.soon = np.maximum(way / pace.cells - left, 0.0)
        self.done = np.maximum((way + self.carry) / pace.cells - left, 0.0)
        self.in_hand = pair & (way + pace.get <= left * pace.cells + 1e-6)

    @functools.cached_property
    def planned(self) -> list[np.ndarray]:
        """Values without candles: at the next move and at the end of each option, (W, options), and staying, (W, 1)."""
        value, possible = _without_candles(self.plan, self.by.pace)
        cells = np.concatenate([self.after, self.end, self.cell[:, None]], axis=1)[:, None]
        cells = cells + self.child[:, :, None] * len(self.plan.caregiver_cells)
        goes_for = np.concatenate([self.by.thing + 1, np.zeros(len(self.by.hazard) + 1, int)])
        wants = self.wants[:, :, 0, possible, None].astype(np.float32)
        found = (value[self.gates[:, None, None], goes_for, cells] @ wants)[..., 0].sum(axis=1).astype(float)
        then, end, stays = np.split(found, [len(self.by.hazard), -1], axis=1)
        lying = self.now[:, 0, self.lying]
        then = then + lying.sum(axis=1, keepdims=True)
        then[:, self.by.thing != NOTHING] -= lying
        return [then, end, stays]

    @functools.cached_property
    def best(self) -> np.ndarray:
        """Greatest gain by each hazard, and by idling, (W, hazards + 1)."""
        best = np.zeros(self.now.shape[::2])
        np.maximum.at(best, (np.arange(self.count)[:, None], self.by.of), np.where(self.there, self.gain[:, 0], 0.0))
        return best

    def afterwards(self) -> list[np.ndarray]:
        """Return the damage of other hazards until the robot gets to them after each option, and the possible gains."""
        ways = _ways(self.plan, self.by.pace)
        target = np.concatenate([self.table + len(ways.posts), np.tile(ways.floor, (self.count, 1))], axis=1)
        onwards = ways.open_distance[target.astype(int)[:, None], self.end[..., None]] / self.by.pace.cells
        harm = _within(self.now[:, :, None, self.others], onwards + self.done[..., None])
        rest = self.by.hazard[:, None] != np.arange(self.others.start, self.others.stop)
        saves = np.maximum(self.best[:, None, self.others] - harm, 0.0) * rest
        return [(harm * rest).sum(axis=2), saves.sum(axis=2), saves.max(axis=2, initial=0.0)]

    def options(self) -> np.ndarray:
        """Return the features of the options, (W, options, features)."""
        by, before, gain, done, there = self.by, self.before, self.gain, self.done, self.there
        then, end, stays = self.planned
        soon_hit, too_late, later = (_within(before, moves) for moves in (self.soon, done, done + 1.0))
        saved = np.where(by.pair, np.maximum(gain[:, 0] - too_late, 0.0), 0.0)
        on_tables = self.now[..., self.on_tables].sum(axis=2)[..., None].repeat(len(by.hazard), axis=2)
        meanwhile = _within(on_tables, done) - np.where(by.pair, too_late, 0.0)
        onwards = self.afterwards()
        planned = [one - np.where(there, one, np.inf).min(axis=1, keepdims=True) for one in (then, then - saved, end)]
        lying = self.now[:, 0, self.lying].sum(axis=1, keepdims=True)
        values = [
            *(part for one in planned for part in (_log(one), one)), end - stays, then - stays - lying,
            _log(gain[:, 0]), gain[:, 0], _log(saved),
            self.best[:, by.of] - gain[:, 0], _log(soon_hit), _log(too_late), _log(later - too_late), _log(meanwhile),
            self.soon / 5, done / 5, np.ceil(done - 1e-6) / 5, self.in_hand, np.where(self.in_hand, _log(saved), 0.0),
            *map(_log, onwards), onwards[1], self.way == 0, self.way <= 1, self.barred,
            *(_log(before[:, column]) for column in (*_SHOWN[1:], 0)),
            *(_log(gain[:, column]) for column in _SHOWN[1:]), self.carry / 15,
        ]  # fmt: skip
        kind = np.broadcast_to(by.kind, (self.count, *by.kind.shape))
        return np.concatenate([np.stack(values, axis=2), kind], axis=2)

    def world(self) -> np.ndarray:
        """Return the features of the worlds, (W, features)."""
        then, _, stays = self.planned
        sums = [self.now[..., some].sum(axis=2) for some in (self.openings, self.on_tables, self.lying)]
        some = self.there[:, self.openings], self.there[:, self.by.pair] / 5, self.there[:, self.by.thing != NOTHING]
        candles = len(self.plan.candle_tables)
        return np.column_stack([
            *(_log(one[:, _SHOWN]) for one in (*sums, self.bumps)),
            stays, _log(np.where(self.there, then, np.inf).min(axis=1)), _log(self.best.max(axis=1)),
            self.epsilon @ np.linspace(0, 1, len(EPSILONS)), self.left, np.minimum(self.near, 15) / 5,
            np.full(self.count, self.child.shape[1]), *(one.sum(axis=1) for one in some),
            np.tile([candles, len(self.plan.tables) - candles], (self.count, 1)),
        ])  # fmt: skip


def _log(damage: np.ndarray) -> np.ndarray:
    return np.log1p(100.0 * np.maximum(damage, 0.0)) / 3.0


def _within(harm: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return the expected damage within some moves, (B, ...), interpolated between horizons, (B, horizons, ...)."""
    moves = np.minimum(moves, _WITHIN[-1])
    column = np.searchsorted(_WITHIN, moves)  # of the next horizon
    ends = np.append(_WITHIN, 0)
    share = (moves - ends[column - 1]) / (ends[column] - ends[column - 1])
    above = np.take_along_axis(harm, column[:, None] + 1, axis=1)[:, 0]
    below = np.take_along_axis(harm, np.maximum(column, 1)[:, None], axis=1)[:, 0] * (column > 0)
    return below + share * (above - below)
