"""The caregiver's ways for `hindsight`: to the posts, and until a candle is in the hand, round a child."""

from __future__ import annotations

import functools
import math

import numpy as np

from caregiver_mj.caregivers.pace import PAPER
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import Routes

_DETOURS = 3  # timesteps more than anything takes without a child


@functools.lru_cache(maxsize=4)
def travel(plan: FloorPlan) -> Travel:
    """Return the ways through a house; made once."""
    return Travel(plan)


class Travel:
    """The caregiver's ways at the paper's pace, by the rules of `plans.routes`.

    Attributes:
        posts: Cells of the landings. A house without stairwells has one post all the same: where the tables are
            nearest.
        open_way: Actions until it is at each goal, the posts and then beside each table, if there is no child,
            (goals, cells).
        done: The number of the cell in which it has got a candle; see `step`.
        step: The cell that it is in after a number of actions, 0 to those of a timestep, on its way to each goal,
            (actions, children's cells, goals, cells). Who has got the candle from a table is in one more cell, which
            there is not, the last one: `done`.
        longest: The most timesteps that anything is thought to take.
        central: For every table the cell beside it from which the rest is nearest.
    """

    def __init__(self, plan: FloorPlan):
        graph, cells = plan.graph, len(plan.caregiver_cells)
        stands = graph.beside(plan.tables)
        self.posts = [plan.cell_index[cell] for cell in plan.stairwells]
        if not self.posts:
            self.posts = [int(graph.distances_from(stands).sum(axis=0).argmin()) if stands else 0]
        goals = [[post] for post in self.posts] + stands
        routes = Routes(plan, goals)
        self.open_way = open_way = routes.open_distance.astype(int)
        self.done = cells
        one = np.full((len(plan.free_cells), len(goals), cells + 1), cells, np.int16)
        for child in range(len(one)):
            distance, towards = (found[:-1] for found in routes.around(child))
            fetched = (distance == 0) & (np.arange(len(goals)) >= len(self.posts))[:, None]
            one[child, :, :cells] = np.where(fetched, cells, towards)
            # Where the child is thought to have walked through the caregiver it has been kept back, and bars no way.
            one[child, :, child] = graph.downhill(open_way)[:, child]
        steps = [np.broadcast_to(np.arange(cells + 1, dtype=np.int16), one.shape)]
        for _ in range(int(PAPER.cells)):
            steps.append(np.take_along_axis(one, steps[-1].astype(int), axis=2))
        self.step = np.stack(steps)
        self.longest = math.ceil(2 * (open_way.max(initial=0) + 1) / PAPER.cells) + _DETOURS
        self.central = [min(stand, key=lambda cell: open_way[:, cell].sum(), default=0) for stand in stands]
