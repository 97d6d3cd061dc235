"""How the caregiver walks to where it has something to do, round a child that it knows the cell of."""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.caregivers.pace import PAPER, Pace
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

_ROUNDING = 1e-6  # of a timestep
_DETOURS = 3  # timesteps more than anything takes without a child


def travel(plan: FloorPlan, pace: Pace = PAPER, obstacle: bool = True) -> Travel:
    """The ways through a house at some pace, round the child or as if it were not there; made once."""
    return _made(plan, pace, obstacle)


@functools.lru_cache(maxsize=4)
def _made(plan: FloorPlan, pace: Pace, obstacle: bool) -> Travel:
    return Travel(plan, pace, obstacle)


class Travel:
    """The caregiver's ways to the posts (the landings of the stairwells) and to beside the tables of a house.

    It goes round the child. Where that bars the only way, it follows as closely as it can. What is called a *step* is
    the time in which it walks a cell.

    Attributes:
        pace: How long it takes.
        posts: Cells of the posts. A house without stairwells has one all the same: where the tables are nearest.
        goals: Where it goes: the cell of each post, then those beside each table.
        open_way: Steps until it is at each goal if there is no child, (goals, cells).
        done: The number of the cell in which it has got a candle; see `step`.
        to_table: Steps until it stands beside each table if there is no child, (cells, tables).
        onward: Steps from beside one table, to which it has come from a cell, to beside another one,
            (cells, tables, tables).
        longest: The most timesteps that anything is thought to take.
        central: For every table the cell beside it from which the rest is nearest.
    """

    def __init__(self, plan: FloorPlan, pace: Pace, obstacle: bool):
        self.pace, self._plan, self._obstacle = pace, plan, obstacle
        graph, cells = plan.graph, len(plan.caregiver_cells)
        stands = graph.beside(plan.tables)
        self.posts = [plan.cell_index[cell] for cell in plan.stairwells]
        if not self.posts:
            self.posts = [int(graph.distances_from(stands).sum(axis=0).argmin()) if stands else 0]
        goals = [[post] for post in self.posts] + stands
        open_way = graph.distances_from(goals).astype(int)
        self.done = cells
        self.goals, self.open_way = goals, open_way
        count = len(self.posts)
        self.to_table = open_way[count:].T
        between = graph.distances_from(range(cells)).astype(int)
        self.onward = np.zeros((cells, len(stands), len(stands)), np.int16)
        for table, stand in enumerate(stands):
            if stand:
                arrival = np.array(stand)[between[:, stand].argmin(axis=1)]
                self.onward[:, table] = open_way[count:, arrival].T
        there_and_back = self.to_table.max(initial=0) + pace.get + self.onward.max(initial=0) + pace.place
        self.longest = int(timesteps(max(there_and_back, open_way.max(initial=0)), 1, pace)) + _DETOURS
        self.central = [min(stand, key=lambda cell: open_way[:, cell].sum(), default=0) for stand in stands]

    @functools.cached_property
    def step(self) -> np.ndarray:
        """The cell that it is in after a number of steps, 0 to those of a timestep, on its way to each goal.

        (steps, children's cells, goals, cells). Who has got the candle from a table is in one more cell, which there is
        not, the last one: `done`. Worked out when first asked for, as it takes much memory in a large house.
        """
        plan, goals, open_way, obstacle = self._plan, self.goals, self.open_way, self._obstacle
        graph, cells, posts = plan.graph, len(plan.caregiver_cells), len(self.posts)
        traps = yielding(plan).traps
        better = [[cell for cell in goal if not traps[cell]] for goal in goals]
        open_step = graph.downhill(open_way)
        one = np.empty((len(plan.free_cells), len(goals), cells + 1), np.int16)
        one[..., cells] = cells
        for child in range(len(one)):
            distance = graph.distances_from(better, child) if obstacle else open_way
            if (barred := distance == UNREACHABLE).any():
                distance = np.where(barred, graph.distances_from(goals, child), distance)
                if (barred := distance == UNREACHABLE).any():
                    close = graph.distances_from(_lowest(open_way, graph.parts(child)), child)
                    distance = np.where(barred, close, distance)
            one[child, :, :cells] = graph.downhill(distance)
            # Where the child is thought to have walked through the caregiver it has been kept back, and bars no way.
            one[child, :, child] = open_step[:, child]
            for goal in range(posts, len(goals)):
                there = [cell for cell in goals[goal] if distance[goal, cell] == 0 and not barred[goal, cell]]
                one[child, goal, [*there, *set(goals[goal]) & {child}]] = cells
        steps = [np.broadcast_to(np.arange(cells + 1, dtype=np.int16), one.shape)]
        for _ in range(math.ceil(self.pace.cells)):
            steps.append(np.take_along_axis(one, steps[-1].astype(int), axis=2))
        return np.stack(steps)

    def in_a_timestep(self) -> list[tuple[float, np.ndarray]]:
        """Where it is a timestep later, (children's cells, posts and tables, cells), and with what probability."""
        whole = math.floor(self.pace.cells)
        rest = self.pace.cells - whole
        return [(1.0 - rest, self.step[whole]), *([(rest, self.step[whole + 1])] if rest else [])]


def timesteps(steps: np.ndarray | float, left: np.ndarray | float, pace: Pace = PAPER) -> np.ndarray:
    """How many moves a child makes while the caregiver is busy.

    Args:
        steps: For how long it is, in the time in which it walks a cell.
        left: How much of that there is before the child's next move.
        pace: Its pace.
    """
    return np.maximum(0, np.ceil((steps - left) / pace.cells - _ROUNDING)).astype(int)


def _lowest(height: np.ndarray, part: np.ndarray) -> list[list[int]]:
    """For each of some heights (goals, cells) the lowest cells of every part, (cells,), of a divided house."""
    lowest = []
    for one in height:
        least = np.full(part.max() + 1, np.iinfo(int).max)
        np.minimum.at(least, part, one)
        lowest.append(np.flatnonzero(one == least[part]).tolist())
    return lowest
