"""The grid with a caregiver that lacks what the robot in the house lacks."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.pace import Pace
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.separation import FORESIGHT

_ROUNDING = 1e-9  # of an action


@dataclasses.dataclass(frozen=True)
class Handicap:
    """What a caregiver in the grid lacks. Times are in thirds of a novice timestep, which one of its actions takes.

    Attributes:
        once: Whether it decides before the first action of a timestep only, and carries on with that for the rest of
            it; else before each.
        pace: Time that an action takes.
        near: Time that one takes in addition where a child is within `FORESIGHT`, as far as the robot minds it.
        meanwhile: Time that it has while the children are on their way, as of `GridWorld`.
    """

    once: bool = False
    pace: float = 1.0
    near: float = 0.0
    meanwhile: float = 0.0


class HandicappedGrid(GridWorld):
    """The grid with a handicapped caregiver.

    Attributes:
        handicap: What it lacks.
        time: What is left of its time, in thirds of a timestep, (B,). It saves up what is not enough for an action.
    """

    def __init__(self, plan: FloorPlan, family: Family | float, caregiver: Caregiver, handicap: Handicap):
        super().__init__(plan, family, caregiver)
        self.handicap, self.meanwhile = handicap, handicap.meanwhile
        caregiver.pace = Pace(CAREGIVER_ACTIONS / handicap.pace)
        self._minds = minded_cells(plan)

    def reset(self, tapes: Sequence[Sequence[Tape]]) -> None:
        super().reset(tapes)
        self.time = np.zeros(len(tapes))

    def care(self, caregiver: Caregiver) -> None:
        decides = np.ones(len(self.time), bool)
        if self.meanwhile:
            self._spend(caregiver, self.meanwhile, decides, later=CAREGIVER_ACTIONS - self.meanwhile)
            self.arrive()
        self._spend(caregiver, CAREGIVER_ACTIONS - self.meanwhile, decides)

    def _spend(self, caregiver: Caregiver, time: float, decides: np.ndarray, later: float = 0.0) -> None:
        """Has the caregiver act in some time more, with some left for later in the timestep."""
        self.time += time
        while True:
            cost = self.handicap.pace + self.handicap.near * self.is_near()
            acts = self.time >= cost - _ROUNDING
            if not acts.any():
                return
            self.time_left = (self.time + later) / CAREGIVER_ACTIONS
            self.act_caregiver(caregiver, acts, decides)
            self.time -= np.where(acts, cost, 0.0)
            if self.handicap.once:
                decides &= ~acts

    def is_near(self) -> np.ndarray:
        """Whether a child is near the caregiver, (B,)."""
        return self._minds[self.caregiver_cell[:, None], self.child_cell].any(axis=1)


@functools.lru_cache(maxsize=4)
def minded_cells(plan: FloorPlan) -> np.ndarray:
    """Whether the robot in each cell minds a child in each free cell, bool (caregiver cells, free cells)."""
    places = np.array([plan.position(cell) for cell in plan.caregiver_cells])
    apart = places[:, None] - places[: len(plan.free_cells)]
    return np.hypot(apart[..., 0], apart[..., 1]) < FORESIGHT
