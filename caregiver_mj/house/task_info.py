"""The information that a task gives to policies beside observations: the whole contract between the two."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from caregiver_mj.caregivers.caregiver import Truth
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.robot.embodiment import Embodiment


@dataclasses.dataclass(frozen=True)
class TaskInfo:
    """The information for policies beside observations."""

    plan: FloorPlan  # the house
    family: ChildGroup  # the specification of the children
    embodiment: Embodiment | None  # the robot, if any
    sensing: Sensing  # errors, gaps and delay of observations
    sight: Sight  # which children observations show
    novice_timestep: float  # s
    child_speed: float  # m/s, at which the children walk
    # m; heights of the tables' tops, (tables,), if observations show them; else None
    table_heights: np.ndarray | None
    # returns the order in an observation; None if the task leaves the choice to the caregiver
    orders: Callable[[Mapping[str, np.ndarray]], Intervention | None] | None
    caregiver_seed: int  # seed of this episode for a random caregiver
    starting_tables: tuple[int, ...]  # index of each candle's table at the start of this episode
    truth: Callable[[], Truth]  # hidden state, for a `PrivilegedCaregiver` only
