"""Limited sight of the grid's caregivers."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.danger.child_model import CHANGE, child_chain
from caregiver_mj.danger.tracker import Tracker
from caregiver_mj.grid.verbs import GridState
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.visibility import ALL_ROUND, Sight, visibility


class GridEyes:
    """The sight of the caregivers of B worlds, and what they know from it.

    A caregiver looks in the direction of its last move. After an action without walking or handling it has turned
    round, and sees in all directions. It feels a child that walks into it, or that it would walk into. It learns the
    state of things on the floor by seeing their cells. Its `tracker` holds its belief about the children.
    """

    def __init__(self, world: GridState, sight: Sight):
        """Observe the start of the episodes."""
        self._world, self._seen = world, visibility(world.plan, sight).seen
        batch, children = world.child_cell.shape
        self.tracker = Tracker(child_chain(world.plan), batch, children, CHANGE)
        self.heading = np.full(batch, ALL_ROUND)  # direction as a move, or `ALL_ROUND`
        self.state = world.state.copy()  # known `State` of each hazard
        self._previous, self._action = np.full((2, batch, children), NOTHING)
        self._places = np.array(world.plan.caregiver_cells)  # rows and columns
        self.look(np.zeros_like(world.child_cell, bool))

    def watch(self, felt: np.ndarray) -> None:
        """Observe the children's moves; `felt`, bool (B, K), marks those into the caregiver."""
        world = self._world
        in_view = self.in_view()
        before, now = (
            np.take_along_axis(in_view, cell, axis=1) | felt for cell in (world.previous_cell, world.child_cell)
        )
        self._previous = np.where(before & now, world.previous_cell, NOTHING)
        self._action = np.where(before & now, world.previous_action, NOTHING)
        cell = np.where(now, world.child_cell, NOTHING)
        self.tracker.move(self._previous, self._action, cell, in_view, world.caregiver_cell)
        self._see_hazards(in_view)

    def turn(self, before: np.ndarray, idle: np.ndarray) -> None:
        """Turn to the direction of the move from a cell, (B,), or all round if idle, bool (B,)."""
        step = self._places[self._world.caregiver_cell] - self._places[before]
        moved = step.any(axis=1)
        move = (step[:, None] == np.array(ACTIONS)).all(axis=2).argmax(axis=1)
        self.heading = np.where(moved, move, np.where(idle, ALL_ROUND, self.heading))

    def look(self, felt: np.ndarray) -> None:
        """Observe the world after an action; `felt`, bool (B, K), marks children in the caregiver's way."""
        world = self._world
        in_view = self.in_view()
        now = np.take_along_axis(in_view, world.child_cell, axis=1) | felt
        self.tracker.look(np.where(now, world.child_cell, NOTHING), in_view)
        self._see_hazards(in_view)

    def percept(self, everything: Percept) -> Percept:
        """Return a percept with the children reduced to the knowledge of a caregiver with partial sight."""
        tracker, known = self.tracker, self._previous != NOTHING
        return dataclasses.replace(
            everything,
            child_cell=tracker.cell.copy(),
            previous_cell=np.where(known, self._previous, tracker.cell),
            previous_action=self._action.copy(),
            belief=tracker,
        )

    def in_view(self) -> np.ndarray:
        """Return whether each free cell is in view, bool (B, free cells)."""
        return self._seen[self._world.caregiver_cell, self.heading]

    def _see_hazards(self, in_view: np.ndarray) -> None:
        """Update the known states of hazards; those on the floor only if in view."""
        world = self._world
        unseen = np.zeros(self.state.shape, bool)
        world.plan.hazards.split(unseen)[2][:] = ~in_view[:, list(world.plan.floor_cells)]
        self.state = np.where(unseen, self.state, world.state)
