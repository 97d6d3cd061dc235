"""What the caregiver can do now, and what is to be expected of it."""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.departure import Departure
from caregiver_mj.caregivers.foresight.prospects import Prospects
from caregiver_mj.caregivers.foresight.values import Values
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.plans.hazards import NOTHING


class Options:
    """Everything that can be done in W worlds in which all candles are on tables: every post, every relocation.

    Those are first the posts, then for every candle (in the order of hazards) every bare table (in that of tables).
    """

    def __init__(
        self,
        values: Values | Prospects,
        percept: Percept,
        worlds: np.ndarray,
        belief: np.ndarray,
        left: np.ndarray | float,
    ):
        """Works them out.

        Args:
            values: What is to come in the house; an `Prospects` for `Itineraries`.
            percept: What is seen.
            worlds: Indices of the worlds, (W,).
            belief: Probability of every goal and epsilon of each child, (W, K, G, E).
            left: Share of a timestep until the children's next moves, (W,) or for all.
        """
        self._values = values
        self._child = percept.child_cell[worlds]
        self._belief = belief.reshape(*belief.shape[:2], -1).astype(np.float32)
        self._tables = percept.candle_table[worlds]  # (W, candles)
        count = len(self._tables)
        bare = bare_tables(self._tables, values.staying.shape[1])
        self._bare = np.nonzero(bare)[1].reshape(count, -1)  # (W, bare tables)
        self._cell, self._left = percept.caregiver_cell[worlds], left * values.ways.pace.cells
        self._out_of_reach = None if percept.out_of_reach is None else percept.out_of_reach[worlds]

    @functools.cached_property
    def damage(self) -> np.ndarray:
        """Expected damage to come of each option, less that of candles that stay and guarded stairs, (W, options)."""
        assert isinstance(self._values, Values)  # as it is but for `Itineraries`
        layouts = self._values.layouts
        now, later = layouts.now(self._tables), layouts.later(self._tables, self._bare)
        damage = sum(
            self._of_child(self._values, child, belief, now, later)
            for child, belief in zip(self._child.T, np.moveaxis(self._belief, 1, 0), strict=True)
        )
        return np.asarray(damage)

    def _of_child(
        self, values: Values, child: np.ndarray, belief: np.ndarray, now: np.ndarray, later: np.ndarray
    ) -> np.ndarray:
        each = np.arange(len(child))
        departure = Departure(values.ways, values.transit, child, self._cell, self._left)
        guarded = values.guards(departure, values.arrival, values.post_column[now].T, child)  # (posts, W, G E)
        damage = np.einsum("pwg,wg->wp", guarded, belief)
        if not self._bare.size or not self._tables.size:
            return damage
        tables, bare = self._tables.T, self._bare.T
        longest = len(values.staying) - 1
        when = np.minimum(departure.to_place[tables[:, None], bare[None], each], longest)
        column = np.moveaxis(values.table_column[later, self._bare[:, None, :]], 0, 2)
        placed = np.einsum("cbwg,wg->wcb", values.arrival[when, column, child], belief)
        got = values.staying[np.minimum(departure.to_get[tables, each], longest), tables, child]
        placed -= np.einsum("cwg,wg->wc", got, belief)[..., None]
        of_goal = belief.reshape(len(child), departure.denied.shape[-1], -1).sum(axis=2)
        placed += np.einsum("cwg,wg->wc", departure.denied[tables, each], of_goal)[..., None]
        return np.concatenate([damage, placed.reshape(len(child), -1)], axis=1)

    @functools.cached_property
    def candles(self) -> np.ndarray:
        """Expected damage to come of candles that stay where they are, (W,)."""
        staying = self._values.staying[0]
        each = staying[self._tables[:, None], self._child[..., None]].sum(axis=2)  # (W, K, G E)
        return (each * self._belief).sum(axis=(1, 2))

    @functools.cached_property
    def inaction(self) -> np.ndarray:
        """Expected damage to come if nothing is done, (W,)."""
        return self.candles + (self._values.at_large[self._child] * self._belief).sum(axis=(1, 2))

    @functools.cached_property
    def hazards(self) -> np.ndarray:
        """Number of the hazard that each option is about, (options,); NOTHING for a post that is no stairwell."""
        posts, candles = len(self._values.ways.posts), self._tables.shape[1]
        stairwells = self._values.stairwells
        about = np.arange(posts) if stairwells else np.full(posts, NOTHING)
        return np.concatenate([about, np.repeat(stairwells + np.arange(candles), self._bare.shape[1])])

    def best(
        self, begun: np.ndarray, hysteresis: float, tables: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """What to do.

        Args:
            begun: The hazard that the caregiver is about, or NOTHING, (W,).
            hysteresis: By what share of the damage of inaction something else must be better.
            tables: The only table to which each candle may go, (W, candles), if there is no choice.

        Returns:
            The hazard, and the table to which it goes if it is a candle, else NOTHING: (W,) each.
        """
        goes_on = (self.hazards == begun[:, None]) & (begun[:, None] != NOTHING)
        damage = self.damage - np.where(goes_on, hysteresis * self.inaction[:, None], 0.0)
        if self._out_of_reach is not None:
            barred = (self.hazards != NOTHING) & self._out_of_reach[:, self.hazards]
            damage = np.where(barred, np.inf, damage)
        if tables is not None:
            candles, bare = tables.shape[1], self._bare.shape[1]
            other = np.tile(self._bare, candles) != np.repeat(tables, bare, axis=1)
            damage[:, damage.shape[1] - other.shape[1] :][other] = np.inf
        option = damage.argmin(axis=1)
        each = np.arange(len(option))
        hazard = np.where(np.isinf(damage[each, option]), NOTHING, self.hazards[option])
        posts = len(self._values.ways.posts)
        if not self._bare.size:
            return hazard, np.full(len(option), NOTHING)
        table = self._bare[each, (option - posts) % self._bare.shape[1]]
        return hazard, np.where((option >= posts) & (hazard != NOTHING), table, NOTHING)
