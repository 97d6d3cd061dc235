"""The limit: a caregiver that knows every move which the children will make."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.hindsight import ACTIONS, EFFORT, MOVES, Hindsight, round_the_child
from caregiver_mj.caregivers.foresight.layouts import count_stands
from caregiver_mj.caregivers.foresight.travel import travel
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.caregivers.told import Future, ToldCaregiver, Truth
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

LARGEST = 5_000  # stands of a house: as many fit into memory
_SPAN = 60  # moves for which a plan holds; then it is made anew
_CHUNK = 20_000_000  # numbers of plans that are made at once
_GOES_ON = 1e-3  # damage by which something else must be better than what it is about


class ClairvoyantCaregiver(ToldCaregiver, Caregiver):
    """Does what is best of all, knowing what comes; where its being in the way has changed that, it plans anew.

    Of several children it goes round the first only.

    Raises:
        CaregiverError: The house has too many layouts of candles; or, later, the world cannot tell the future.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        if count_stands(plan) > LARGEST:  # before any of them is made
            raise CaregiverError(
                f"floor plan '{plan.name}' has too many layouts of candles for 'clairvoyant': with {len(plan.tables)} "
                f"tables, {len(plan.candle_tables)} candles and {len(plan.stairwells)} stairwells it would have to "
                f"know more than {LARGEST:,} stands"
            )
        self._ways, self._programme = travel(plan), _programme(plan)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self._begun = np.full(batch, NOTHING)
        self._now = -1  # number of the children's next move
        self._cells: np.ndarray | None = None  # of the children after every move
        self._since = np.full(batch, NOTHING)  # that for which the plan of each world was made

    def watch(self, percept: Percept) -> None:
        self._child = percept.child_cell
        self._now += 1

    def hear(self, truth: Truth) -> None:
        if truth.future is None:
            raise CaregiverError("'clairvoyant' has to know what will come, which nobody does in this world")
        if self._cells is None:
            stale = np.ones(len(self._begun), bool)
        else:
            stale = (self._child != self._cells[self._now - 1]).any(axis=1) | (self._now - self._since >= _SPAN)
        if stale.any() and (self._cells is None or self._now < len(self._cells)):
            self._foresee(truth.future(), np.flatnonzero(stale))

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        answer = Interventions.idle(len(percept.caregiver_cell))
        answer.verb[:] = self.idle_verb
        free = np.flatnonzero((percept.candle_table != NOTHING).all(axis=1) & (percept.holding == NOTHING))
        if free.size and len(self.plan.hazards):
            hazard, destination = self._best(percept, free)
            is_stairwell, is_candle = self.plan.hazards.is_stairwell(hazard), self.plan.hazards.is_candle(hazard)
            answer.verb[free] = np.where(is_stairwell, BLOCK, np.where(is_candle, RELOCATE, self.idle_verb))
            answer.hazard[free], answer.destination[free] = hazard, destination
            self._begun[free] = hazard
        return answer

    # -- What comes ------------------------------------------------------------------------------

    def _foresee(self, future: Future, worlds: np.ndarray) -> None:
        """Plans anew for some worlds."""
        length, batch, children = future.cell.shape
        if self._cells is None:
            tables, keep = len(self.plan.tables), _SPAN + MOVES + self._ways.longest + 1
            self._cells = np.zeros((length, batch, children), int)
            self._falls, self._harm = np.zeros((length + 1, batch)), np.zeros((length + 1, tables, batch))
            carried = length + 1, tables, tables, batch
            self._carry, self._denied = np.zeros(carried, np.int8), np.zeros(carried, np.float32)
            self._value = np.zeros((keep, self._programme.stands, batch), np.float32)
        self._cells[self._now :, worlds] = future.cell[:, worlds]
        bumps = np.moveaxis(future.object[:, worlds], 1, 2)
        self._falls[self._now :, worlds], self._harm[self._now :, :, worlds] = self._programme.costs(bumps)
        before = np.concatenate([self._child[None, worlds, 0], future.cell[:, worlds, 0]])
        at_once = max(1, _CHUNK // (self._programme.stands * (length + 1)))
        for first in range(0, len(worlds), at_once):
            some = slice(first, first + at_once)
            which, carrying = worlds[some], self._programme.carrying(before[:, some])
            self._carry[self._now :, ..., which], self._denied[self._now :, ..., which] = carrying
            value = self._programme.to_come(before[:, some], bumps[:, :, some], carrying, len(self._value))
            self._value[: len(value), :, which] = value
            self._value[len(value) :, :, which] = 0.0
        self._since[worlds] = self._now

    # -- What to do about it ---------------------------------------------------------------------

    def _best(self, percept: Percept, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The hazard, and the table to which it goes if it is a candle, (W,) each; see `Options`, which is alike."""
        if self._cells is None:
            raise CaregiverError("'clairvoyant' has not been told what will come")
        programme, plan, each = self._programme, self.plan, np.arange(len(worlds))
        tables, posts = percept.candle_table[worlds], programme.post_stand.shape[1]
        bare = np.nonzero(bare_tables(tables, len(plan.tables)))[1].reshape(len(worlds), -1)
        layout = programme.layouts.now(tables)
        ahead = np.concatenate([percept.child_cell[None, worlds, 0], self._cells[self._now :, worlds, 0]])
        here = percept.caregiver_cell[None, worlds]
        assert percept.time_left is not None  # a world that tells the future tells the time
        left = round(float(percept.time_left[0]) * ACTIONS)  # the same in all worlds
        moves, denied = (found[:, 0] for found in round_the_child(self._ways, ahead, here, left))
        to_post, to_get = moves[:posts], moves[posts:]
        last, now = len(self._falls) - 1, self._now
        falls = self._falls[:, worlds] - self._falls[now, worlds]

        def value(when: np.ndarray, stand: np.ndarray) -> np.ndarray:
            return falls[when, each] + self._value[when - self._since[worlds], stand, worlds]

        damage = value(np.minimum(now + to_post, last), programme.post_stand[layout].T) + denied[:posts]
        hazard = np.arange(posts) if plan.stairwells else np.full(posts, NOTHING)
        if bare.size and tables.size:
            source, target = tables.T[:, None], bare.T[None]  # (candles, 1, W), (1, bare tables, W)
            got = np.minimum(now + to_get[source, each], last)
            placed = np.minimum(got + self._carry[got, source, target, worlds], last)
            after = programme.layouts.after[layout, source, target]
            carried = value(placed, programme.table_stand[after, target]) + denied[posts:][source, each]
            carried += self._denied[got, source, target, worlds] + EFFORT
            carried += self._harm[placed, target, worlds] - self._harm[got, source, worlds]
            damage = np.concatenate([damage, carried.reshape(-1, len(worlds))])
            candles = plan.hazards.of_candle(np.arange(tables.shape[1]))
            hazard = np.concatenate([hazard, np.repeat(candles, bare.shape[1])])
        goes_on = (hazard[:, None] == self._begun[worlds]) & (hazard[:, None] != NOTHING)
        option = (damage - np.where(goes_on, _GOES_ON, 0.0)).argmin(axis=0)
        if not bare.size:
            return hazard[option], np.full(len(worlds), NOTHING)
        table = bare[each, (option - posts) % bare.shape[1]]
        return hazard[option], np.where(option >= posts, table, NOTHING)


@functools.lru_cache(maxsize=2)
def _programme(plan: FloorPlan) -> Hindsight:
    return Hindsight(plan)
