"""The candles of the house: which of them stand, and on which tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.house.physics import Physics
from caregiver_mj.plans import layout

_STANDING_COSINE = math.cos(math.radians(30))  # of a candle's tilt, beyond which it counts as fallen
_BELOW = 0.05  # metres below the top of a table from which on a candle counts as fallen down
_ABOVE = 0.03  # metres above or below the top of a table up to which a candle is on it


class Candles:
    """Looks after the candles of one episode.

    Attributes:
        table_rectangles: Where the tables really are, (tables, 4), metres; see `plans.layout`.
        table_heights: How high their tops are, (tables,), metres.
        starting_tables: Index of the table on which each candle stood when the episode began.
    """

    def __init__(self, table_rectangles: np.ndarray, table_heights: np.ndarray | None = None):
        self.table_rectangles = table_rectangles
        usual = np.full(len(table_rectangles), layout.TABLE_HEIGHT)
        self.table_heights = usual if table_heights is None else table_heights
        self._lowest = self.table_heights.min(initial=layout.TABLE_HEIGHT) - _BELOW
        self.reset([])

    def reset(self, starting_tables: Sequence[int]) -> None:
        """Begins an episode, in which all of them stand, each on a table."""
        self.starting_tables = list(starting_tables)
        self._fallen: set[int] = set()

    def standing(self, physics: Physics) -> np.ndarray:
        """Whether each candle is upright, and no lower than a table, (candles,)."""
        high = physics.candle_poses()[:, 2] > self._lowest
        return high & (physics.candle_upright() > _STANDING_COSINE)

    def count_fallen(self, physics: Physics) -> int:
        """How many have fallen over, or down, since the last look."""
        fallen = set(np.flatnonzero(~self.standing(physics)).tolist())
        count = len(fallen - self._fallen)
        self._fallen = fallen
        return count

    def are_on(self, physics: Physics, table: int) -> bool:
        """Whether a candle stands (or lies) on a table."""
        x, y, half_x, half_y = self.table_rectangles[table]
        poses = physics.candle_poses()
        over = (np.abs(poses[:, 0] - x) < half_x) & (np.abs(poses[:, 1] - y) < half_y)
        return bool((over & (np.abs(poses[:, 2] - self.table_heights[table]) < _ABOVE)).any())
