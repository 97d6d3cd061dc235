"""The grid's side: its episodes, and how long its caregiver takes for what it does."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.experiments.seeds import episode_seed, episode_tapes
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.studies.grid_to_house import phases
from caregiver_mj.studies.grid_to_house.phases import action_time


class WatchedGrid(GridWorld):
    """The grid with a log of its caregiver's completed phases.

    Attributes:
        phases: A row a phase: actions that it took, and those of the shortest way without a novice.
    """

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        graph, plan = self.plan.graph, self.plan
        self._to_landing = graph.distances_from([plan.cell_index[cell] for cell in plan.stairwells])
        self._to_table = graph.distances_from(graph.beside(plan.tables))
        self.phases: list[dict[str, Any]] = []
        self._under_way: list[tuple[int, bool] | None] = [None] * len(tapes)  # hazard, and whether it is in the hand
        self._actions, self._shortest = np.zeros((2, len(tapes)), int)

    def act_caregiver(self, caregiver: Caregiver) -> None:
        cell, held, tables = self.caregiver_cell.copy(), self.holding.copy(), self.candle_table.copy()
        blocked, done = self.done.copy(), self.ledger.interventions_done.copy()
        destination = self.orders.destination.copy()  # of the candle in the hand; forgotten once it is put down
        super().act_caregiver(caregiver)
        for i, was_held in enumerate(held != NOTHING):
            hazard = self.plan.hazards.of_candle(held[i]) if was_held else int(self.orders.hazard[i])
            candle = self.plan.hazards.candle(hazard)
            if hazard == NOTHING or (candle == NOTHING and blocked[i] and self._under_way[i] is None):
                self._under_way[i] = None
                continue
            if self._under_way[i] != (hazard, was_held):
                self._under_way[i] = hazard, was_held
                self._actions[i] = 0
                if candle == NOTHING:
                    self._shortest[i] = self._to_landing[hazard, cell[i]]
                else:
                    self._shortest[i] = self._to_table[destination[i] if was_held else tables[i, candle], cell[i]] + 1
            self._actions[i] += 1
            taken = not was_held and self.holding[i] != NOTHING
            if taken or self.ledger.interventions_done[i] > done[i]:
                phase = phases.CARRY if was_held else phases.FETCH if taken else phases.BLOCK
                actions = self._actions[i] if self._shortest[i] else 0  # there already
                self.phases.append({"phase": phase, "actions": actions, "shortest": self._shortest[i]})
                self._under_way[i] = None


def grid_delays(plan: FloorPlan, epsilons: Iterable[float], episodes: int) -> dict[str, float]:
    """Seconds by which the grid's caregiver, too, is slower than on the shortest way: the mean for each phase."""
    tapes = [episode_tapes(episode_seed(0, i), 1) for i in range(episodes)]
    found = []
    for epsilon in epsilons:
        world = WatchedGrid(plan, epsilon, make_caregiver("paper", plan, 0))
        world.run(tapes)
        found += world.phases
    table = pd.DataFrame(found)
    return ((table.actions - table.shortest) * action_time(plan)).groupby(table.phase).mean().to_dict()
