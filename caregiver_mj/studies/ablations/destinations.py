"""Caregivers that take candles elsewhere than to the farthest table."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.plans.cell_graph import Target
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING


class NearestTable(PaperCaregiver):
    """Takes a candle to the bare table nearest, on foot, to its own."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        beside = plan.graph.beside(plan.tables)
        walk = plan.graph.distances_from(beside)  # (tables, caregiver cells)
        self._between = np.array([walk[:, cells].min(axis=1) for cells in beside], float)  # (tables, tables)

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        own = percept.candle_table[np.arange(len(candle)), candle]
        bare = bare_tables(percept.candle_table, len(self.plan.tables))
        return np.where(bare, self._between[own], np.inf).argmin(axis=1)


class LeastExposedTable(PaperCaregiver):
    """Takes a candle to the bare table into which one that moves as the action prior says bumps most rarely.

    Attributes:
        exposure: How often that one bumps into each table, bumps a move, (tables,).
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed, prior="mean")
        next_cell, target, index = plan.graph.moves
        cells = np.arange(len(plan.free_cells))
        chain = np.zeros((len(cells), len(cells)))
        np.add.at(chain, (cells[:, None], next_cell), self.action_prior)
        # The share of its time that it spends in each cell: p chain = p, sum(p) = 1.
        equations = np.concatenate([chain.T - np.eye(len(cells)), np.ones((1, len(cells)))])
        share = np.linalg.lstsq(equations, np.eye(len(cells) + 1)[-1], rcond=None)[0]
        self.exposure = np.zeros(len(plan.tables))
        bumps = target == Target.TABLE
        np.add.at(self.exposure, index[bumps], (share[:, None] * self.action_prior)[bumps])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return self._exposure_where_bare(percept).argmin(axis=1)

    def worth_protecting(self, percept: Percept) -> np.ndarray:
        least, table = self._exposure_where_bare(percept).min(axis=1), percept.candle_table
        stairwells, _ = self.plan.hazards.split(super().worth_protecting(percept))
        return self.plan.hazards.join(stairwells, (table != NOTHING) & (self.exposure[table] > least[:, None]))

    def _exposure_where_bare(self, percept: Percept) -> np.ndarray:
        """Exposure of each bare table, infinite for others, (B, tables)."""
        return np.where(bare_tables(percept.candle_table, len(self.exposure)), self.exposure, np.inf)
