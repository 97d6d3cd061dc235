"""Supervise: keep a toddler from harm for a whole episode, by whatever the robot can do about the house."""

from __future__ import annotations

import numpy as np
from dm_control.rl import control

from caregiver_mj.children import novice
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.tasks import base


def supervise(
    plan: FloorPlan,
    epsilon: float = 0.5,
    random: np.random.RandomState | int | None = None,
    time_limit: float | None = None,
    environment_kwargs: dict | None = None,
    **task_kwargs,
) -> control.Environment:
    """Returns the supervise task: 200 novice timesteps, reward 1 for every control step without harm."""
    task = Supervise(plan, epsilon, random, **task_kwargs)
    if time_limit is None:
        time_limit = novice.EPISODE_TIMESTEPS * task.novice_timestep
    return base.make_environment(task, time_limit, environment_kwargs)


class Supervise(base.CareTask):
    """The whole job."""

    def get_reward(self, physics: base.Physics) -> float:
        """1, less the share of the worst damage that the toddler has taken in the present novice timestep."""
        return 1.0 - self._timestep_damage[0] / novice.STAIRWELL_DAMAGE
