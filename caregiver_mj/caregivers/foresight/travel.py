"""How long a caregiver is on its way, with a child in it."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

ACTIONS_PER_TIMESTEP = 3  # of the caregiver, in a novice timestep: what a duration is measured in
HANDLING = 1  # action to get a candle, or to place it
WAIT = 6  # actions more than without a child that it takes to get by where the child bars the only way


@dataclasses.dataclass(frozen=True)
class Start:
    """How far it is from where the caregiver is, or would be, if a child is in some cell.

    Attributes:
        landings: Actions to each post (a stairwell's landing), (children's cells, posts).
        tables: Actions until it stands beside each table, (children's cells, tables).
        onward: From there until it stands beside another one, (tables, tables).
    """

    landings: np.ndarray
    tables: np.ndarray
    onward: np.ndarray


@functools.lru_cache(maxsize=4)
def travel(plan: FloorPlan) -> Travel:
    """The ways through a house; made once."""
    return Travel(plan)


class Travel:
    """The caregiver's ways to the stairwells and the tables of a house.

    A child in the way is walked round. Where it bars the only way, it is waited for.

    In a house without stairwells there is one post all the same: wherever the caregiver happens to be.

    Attributes:
        to_landing: Actions to each post from each cell, (children's cells, posts, caregiver cells).
        to_table: Actions until it stands beside each table, (children's cells, tables, caregiver cells).
        onward: Actions from beside one table, to which it has come from a cell, to beside another one,
            (caregiver cells, tables, tables).
    """

    def __init__(self, plan: FloorPlan):
        landings = [[plan.cell_index[cell]] for cell in plan.stairwells]
        stands = plan.graph.beside(plan.tables)
        traps = yielding(plan).traps
        better = [[cell for cell in stand if not traps[cell]] for stand in stands]
        self._landings, self._stands = landings, stands
        graph, cells = plan.graph, len(plan.caregiver_cells)
        open_way = graph.distances_from(landings + stands).astype(int)
        shape = len(plan.free_cells), len(open_way), cells
        distance = np.empty(shape, np.int16)
        count = len(landings)
        for child in range(shape[0]):
            found = graph.distances_from(landings + better, child)
            if (found[count:] == UNREACHABLE).any():
                found[count:] = np.where(
                    found[count:] < UNREACHABLE, found[count:], graph.distances_from(stands, child)
                )
            distance[child] = np.where(found < UNREACHABLE, found, open_way + WAIT)
        self.to_landing, self.to_table = distance[:, :count], distance[:, count:]
        if not count:
            self.to_landing = np.zeros((shape[0], 1, cells), np.int16)
        between = graph.distances_from(range(cells)).astype(int)
        self.onward = np.zeros((cells, len(stands), len(stands)), np.int16)
        for table, stand in enumerate(stands):
            if stand:
                arrival = np.array(stand)[between[:, stand].argmin(axis=1)]
                self.onward[:, table] = open_way[count:, arrival].T
        self.onward[self.onward == UNREACHABLE] = 0  # a table that nobody can stand at
        self._central = [min(stand, key=lambda cell: open_way[:, cell].sum(), default=0) for stand in stands]

    @property
    def posts(self) -> int:
        """How many posts there are."""
        return self.to_landing.shape[1]

    def from_cell(self, cell: int) -> Start:
        """What is how far from a cell."""
        return Start(self.to_landing[:, :, cell], self.to_table[:, :, cell], self.onward[cell])

    def from_post(self, post: int) -> Start:
        """What is how far from a post; on an average, if it could be anywhere."""
        if self._landings:
            return self.from_cell(self._landings[post][0])
        tables = np.round(self.to_table.mean(axis=2)).astype(int)
        return Start(self.to_landing[:, :, 0], tables, np.round(self.onward.mean(axis=0)).astype(int))

    def from_table(self, table: int) -> Start:
        """What is how far from beside a table, on the side from which the rest is nearest."""
        return self.from_cell(self._central[table])


def timesteps(actions: np.ndarray, left: np.ndarray | int) -> np.ndarray:
    """How many moves a child makes while the caregiver is busy.

    Args:
        actions: For how many actions it is.
        left: How many of these it can do before the child's next move.
    """
    return np.maximum(0, -((left - np.asarray(actions, int)) // ACTIONS_PER_TIMESTEP))
