"""Who may act in the house, by name: the caregivers, and policies of somebody's own for the robot's actions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np

from caregiver_mj.caregivers.answers import ReplayedPolicy
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.rendering import control
from caregiver_mj.house.task_info import TaskInfo
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.registry import check_call, errors_of


class OwnPolicy:
    """Calls somebody's policy, and is to whoever looks on what a `CaregiverPolicy` is.

    Attributes:
        name: What it goes by.
    """

    # It says nothing of what it is about, nor why.
    assessment = intervention = None
    target = NOTHING

    def __init__(self, name: str, make: Callable[[Any], Any], env: control.Environment):
        """Make the policy.

        Args:
            name: What it goes by.
            make: Called with the environment; answers with the policy, which is called with a time step and answers
                with an action. If the policy has a `reset`, that is called with a seed at the start of every episode.
            env: An environment of this package, with the robot in it.

        Raises:
            CaregiverError: There is no robot, or what is made is no policy.
        """
        info: TaskInfo = env.task.info
        if info.embodiment is None:
            raise CaregiverError(f"env must have a robot for '{name}' to act with, got none")
        check_call(f"'{name}'", make, env)
        self.name, self._task, self._policy = name, env.task, make(env)
        self._size = info.embodiment.layout.size
        if not callable(self._policy):
            raise CaregiverError(
                f"'{name}' must make a policy of an environment, which answers a time step with an action; "
                f"got {type(self._policy).__name__}"
            )

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Answer an observation with an action.

        Raises:
            CaregiverError: The policy's answer is none.
        """
        if timestep.first() and (reset := getattr(self._policy, "reset", None)):
            reset(self._task.info.caregiver_seed)
        where = f"in house '{self._task.info.plan.name}' (is it a policy for another one?)"
        with errors_of(f"'{self.name}'", where, but=control.PhysicsError):
            action = self._policy(timestep)
        try:
            numbers = np.asarray(action, float)
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (self._size,) or not np.isfinite(numbers).all():
            raise CaregiverError(f"'{self.name}' must answer with {self._size} finite numbers, got {action!r}")
        return numbers

    @property
    def activity(self) -> str:
        """What the robot is doing, in words, if the policy has an `activity` that says it; else whose doing it is."""
        return str(getattr(self._policy, "activity", self.name))


def make_policy(
    env: control.Environment, who: str | Caregiver | ReplayedPolicy, seed: int = 0
) -> CaregiverPolicy | OwnPolicy:
    """Make the policy of a name, or of a caregiver, for an environment.

    Args:
        env: An environment of this package, with the robot in it.
        who: A name as of `find_caregiver`, but not "none"; a caregiver; or actions that are given again.
        seed: Seed of a caregiver; what it draws in an episode depends on the episode's seed as well.

    Raises:
        CaregiverError: There is none of that name, it does not act, or there is no robot in the environment.
    """
    if isinstance(who, ReplayedPolicy):
        return OwnPolicy("given again", lambda _: who, env)
    found = find_caregiver(who) if isinstance(who, str) else type(who)
    if found is None or is_caregiver(found):
        return CaregiverPolicy(env, who, seed)
    return OwnPolicy(str(who), found, env)
