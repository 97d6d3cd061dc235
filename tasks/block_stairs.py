"""Block stairs: stand in the stairwell that is asked for, past a toddler."""

from __future__ import annotations

import collections

import numpy as np
from dm_control.rl import control
from dm_control.utils import rewards

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.clearance import BASE_RADIUS
from caregiver_mj.tasks import base

_TIME_LIMIT = 60.0  # seconds
_FAR = 3.0  # metres from the landing at which the reward is 0.1


def block_stairs(
    plan: FloorPlan,
    epsilon: float = 0.5,
    random: np.random.RandomState | int | None = None,
    time_limit: float = _TIME_LIMIT,
    environment_kwargs: dict | None = None,
    **task_kwargs,
) -> control.Environment:
    """Returns the block_stairs task.

    Raises:
        CaregiverError: There is no stairwell in the house, or no robot.
    """
    if not plan.stairwells:
        raise CaregiverError(f"block_stairs needs a stairwell (S), and floor plan '{plan.name}' has none")
    task = BlockStairs(plan, epsilon, random, **task_kwargs)
    if not task.has_robot:
        raise CaregiverError("block_stairs needs the robot")
    return base.make_environment(task, time_limit, environment_kwargs)


class BlockStairs(base.CareTask):
    """A stairwell is drawn at the start of every episode.

    Attributes:
        goal_stairwell: Index of the stairwell.
    """

    goal_given = True
    goal_stairwell = 0
    _landing = np.zeros(2)

    def initialize_episode(self, physics: base.Physics) -> None:
        super().initialize_episode(physics)
        self.goal_stairwell = int(self.random.randint(len(self.plan.stairwells)))
        self._landing = self.plan.position(self.plan.stairwells[self.goal_stairwell])

    def get_observation(self, physics: base.Physics) -> collections.OrderedDict:
        """As in all tasks, and what is asked for."""
        observation = super().get_observation(physics)
        observation["goal_stairwell"] = np.eye(len(self.plan.stairwells))[self.goal_stairwell]
        observation["base_to_goal"] = self._landing - physics.base_position()[:2]
        return observation

    def get_reward(self, physics: base.Physics) -> float:
        """1 while the whole base is in the landing's cell, less the farther it is from there."""
        inside = self.plan.cell_size / 2 - BASE_RADIUS
        distance = float(np.abs(self._landing - physics.base_position()[:2]).max())
        return float(rewards.tolerance(distance, bounds=(0, inside), margin=_FAR))
