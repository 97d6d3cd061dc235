r"""The learned caregiver: a small network says what is best to do, which has learned it from `foresight`.

    PYTHONPATH=examples caregiver-mj evaluate --world grid --house house-20 --epsilon .5 --episodes 5 \
        --caregiver none expected-danger learned_caregiver:LearnedCaregiver

`scripts/train.py` trains it; here it runs on NumPy alone, with the weights in `learned.npz`. Every option (an opening,
a candle and a table for it, a thing on the floor, to stand aside, to stay) has features: what is to be expected of its
hazard, and of the others meanwhile, by the belief of `foresight`; how long the robot takes; in which children's way it
will stand. One network scores each option, knowing what the others are on an average, so that it serves houses with any
number of hazards.
"""

from __future__ import annotations

import functools
import pathlib
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.child_model import Followers, child_chain
from caregiver_mj.caregivers.foresight.foresight import each_on_a_table
from caregiver_mj.caregivers.foresight.motion import motion
from caregiver_mj.caregivers.foresight.value_table import OBJECTIVE
from caregiver_mj.caregivers.percept import Outlook, Percept, bare_tables
from caregiver_mj.danger.chain import discounted_entry, expected_hits, first_entry, first_passage
from caregiver_mj.interventions.verb import DO_NOTHING, STAND_ASIDE, Interventions
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, TABLE, Where

_WITHIN = np.array([1, 2, 3, 5, 8, 12, 20, 30])  # timesteps within which a child may come to harm
_SHOWN = [0, 1, 3, 5]  # of what is to be expected, features of their own: at all, and within 1, 3 and 8 timesteps
_NEXT = (3, 8)  # moves of a child, for which the caregiver is thought to stand where it then is
_LARGEST = 2e7  # numbers for each of these
Weights = dict[str, np.ndarray]


@functools.cache
def shipped() -> Weights:
    """Return the weights beside this file, read once."""
    with np.load(pathlib.Path(__file__).with_name("learned.npz")) as file:
        return {name: value.astype(float) for name, value in file.items()}


