"""What the caregiver can do now, and what is to be expected of it."""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.departure import Departure
from caregiver_mj.caregivers.foresight.values import Values
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.plans.hazards import NOTHING


class Options:
    """Everything that can be done in W worlds in which all candles are on tables: every post, every relocation.

    Those are first the posts, then for every candle (in the order of hazards) every bare table (in that of tables).
    """

    def __init__(self, values: Values, percept: Percept, worlds: np.ndarray, belief: np.ndarray, left: int):
        """Works them out.

        Args:
            values: What is to come in the house.
            percept: What is seen.
            worlds: Indices of the worlds, (W,).
            belief: Probability of every goal and epsilon of each child, (W, K, G, E).
            left: Actions that the caregiver has left in this timestep.
        """
        self._values = values
        self._child = percept.child_cell[worlds]
        self._belief = belief.reshape(*belief.shape[:2], -1).astype(np.float32)
        self._tables = percept.candle_table[worlds]  # (W, candles)
        count = len(self._tables)
        bare = bare_tables(self._tables, values.layouts.bears.shape[1])
        self._bare = np.nonzero(bare)[1].reshape(count, -1)  # (W, bare tables)
        self._layout = values.layouts.of(self._tables)
        self._cell, self._left = percept.caregiver_cell[worlds], left
        self._out_of_reach = None if percept.out_of_reach is None else percept.out_of_reach[worlds]

    @functools.cached_property
    def damage(self) -> np.ndarray:
        """Expected damage to come of each option, less that of candles that stay and guarded stairs, (W, options)."""
        values, count = self._values, len(self._layout)
        after = values.layouts.after[
            self._layout[:, None, None], self._tables[:, :, None], self._bare[:, None, :]
        ]  # (W, candles, bare tables)
        relocated = values.table_column[after, self._bare[:, None, :]].reshape(count, -1)
        column = np.concatenate([values.post_column[self._layout], relocated], axis=1)
        return sum(
            self._of_child(child, belief, column)
            for child, belief in zip(self._child.T, np.moveaxis(self._belief, 1, 0), strict=True)
        )

    def _of_child(self, child: np.ndarray, belief: np.ndarray, column: np.ndarray) -> np.ndarray:
        values, each = self._values, np.arange(len(child))
        departure = Departure(values.ways, values.transit, child, self._cell, self._left)
        posts = values.post_column.shape[1]
        guarded = values.guards(departure, values.arrival, column[:, :posts].T, child)  # (posts, W, G E)
        longest = len(values.staying) - 1
        tables, bare = self._tables.T, self._bare.T
        when = np.minimum(departure.to_place[tables[:, None], bare[None], each], longest)
        placed = values.arrival[when.reshape(-1, len(child)), column[:, posts:].T, child]
        got = values.staying[np.minimum(departure.to_get[tables, each], longest), tables, child]
        saved = np.repeat(np.einsum("cwg,wg->wc", got, belief), len(bare), axis=1)
        damage = [np.einsum("owg,wg->wo", value, belief) for value in (guarded, placed)]
        return np.concatenate([damage[0], damage[1] - saved], axis=1)

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
        posts, candles = self._values.post_column.shape[1], self._tables.shape[1]
        stairwells = self._values.stairwells
        about = np.arange(posts) if stairwells else np.full(posts, NOTHING)
        return np.concatenate([about, np.repeat(stairwells + np.arange(candles), self._bare.shape[1])])

    def best(self, begun: np.ndarray, hysteresis: float) -> tuple[np.ndarray, np.ndarray]:
        """What to do.

        Args:
            begun: The hazard that the caregiver is about, or NOTHING, (W,).
            hysteresis: By what share of the damage of inaction something else must be better.

        Returns:
            The hazard, and the table to which it goes if it is a candle, else NOTHING: (W,) each.
        """
        goes_on = (self.hazards == begun[:, None]) & (begun[:, None] != NOTHING)
        damage = self.damage - np.where(goes_on, hysteresis * self.inaction[:, None], 0.0)
        if self._out_of_reach is not None:
            barred = (self.hazards != NOTHING) & self._out_of_reach[:, self.hazards]
            damage = np.where(barred, np.inf, damage)
        option = damage.argmin(axis=1)
        posts = self._values.post_column.shape[1]
        if not self._bare.size:
            return self.hazards[option], np.full(len(option), NOTHING)
        table = self._bare[np.arange(len(option)), (option - posts) % self._bare.shape[1]]
        return self.hazards[option], np.where(option >= posts, table, NOTHING)
