"""How far it is round a child that stays where it is: all that is known of the caregiver's ways in a large house."""

from __future__ import annotations

import numpy as np

from caregiver_mj.caregivers.foresight.travel import Travel, timesteps
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan

_PATIENCE = 4  # moves after which a child is thought to be out of the way


class Detours:
    """Actions until the caregiver is at its goals, round a child or after waiting until that has gone.

    Attributes:
        between_posts: Moves of a child from post to post, by the child's cell, (children's cells, posts, posts).
    """

    def __init__(self, plan: FloorPlan, ways: Travel):
        self._graph, self._ways = plan.graph, ways
        cells, posts = len(plan.free_cells), len(ways.posts)
        # Zero pages until written to: only the cells count in which a child is seen.
        self._actions = np.zeros((cells, *ways.open_way.shape), np.int16)
        self._known = np.zeros(cells, bool)
        actions = [self._round(child, posts)[:, ways.posts].T for child in range(cells)]
        self.between_posts = timesteps(np.stack(actions), ways.pace.cells, ways.pace)

    def actions(self, child: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Actions until it is at each goal, (n, goals).

        Args:
            child: The children's cells, (n,).
            cell: The caregiver's cells, (n,).
        """
        for new in np.unique(child[~self._known[child]]):
            self._actions[new] = self._round(new, len(self._ways.goals))
            self._known[new] = True
        return self._actions[child, :, cell].astype(int)

    def _round(self, child: int, goals: int) -> np.ndarray:
        """Actions from everywhere to the first goals, (goals, cells)."""
        waiting = self._ways.open_way[:goals] + round(_PATIENCE * self._ways.pace.cells)
        detour = self._graph.distances_from(self._ways.goals[:goals], child)
        return np.minimum(UNREACHABLE, np.minimum(detour, waiting))
