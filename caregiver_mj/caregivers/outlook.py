"""What is to come, as a caregiver believes that the children move: what they may run into, and where they may be."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.danger.chain import ChildChain
from caregiver_mj.danger.passage import first_passage, presence
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

HORIZON = 15  # timesteps: in as many the caregiver gets anywhere in most houses, and has moved a candle


@dataclasses.dataclass(frozen=True)
class Outlook:
    """What a caregiver believes of K children in each of B worlds, and what follows from it.

    Attributes:
        chain: How the children are thought to move. Some of its goals are toy bins.
        cell: The free cell of each, (B, K).
        probability: Of every goal and epsilon of each, (B, K, G, E).
    """

    chain: ChildChain
    cell: np.ndarray
    probability: np.ndarray

    @property
    def goal(self) -> np.ndarray:
        """Probability of every goal, (B, K, G)."""
        return self.probability.sum(axis=3)

    @property
    def toy_bin(self) -> np.ndarray:
        """Probability that each is on its way to each toy bin, (B, K, bins)."""
        return self.goal @ (self.chain.bin_of[:, None] == np.arange(self.chain.bin_of.max() + 1))

    @property
    def epsilon(self) -> np.ndarray:
        """Probability of every epsilon in `chain.epsilons`, (B, K, E)."""
        return self.probability.sum(axis=2)

    def reach(self, plan: FloorPlan, percept: Percept, timesteps: int = HORIZON) -> np.ndarray:
        """Probability that each child runs into each hazard within some timesteps, (B, K, hazards).

        Of a candle on the floor nothing is known but how far it is, and one over that is taken.
        """
        cells, goals, epsilons = self.chain.shape
        belief = self.probability.reshape(*self.cell.shape, goals * epsilons)
        passage = _passages(self.chain, timesteps).reshape(cells, goals * epsilons, -1)
        reach = np.einsum("bkg,bkgo->bko", belief, passage[self.cell])  # stairwells, then tables
        stairwells, tables = plan.hazards.split(reach)
        table = percept.candle_table[:, None]
        candles = np.take_along_axis(tables, np.where(table == NOTHING, 0, table), axis=2) if tables.size else tables
        candles = np.where(table == NOTHING, 0.0, candles)
        if percept.candle_cell is not None:
            for world, candle in np.argwhere(percept.candle_cell != NOTHING):
                steps = plan.graph.distances_from([percept.candle_cell[world, candle]])[0, self.cell[world]]
                candles[world, :, candle] = 1.0 / np.maximum(1, steps)
        return plan.hazards.join(stairwells, candles)

    def presence(self, timesteps: int) -> np.ndarray:
        """Probability that each child comes to be in each free cell within some timesteps, (B, K, free cells)."""
        cells = self.chain.shape[0]
        found = np.empty((*self.cell.shape, cells))
        for child in np.ndindex(self.cell.shape):
            now = np.zeros(self.chain.shape)
            now[self.cell[child]] = self.probability[child]
            found[child] = presence(self.chain, now.ravel(), timesteps)
        return found


@functools.lru_cache(maxsize=4)
def _passages(chain: ChildChain, timesteps: int) -> np.ndarray:
    """`first_passage`, made once for a chain."""
    return first_passage(chain, timesteps)
