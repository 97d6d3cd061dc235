"""The grid's side: how long its caregiver takes for what it does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.studies.grid_to_house import phases
from caregiver_mj.studies.grid_to_house.handicap import HandicappedGrid


class WatchedGrid(HandicappedGrid):
    """The grid with a log of its caregiver's completed phases.

    Attributes:
        phases: A row a phase: actions that it took, how many of them near a child, and those of the shortest way
            without a child.
    """

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        graph, plan = self.plan.graph, self.plan
        self._to_landing = graph.distances_from([plan.cell_index[cell] for cell in plan.stairwells])
        self._to_table = graph.distances_from(graph.beside(plan.tables))
        self.phases: list[dict[str, Any]] = []
        self._under_way: list[tuple[int, bool] | None] = [None] * len(tapes)  # hazard, and whether it is in the hand
        self._actions, self._near, self._shortest = np.zeros((3, len(tapes)), int)

    def act_caregiver(
        self, caregiver: Caregiver, acts: np.ndarray | bool = True, decides: np.ndarray | bool = True
    ) -> None:
        cell, held, tables = self.caregiver_cell.copy(), self.holding.copy(), self.candle_table.copy()
        blocked, done, near = self.done.copy(), self.ledger.interventions_done.copy(), self.is_near()
        destination = self.orders.destination.copy()  # of the candle in the hand; forgotten once it is put down
        super().act_caregiver(caregiver, acts, decides)
        for i in np.flatnonzero(np.broadcast_to(acts, len(held))):
            was_held = bool(held[i] != NOTHING)
            hazard = self.plan.hazards.of_candle(held[i]) if was_held else int(self.orders.hazard[i])
            candle = self.plan.hazards.candle(hazard)
            if hazard == NOTHING or (candle == NOTHING and blocked[i] and self._under_way[i] is None):
                self._under_way[i] = None
                continue
            if self._under_way[i] != (hazard, was_held):
                self._under_way[i] = hazard, was_held
                self._actions[i] = self._near[i] = 0
                if candle == NOTHING:
                    self._shortest[i] = self._to_landing[hazard, cell[i]]
                else:
                    self._shortest[i] = self._to_table[destination[i] if was_held else tables[i, candle], cell[i]] + 1
            self._actions[i] += 1
            self._near[i] += near[i]
            taken = not was_held and self.holding[i] != NOTHING
            if taken or self.ledger.interventions_done[i] > done[i]:
                phase = phases.CARRY if was_held else phases.FETCH if taken else phases.BLOCK
                took = {"actions": self._actions[i], "near": self._near[i]} if self._shortest[i] else {}  # else: there
                self.phases.append({"phase": phase, "actions": 0, "near": 0, "shortest": self._shortest[i]} | took)
                self._under_way[i] = None
