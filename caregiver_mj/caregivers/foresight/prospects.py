"""What is to come in a house that has too many layouts of candles for values of each: known for single tables.

What a candle does on a table, from some moment on, does not depend on the other candles, nor on the caregiver; what
stairwells do depends on no more than the post that it is in. So all this is known for the cells of a child, moment by
moment, and `itineraries` puts it together for whatever the caregiver could do next.
"""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.child_model import novice_chain
from caregiver_mj.caregivers.foresight.detours import Detours
from caregiver_mj.caregivers.foresight.reckoning import SOUND, Reckoning
from caregiver_mj.caregivers.foresight.transit import single
from caregiver_mj.caregivers.foresight.travel import timesteps, travel
from caregiver_mj.caregivers.foresight.values import GUARDING, WAITS, has_values
from caregiver_mj.caregivers.pace import PAPER, Pace
from caregiver_mj.danger.passage import expected_hits
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan

LARGEST = 1.2e9  # bytes of tables that a house may need
# Moves ahead for which it is known; in between the nearest of them counts, and what is later is as at the last one.
MOMENTS = np.array([*range(16), *range(16, 32, 2), *range(32, 65, 4)])


def prospects(plan: FloorPlan, pace: Pace = PAPER, reckoning: Reckoning = SOUND) -> Prospects:
    """The prospects of a house at some pace of the caregiver; made once."""
    return _made(plan, pace, reckoning)


@functools.lru_cache(maxsize=2)
def _made(plan: FloorPlan, pace: Pace, reckoning: Reckoning) -> Prospects:
    return Prospects(plan, pace, reckoning.discount)


class Prospects:
    """Expected discounted damage to come for one child, of which cell, goal and epsilon are known, moment by moment.

    Attributes:
        ways: The caregiver's ways.
        detours: Its ways round a child.
        stairwells: How many stairwells there are.
        tables: How many tables there are.
        ahead: Damage from each moment on, (cells, moments, columns, G E), of: a candle on each table; stairwells if the
            caregiver is in each post, and goes from post to post as is best; the same if it never leaves that post;
            stairwells that stay open.
        staying: The first of these as `Values` has them, (moments, tables, cells, G E).
        at_large: Damage of stairwells that stay open, (cells, G E).
        nearest: Index of the moment that stands for so many moves.
        after_post: Moves of a child until the caregiver is in each post, with no child in its way, from each place:
            beside each table, where it has put a candle down, and in each post, (places, posts).
        after_get: Likewise until it has got the candle from each table, (places, tables).
        after_place: Likewise until it has put that down on another one, (places, tables, tables).
    """

    def __init__(self, plan: FloorPlan, pace: Pace, discount: float):
        chain = novice_chain(plan)
        self.ways, self.tables, self.stairwells = travel(plan, pace), len(plan.tables), len(plan.stairwells)
        self.detours = Detours(plan, self.ways)
        self._rows = chain.shape[0], chain.shape[1] * chain.shape[2]
        self._next = single(discount * chain.transition)
        stairs = slice(self.stairwells)
        forever = expected_hits(chain, discount).astype(np.float32)
        candles = (plan.damage.candle - plan.damage.table) * forever[:, self.stairwells :]
        fall, falls = (plan.damage.stairwell * hits[:, stairs].astype(np.float32) for hits in (chain.hits, forever))
        at_large = falls.sum(axis=1, keepdims=True)
        others = at_large - falls if self.stairwells else at_large
        self.ahead = self._moments(np.concatenate([candles, self._guard(fall, others), others, at_large], axis=1))
        self.staying = np.moveaxis(self.ahead[:, :, : self.tables], 0, 2)
        self.at_large = self.ahead[:, 0, -1]
        self.nearest = np.abs(MOMENTS[:, None] - np.arange(MOMENTS[-1] + 1)).argmin(axis=0)
        self._durations()

    def _guard(self, fall: np.ndarray, guard: np.ndarray) -> np.ndarray:
        """Damage of stairwells if the caregiver guards them for ever, from post to post, (states, posts).

        Args:
            fall: That of the next move by each stairwell if it is open, (states, stairwells).
            guard: All that is to come if it never leaves its post, (states, posts).
        """
        when = self.detours.between_posts
        at_large = fall.sum(axis=1)
        guarded = at_large[:, None] - fall if self.stairwells else at_large[:, None]
        longest, child = when.max(), np.arange(self._rows[0])
        so_far = [np.zeros_like(at_large)]  # damage of open stairwells
        for _ in range(longest):
            so_far.append(at_large + self._next @ so_far[-1])
        exposed = np.stack(so_far)[..., None].reshape(longest + 1, 1, *self._rows)
        for _ in range(GUARDING):
            later = [guard]
            for _ in range(longest):
                later.append(self._next @ later[-1])
            arrival = exposed + np.stack(later).swapaxes(1, 2).reshape(longest + 1, -1, *self._rows)
            post = np.arange(arrival.shape[1])
            leave = [arrival[when[:, here], post, child[:, None]].min(axis=1).ravel() for here in post]
            for _ in range(WAITS):
                guard = guarded + self._next @ np.minimum(guard, np.stack(leave, axis=1))
        return guard

    def _moments(self, now: np.ndarray) -> np.ndarray:
        """Damage to come (states, columns) as (cells, moments, columns, G E)."""
        cells, states = self._rows
        ahead = np.empty((cells, len(MOMENTS), now.shape[1], states), np.float32)
        for moves in range(MOMENTS[-1] + 1):
            for moment in np.flatnonzero(moves == MOMENTS):
                ahead[:, moment] = now.reshape(cells, states, -1).swapaxes(1, 2)
            now = self._next @ now
        return ahead

    def _durations(self) -> None:
        ways, posts = self.ways, len(self.ways.posts)
        cell = np.array([*ways.central, *ways.posts], int)
        pace = ways.pace
        left = np.repeat([0.0, pace.cells], [self.tables, posts])[:, None]
        self.after_post = timesteps(ways.open_way[:posts, cell].T, left, pace)
        get = ways.to_table[cell] + pace.get
        self.after_get = timesteps(get, left, pace)
        self.after_place = timesteps(get[..., None] + ways.onward[cell] + pace.place, left[..., None], pace)


def check_size(plan: FloorPlan) -> None:
    """Raises CaregiverError if a house has neither values of all layouts nor, by its size, prospects."""
    if has_values(plan):
        return
    states = novice_chain(plan).size
    free, cells, tables, posts = (
        len(each) for each in (plan.free_cells, plan.caregiver_cells, plan.tables, plan.stairwells or [None])
    )
    ahead = states * len(MOMENTS) * (tables + 2 * posts + 1) * 4
    needed = ahead + 2 * cells * (free * (tables + posts) + tables**2)
    if needed > LARGEST:
        raise CaregiverError(
            f"floor plan '{plan.name}' is too large for a caregiver with foresight: with {free} free cells, "
            f"{len(plan.bins)} toy bins, {tables} tables and {len(plan.stairwells)} stairwells its tables would take "
            f"{needed / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f}"
        )
