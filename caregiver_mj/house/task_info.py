"""What a policy may know of a task beside its observations: the whole contract between the two."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from caregiver_mj.caregivers.privileged import Truth
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.robot.embodiment import Embodiment


@dataclasses.dataclass(frozen=True)
class TaskInfo:
    """What a policy may know of a task beside its observations."""

    plan: FloorPlan  # the house
    family: ChildGroup  # who the children are
    embodiment: Embodiment | None  # the robot; None if there is none
    sensing: Sensing  # how well observations show what there is
    sight: Sight  # which children they show
    novice_timestep: float  # seconds of a novice timestep
    # how high the tables' tops are, (tables,), metres, if observations show it; else None
    table_heights: np.ndarray | None
    # from an observation to what the task asks for; None if it leaves that to the caregiver
    orders: Callable[[Mapping[str, np.ndarray]], Intervention | None] | None
    caregiver_seed: int  # this episode's seed for a caregiver that draws lots
    starting_tables: tuple[int, ...]  # index of the table on which each candle stood when this episode began
    truth: Callable[[], Truth]  # hidden state, for a `PrivilegedCaregiver` only
