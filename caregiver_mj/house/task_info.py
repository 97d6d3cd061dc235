"""What a policy may know of a task beside its observations: the whole contract between the two."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from caregiver_mj.caregivers.told import Truth
from caregiver_mj.children.family import Family
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.robot.embodiment import Embodiment


@dataclasses.dataclass(frozen=True)
class TaskInfo:
    """What a policy may know of a task beside its observations.

    Attributes:
        plan: The house.
        family: Who the children are.
        embodiment: The robot; None if there is none.
        sensing: How well observations show what there is.
        sight: Which children they show.
        novice_timestep: Seconds of a novice timestep.
        table_heights: How high the tables' tops are, (tables,), metres, if observations show it; else None.
        orders: From an observation to what the task asks for; None if it leaves that to the caregiver.
        caregiver_seed: This episode's seed for a caregiver that draws lots.
        starting_tables: Index of the table on which each candle stood when this episode began.
        truth: What a `ToldCaregiver` is told, and nobody else.
    """

    plan: FloorPlan
    family: Family
    embodiment: Embodiment | None
    sensing: Sensing
    sight: Sight
    novice_timestep: float
    table_heights: np.ndarray | None
    orders: Callable[[Mapping[str, np.ndarray]], Intervention | None] | None
    caregiver_seed: int
    starting_tables: tuple[int, ...]
    truth: Callable[[], Truth]
