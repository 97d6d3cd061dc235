"""Policies in the house by name: caregivers, user policies of the robot's actions, and teleoperation."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np

from caregiver_mj.caregivers.answers import ReplayedPolicy
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver, make_caregiver
from caregiver_mj.caregivers.server import SCHEMES, Queries
from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.observer import TaskInfo
from caregiver_mj.house.rendering import control
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.registry import check_call, errors_of
from caregiver_mj.robot.feedback import FollowedVelocity

_NOTCHES, _TURN = 4, math.pi / 4  # notches to the top speed; rad per press
_KEYS = {  # by key: effect in words, change of speed in notches, change of heading in turns to the left
    "0": ("stop", None, 0),
    "I": ("faster ahead", 1, 0),
    "K": ("slower, then back", -1, 0),
    "J": ("turn left", 0, 1),
    "L": ("turn right", 0, -1),
}
_YAW_GAIN = 3.0  # 1/s; gain from heading error to turning rate; larger ones overshoot


class OwnPolicy:
    """Adapter of a user policy to the interface of `CaregiverPolicy`.

    Attributes:
        name: Its name.
        policy: The user's function.
    """

    assessment = intervention = None
    target = NOTHING

    def __init__(self, name: str, make: Callable[[Any], Any], env: control.Environment):
        """Make a policy for an environment of this package with a robot.

        `make` is called with the environment, and returns a function from a time step to an action. The function's
        `reset`, if it has one, is called with a seed at the start of every episode.

        Raises:
            CaregiverError: There is no robot, or `make` returns no policy.
        """
        info: TaskInfo = env.task.info
        if info.embodiment is None:
            raise CaregiverError(f"env must have a robot for '{name}' to act with, got none")
        check_call(f"'{name}'", make, env)
        self.name, self._task, self.policy = name, env.task, make(env)
        self._size = info.embodiment.layout.size
        if not callable(self.policy):
            raise CaregiverError(
                f"'{name}' must make a policy of an environment, which answers a time step with an action; "
                f"got {type(self.policy).__name__}"
            )

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Return the action for a time step.

        Raises:
            CaregiverError: The policy fails, or returns no action.
        """
        if timestep.first() and (reset := getattr(self.policy, "reset", None)):
            reset(self._task.info.caregiver_seed)
        where = f"in house '{self._task.info.plan.name}' (is it a policy for another one?)"
        with errors_of(f"'{self.name}'", where, but=control.PhysicsError):
            action = self.policy(timestep)
        try:
            numbers = np.array(action, float)  # a copy: some policies reuse their array
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (self._size,) or not np.isfinite(numbers).all():
            raise CaregiverError(f"'{self.name}' must answer with {self._size} finite numbers, got {action!r}")
        return numbers

    @property
    def activity(self) -> str:
        """Present activity in words: the policy's `activity`, or its name."""
        return str(getattr(self.policy, "activity", self.name))


class Teleoperation:
    """A human player's policy: keys drive the base; arm and gripper keep their posture.

    It keeps the base's limits, but does not avoid walls and children.

    Attributes:
        keys: Each key, its effect, and "".
        activity: The commanded speed in words.
    """

    keys = tuple((key, does, "") for key, (does, *_) in _KEYS.items())

    def __init__(self, env: control.Environment):
        self._robot, self._timestep = env.task.info.embodiment, env.control_timestep()
        self._action = np.zeros(self._robot.layout.size)

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Return the action for a time step; an episode begins at rest."""
        seen, layout, limits = timestep.observation, self._robot.layout, self._robot.limits
        here, most = float(seen["base_position"][2]), limits.yaw.velocity
        if timestep.first():
            self._notch, self._yaw = 0, here
            self._velocity = FollowedVelocity(limits.base, self._timestep)
            self._turning = FollowedVelocity(limits.yaw, self._timestep)
            self._action[layout.arm], self._action[layout.gripper] = seen["arm_position"], seen["finger_position"][0]
        speed, turn = limits.base.velocity * self._notch / _NOTCHES, _YAW_GAIN * (self._yaw - here)
        ahead = self._velocity.follow((speed * math.cos(self._yaw), speed * math.sin(self._yaw)), goes_on=False)
        turning, _ = self._turning.follow((min(most, max(-most, turn)), 0.0), goes_on=False)
        self._action[layout.base] = *ahead, turning
        self.activity = f"drive at {speed:.2f} m/s"
        return self._action

    def press(self, key: str) -> None:
        """Apply a key from the next action on; other keys do nothing."""
        if key in _KEYS:
            _, faster, left = _KEYS[key]
            self._notch = 0 if faster is None else min(_NOTCHES, max(-_NOTCHES, self._notch + faster))
            self._yaw = _TURN * (round(self._yaw / _TURN) + left)  # parallel to the walls, or at 45 degrees


def make_policy(
    env: control.Environment, who: str | Caregiver | ReplayedPolicy, seed: int = 0, queries: Queries = Queries()
) -> CaregiverPolicy | OwnPolicy:
    """Make a policy for an environment.

    Args:
        env: An environment of this package with a robot.
        who: A name, as `find_caregiver` takes it, except "none"; a caregiver; or recorded actions.
        seed: Seed of a caregiver; its draws in an episode also depend on the episode's seed.
        queries: How to query a remote caregiver.

    Raises:
        CaregiverError: The name is unknown or that of a baseline, or the environment has no robot.
    """
    if isinstance(who, ReplayedPolicy):
        return OwnPolicy("given again", lambda _: who, env)
    found = find_caregiver(who, queries=queries) if isinstance(who, str) else type(who)
    if found is None or is_caregiver(found):
        if isinstance(who, str) and who.startswith(SCHEMES) and not env.task.info.orders:
            who = make_caregiver(who, env.task.info.plan, seed, queries) or who
        return CaregiverPolicy(env, who, seed)
    return OwnPolicy(str(who), found, env)