def layers(net: Weights, rows: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return what the network makes of options: its layers, and the score of each, (N,).

    The rows are the features of the options, (N, features), of B worlds one after the other, so many (B,) of each.
    """
    first = np.cumsum(counts) - counts
    x = np.clip((rows - net["mean"]) / net["spread"], -6.0, 6.0)
    one = np.maximum(x @ net["w1"] + net["b1"], 0.0)
    around = np.add.reduceat(one, first) / counts[:, None].astype(one.dtype)
    two = np.maximum(one @ net["w2"] + (around @ net["u2"]).repeat(counts, axis=0) + net["b2"], 0.0)
    return x, one, around, two, two @ net["w3"]


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


@functools.lru_cache(maxsize=2)
def _standing(plan: FloorPlan) -> np.ndarray:
    """Return the expected bumps into each place within each of `_NEXT` moves, if the caregiver stands in a cell.

    It is (caregiver cells, cells, horizons, bins, epsilons and places), for novices that keep their bin. A house
    that is too large for that has one caregiver cell, from which it keeps nobody from anything.
    """
    chain, places, bins = child_chain(plan), len(plan.stairwells) + len(plan.tables), len(plan.bins)
    cells, every = np.arange(len(plan.free_cells)), np.arange(len(plan.caregiver_cells))
    moves = chain.moves[:, :bins].reshape(len(cells), -1, 4).astype(np.float32)
    if len(every) * moves[..., 0].size * (places + len(plan.floor_cells)) > _LARGEST:
        every = np.array([NOTHING])
    then, lying = chain.next_cell, np.array(plan.floor_cells, int)
    met = np.concatenate(
        [
            chain.object_at[..., None] == np.arange(places),
            (then[..., None] == lying) & (then != cells[:, None])[..., None],
        ],
        axis=2,
    )
    posts = np.array([plan.cell_index[post] for post in plan.posts], int)[: len(plan.stairwells)]
    found, kept = np.zeros((len(every), *moves.shape[:2], met.shape[2]), np.float32), []
    hits = np.einsum("cja,cap->cjp", moves, met.astype(np.float32))[None].repeat(len(every), axis=0)
    for opening, post in enumerate(posts):
        hits[every == post, :, :, opening] = 0.0
    there = np.where(then == every[:, None, None], cells[:, None], then)
    for move in range(1, _NEXT[-1] + 1):
        after = hits.copy()
        for action in range(4):
            after += moves[..., action, None] * found[np.arange(len(every))[:, None], there[..., action]]
        found = after
        if move in _NEXT:
            kept.append(found)
    return np.stack([one.reshape(*one.shape[:2], -1) for one in kept], axis=2)


class LearnedCaregiver(Caregiver):
    """Does what a network scores highest.

    Attributes:
        net: Its weights; those of `shipped`, if left out.
        hazard: The hazard of each option, NOTHING for the last two: to stand aside, and to stay.
        table: The table that each option takes a candle to, or NOTHING.
        of: The row of `kind` of each option: that of its hazard, or one of the last two.
        kind: What is so of a hazard always, and of idling, (hazards + 2, 7).
        more: Damage of each hazard, for one on a table that beyond the bare table's.
        apart: Steps between the caregiver's cells.
        followers: What it believes of the children, too.
    """

    net: Weights | None = None
    followers: Followers

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        hazards, openings, tables = plan.hazards, len(plan.stairwells), len(plan.tables)
        candles, each = len(plan.candle_tables), np.arange(len(hazards))
        pairs = np.arange(candles * tables)
        self.hazard = np.append(
            np.insert(
                np.delete(each, range(openings, openings + candles)), openings, openings + pairs // max(1, tables)
            ),
            [NOTHING, NOTHING],
        )
        self.table = np.full(len(self.hazard), NOTHING)
        self.table[openings : openings + len(pairs)] = pairs % max(1, tables)
        on_table = hazards.are_at(Where.ON_TABLE, each)
        self.more = hazards.damage - hazards.weights[TABLE.name] * on_table  # than the bare table does
        gate = (each >= len(plan.landings)) & (each < openings)
        kinds = [
            hazards.are_at(Where.OPENING, each),
            on_table,
            hazards.are_at(Where.FLOOR, each),
            gate,
            self.more / 5.0,
        ]
        self.kind = np.zeros((len(hazards) + 2, 7))  # of what each option has to do with: the last two are to idle
        self.kind[:-2, :5], self.kind[-2:, 5:] = np.stack(kinds, axis=1), np.eye(2)
        self.of = np.append(self.hazard[:-2], [len(hazards), len(hazards) + 1])
        self.apart = plan.graph.distances_from(range(len(plan.caregiver_cells))).astype(float)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.followers = Followers(self.plan, batch, children)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        features, there = self.features(percept)
        score = np.full(there.shape, -np.inf)
        # Rounded, for sums may come out otherwise in another batch.
        score[there] = layers(self.net or shipped(), features[there], there.sum(axis=1))[-1].round(9)
        return self.take(score.argmax(axis=1))

    def take(self, option: np.ndarray) -> Interventions:
        """Return the interventions of options, (B,)."""
        hazard = self.hazard[option]
        idle = np.where(option == len(self.hazard) - 1, DO_NOTHING, STAND_ASIDE)
        verb = np.append(self.plan.hazards.verb, "")[hazard]
        return Interventions(np.where(hazard == NOTHING, idle, verb), hazard, self.table[option])

    def features(self, percept: Percept) -> tuple[np.ndarray, np.ndarray]:
        """Return what the network goes by, (B, options, features), and which options there are, bool (B, options)."""
        look = _Look(self, each_on_a_table(self.plan, percept))
        blocks, own = look.blocks(), look.own()
        kind = np.broadcast_to(self.kind, (len(blocks), *self.kind.shape))
        of_kind = np.concatenate([kind, blocks], axis=2)[:, self.of]
        return np.concatenate([of_kind, *own, look.others(), look.later, look.world()], axis=2), look.there


class _Look:
    """What the features are made of: B worlds, as they are seen now."""

    def __init__(self, caregiver: LearnedCaregiver, percept: Percept):
        self.by, self.percept, plan = caregiver, percept, caregiver.plan
        hazards, self.openings, tables = plan.hazards, len(plan.stairwells), len(plan.tables)
        self.hazards, self.ways, self.pair = hazards, motion(plan, caregiver.pace), caregiver.table != NOTHING
        self.table, self.cell, self.child = percept.candle_table, percept.caregiver_cell, percept.child_cell
        batch = len(self.cell)
        self.every = np.arange(batch)[:, None]
        self.left = np.ones(batch) if percept.time_left is None else percept.time_left
        self.about = np.full(batch, NOTHING) if percept.under_way is None else percept.under_way

        # What is to be expected of each place, and of the hazard that is there.
        self.belief = caregiver.followers.belief
        joint = None if percept.belief is None else percept.belief.joint
        self.outlook = Outlook(child_chain(plan), self.child, self.belief.probability, joint)
        expected = self.outlook.expected(_prospects(plan)).sum(axis=1).reshape(batch, 1 + len(_WITHIN), -1)
        self.expected, self.bumps = expected, expected[:, :, self.openings : self.openings + tables]
        place = np.broadcast_to(np.arange(expected.shape[2]), (batch, expected.shape[2]))
        beyond = place[:, self.openings + tables :]
        self.place = hazards.join(place[:, : self.openings], self.openings + self.table, beyond)
        shut = np.zeros((batch, self.openings), bool) if percept.shut is None else percept.shut
        gone = np.zeros(beyond.shape, bool) if percept.gone is None else percept.gone
        alive = hazards.join(~shut, self.table != NOTHING, ~gone)
        self.now = np.take_along_axis(expected, self.place[:, None], axis=2) * caregiver.more * alive[:, None]
        self.before = self.gain = self.of_option(self.now)
        self.bare = bare_tables(self.table, tables)
        self.weight = np.zeros(expected.shape[::2])  # damage in each place
        self.weight[:, self.openings : self.openings + tables] = hazards.weights[TABLE.name]
        np.add.at(self.weight, (self.every, self.place), caregiver.more * alive)
        there = alive & ~caregiver.followers.there[:, None]
        if percept.out_of_reach is not None:
            there &= ~percept.out_of_reach
        self.there = self.of_option(there)
        self.there[:, -2:] = True
        if tables:
            then = self.bumps[:, :, caregiver.table] * self.of_option(caregiver.more)
            self.gain = self.before - np.where(self.pair, then, 0.0)
            self.there &= ~self.pair | (self.bare[:, caregiver.table] & (self.gain[:, 0] > 1e-9))
        self._time()

    def of_option(self, values: np.ndarray) -> np.ndarray:
        """Return values of hazards, (..., hazards), as those of options; 0 for the last two."""
        return np.concatenate([values, np.zeros((*values.shape[:-1], 2), values.dtype)], axis=-1)[..., self.by.of]

    def _time(self) -> None:
        """Find how long it takes to get there, and to be done; where it will be at the next move, and in the end."""
        ways, pace, cell = self.ways, self.by.pace, self.cell[:, None]
        self.near = self.by.apart[cell, self.child]
        self.nearest = self.child[self.every[:, 0], self.near.argmin(axis=1)][:, None]
        way = ways.distance[self.place, self.nearest, cell].astype(float)
        self.barred = way == UNREACHABLE
        self.way = self.of_option(np.where(self.barred, ways.open_distance[self.place, cell] + 6.0, way))
        spot = np.concatenate([self.place, np.tile([ways.aside, ways.aside + 1], (len(cell), 1))], axis=1)
        steps = np.clip(np.rint(self.left * pace.cells), 0, len(ways.after) - 1).astype(int)
        self.to = ways.after[steps[:, None], spot, self.nearest, cell].astype(int)
        end, carry = self.of_option(ways.end[self.place, cell].astype(int)), np.zeros(self.way.shape)
        if self.bare.size:
            carried = self.openings + self.by.table
            carry = np.where(self.pair, ways.open_distance[carried, end] + pace.get + pace.place, 0.0)
            end = np.where(self.pair, ways.end[carried, end], end)
        end[:, -2:] = self.to[:, -2:]
        self.end, left = end, self.left[:, None]
        self.soon = np.maximum(self.way / pace.cells - left, 0.0)
        self.done = np.maximum((self.way + carry) / pace.cells - left, 0.0)

    def others(self) -> np.ndarray:
        """Return what the other hazards may do until it could get to them after that, (B, options, 4)."""
        onwards = self.ways.open_distance[self.place[:, None], self.end[..., None]] / self.by.pace.cells
        harm = _within(self.now[:, :, None], onwards + self.done[..., None])
        harm = np.where(self.by.hazard[:, None] == np.arange(len(self.hazards)), 0.0, harm)
        worst = (harm - self.now[:, None, 1]).max(axis=2, initial=0.0)
        return np.stack([*(part.sum(axis=2) for part in self.hazards.split(harm)), worst], axis=2)

    def blocks(self) -> np.ndarray:
        """Return from what it keeps the children where it will be at their next move, (B, hazards + 2, 14).

        `later` is then what it would keep them from where it ends, (B, options, horizons).
        """
        plan, ways, to, openings, child = self.by.plan, self.ways, self.to, self.openings, self.child
        harm, free = (self.expected * self.weight[:, None])[:, _SHOWN], len(plan.free_cells)
        places = np.arange(self.weight.shape[1])
        clear = ways.open_distance[places, self.nearest][:, None].astype(float)
        round_it = ways.distance[places, np.minimum(to, free - 1)[..., None], self.nearest[..., None]].astype(float)
        round_it = np.where((to >= free)[..., None], clear, round_it)
        sealed = round_it == UNREACHABLE
        sealed[..., :openings] |= to[..., None] == np.array(ways.posts[:openings], int)
        detour = np.where(sealed, 1.0, np.minimum(round_it - clear, 6.0) / 6.0)
        kept = [np.einsum("btp,bop->bot", harm, share) for share in (sealed.astype(float), detour)]
        moves = np.einsum("bkge,bkgea->bka", self.belief.probability, self.outlook.chain.moves[child])
        then = self.outlook.chain.next_cell[child]
        meets = (then[:, None] == to[..., None, None]) & (then != child[..., None])[:, None]
        meets = (moves[:, None] * meets).sum(axis=(2, 3))
        beside = np.minimum(self.by.apart[to[..., None], child[:, None]].min(axis=2), 10.0)
        left = self._left(np.arange(len(to)).repeat(to.shape[1]), to.ravel()).reshape(*to.shape, -1)
        world, option = np.nonzero(self.there)
        self.later = np.zeros((*self.there.shape, len(_NEXT)))
        self.later[world, option] = left[world, -1] - self._left(world, self.end[world, option])
        return np.concatenate([*kept, meets[..., None], beside[..., None] / 5.0, left[:, [-1]] - left, left], axis=2)

    def _left(self, world: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return the damage to come, (N, horizons), if the caregiver stands in a cell, in a world, (N,) each."""
        plan = self.by.plan
        stand, novice = _standing(plan), self.belief.probability[:, :, : len(plan.bins)]
        cell, left = cell * (len(stand) > 1), np.zeros((len(cell), len(_NEXT)))
        for number, wants in enumerate(np.moveaxis(novice.reshape(*self.child.shape, -1), 1, 0)):
            what = (wants[:, :, None] * self.weight[:, None]).reshape(len(wants), -1).astype(np.float32)
            left += np.einsum("nhk,nk->nh", stand[cell, self.child[world, number]], what[world])
        return left

    def own(self) -> list[np.ndarray]:
        """Return what is so of each option, arrays (B, options, features)."""
        best, gain, of = np.zeros((len(self.cell), len(self.hazards) + 2)), self.gain[:, 0], self.by.of
        np.maximum.at(best, (self.every, of), np.where(self.there, gain, 0.0))
        self.most = best.max(axis=1, keepdims=True)
        far, away = self.by.hazard_distances(self.percept).min(axis=1), np.zeros(gain.shape)
        far = self.of_option(np.minimum(far, 20.0))
        if self.bare.size:
            table = np.minimum(self.by.table_distances[self.child].min(axis=1), 20.0)
            away = np.where(self.pair, table[:, self.by.table], 0.0)
        about = (self.by.hazard == self.about[:, None]) & (self.by.hazard != NOTHING)
        first = (far - self.way / self.by.pace.cells).clip(-10, 10) / 5
        values = [
            gain / np.maximum(self.most, 1e-6), best[:, of] - gain, _within(self.before, self.soon),
            _within(self.before, self.done), self.soon / 5, self.done / 5, self.way == 0, self.way <= 1,
            self.of_option(self.barred), far / 5, away / 5, first, about,
        ]  # fmt: skip
        shown = (np.moveaxis(values[:, _SHOWN], 1, 2) for values in (self.before, self.gain))
        return [np.stack(values, axis=2), *shown]

    def world(self) -> np.ndarray:
        """Return what is so of the world, for each option, (B, options, features)."""
        posts = np.array(self.ways.posts[: self.openings], int)
        guarded = (self.now[..., : self.openings] * (self.cell[:, None] == posts)[:, None]).sum(axis=2)
        sums = [*(part.sum(axis=2) for part in self.hazards.split(self.now)), guarded, self.bumps.sum(axis=2)]
        counts = [part.sum(axis=1) for part in self.hazards.split(self.now[:, 0] > 0)]
        children, near = np.full(len(self.cell), self.child.shape[1]), np.minimum(self.near.min(axis=1), 15.0) / 5
        values = [self.outlook.epsilon.mean(axis=1), *counts, self.left, near, children, self.about == NOTHING]
        values += [self.bare.sum(axis=1), self.most]
        world = np.column_stack([*(harm[:, _SHOWN] for harm in sums), *values])
        return np.broadcast_to(world[:, None], (*self.there.shape, world.shape[1]))


def _within(harm: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return what is to be expected within some moves, (B, ...), by that within each horizon, (B, horizons, ...)."""
    column = np.searchsorted(_WITHIN, np.ceil(moves)).clip(max=len(_WITHIN) - 1) + 1
    return np.take_along_axis(harm, column[:, None], axis=1)[:, 0] * (moves > 0)
