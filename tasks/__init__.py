"""dm-control tasks of the caregiver, and their registry."""

from __future__ import annotations

import os

# Comes before dm_control, which would otherwise bring up GLFW and complain that there is no display.
import caregiver_mj.house.rendering  # noqa: F401

# isort: split
import numpy as np
from dm_control.rl import control

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.tasks.block_stairs import block_stairs
from caregiver_mj.tasks.relocate_candle import relocate_candle
from caregiver_mj.tasks.supervise import supervise

_TASKS = {"supervise": supervise, "relocate_candle": relocate_candle, "block_stairs": block_stairs}

ALL_TASKS = tuple(_TASKS)


def load(
    task: str,
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: float = 0.5,
    random: np.random.RandomState | int | None = None,
    task_kwargs: dict | None = None,
    environment_kwargs: dict | None = None,
) -> control.Environment:
    """Makes an environment.

    Args:
        task: One of `ALL_TASKS`.
        house: A floor plan, the name of one that comes with the package, or a path of one.
        epsilon: Share of the novice's moves that are random, in [0, 1].
        random: Source of all randomness, or a seed for one; None for a fresh one.
        task_kwargs: Further arguments of the task, such as `robot=False`.
        environment_kwargs: Further arguments of `dm_control.rl.control.Environment`.

    Returns:
        A `dm_env.Environment`.

    Raises:
        CaregiverError: There is no such task, the house is not valid or not fit for it, or epsilon out of range.
    """
    if task not in _TASKS:
        raise CaregiverError(f"no task '{task}': there are {', '.join(ALL_TASKS)}")
    plan = house if isinstance(house, FloorPlan) else FloorPlan.load(house)
    return _TASKS[task](plan, epsilon, random, environment_kwargs=environment_kwargs, **(task_kwargs or {}))
