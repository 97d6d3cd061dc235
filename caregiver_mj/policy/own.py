"""Who may act in the house, by name: the caregivers, and policies of somebody's own for the robot's actions."""

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
from caregiver_mj.house.rendering import control
from caregiver_mj.house.task_info import TaskInfo
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.registry import check_call, errors_of
from caregiver_mj.robot.feedback import FollowedVelocity

_NOTCHES, _TURN = 4, math.pi / 4  # to its top speed; radians a press
_KEYS = {  # of each what it does, notches faster, and turns to the left
    "0": ("stop", None, 0),
    "I": ("faster ahead", 1, 0),
    "K": ("slower, then back", -1, 0),
    "J": ("turn left", 0, 1),
    "L": ("turn right", 0, -1),
}
_YAW_GAIN = 3.0  # from error of heading to rate of turning, 1/s: about the most that does not overshoot


class OwnPolicy:
    """Adapter of a policy of your own to the interface of `CaregiverPolicy`.

    Attributes:
        name: What it goes by.
        policy: What somebody has made.
    """

    # It says nothing of what it is about, nor why.
    assessment = intervention = None
    target = NOTHING

    def __init__(self, name: str, make: Callable[[Any], Any], env: control.Environment):
        """Make the policy of a name for an environment of this package with the robot in it.

        `make` is called with the environment. It returns a function from a time step to an action; if that has a
        `reset`, it is called with a seed at the start of every episode.

        Raises:
            CaregiverError: There is no robot, or what is made is no policy.
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
        """Answer an observation with an action.

        Raises:
            CaregiverError: The policy's answer is none.
        """
        if timestep.first() and (reset := getattr(self.policy, "reset", None)):
            reset(self._task.info.caregiver_seed)
        where = f"in house '{self._task.info.plan.name}' (is it a policy for another one?)"
        with errors_of(f"'{self.name}'", where, but=control.PhysicsError):
            action = self.policy(timestep)
        try:
            numbers = np.array(action, float)  # a copy: some answer with one array again and again
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (self._size,) or not np.isfinite(numbers).all():
            raise CaregiverError(f"'{self.name}' must answer with {self._size} finite numbers, got {action!r}")
        return numbers

    @property
    def activity(self) -> str:
        """What the robot is doing, in words, if the policy has an `activity` that says it; else whose doing it is."""
        return str(getattr(self.policy, "activity", self.name))


class Teleoperation:
    """A policy that somebody plays by keys, which drive the base; arm and gripper stay as they are.

    It keeps the base's limits. To keep off walls and children is left to whoever presses the keys.

    Attributes:
        keys: Each key, what it does, and "".
        activity: How fast the base is to go.
    """

    keys = tuple((key, does, "") for key, (does, *_) in _KEYS.items())

    def __init__(self, env: control.Environment):
        self._robot, self._timestep = env.task.info.embodiment, env.control_timestep()
        self._action = np.zeros(self._robot.layout.size)

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Answer a time step with an action; the first one begins an episode, at rest."""
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
        """Do what one of the keys says, from the next action on; others do nothing."""
        if key in _KEYS:
            _, faster, left = _KEYS[key]
            self._notch = 0 if faster is None else min(_NOTCHES, max(-_NOTCHES, self._notch + faster))
            self._yaw = _TURN * (round(self._yaw / _TURN) + left)  # along a wall, or across


def make_policy(
    env: control.Environment, who: str | Caregiver | ReplayedPolicy, seed: int = 0, queries: Queries = Queries()
) -> CaregiverPolicy | OwnPolicy:
    """Make the policy of a name, or of a caregiver, for an environment.

    Args:
        env: An environment of this package, with the robot in it.
        who: A name as of `find_caregiver`, but not "none"; a caregiver; or actions that are given again.
        seed: Seed of a caregiver; what it draws in an episode depends on the episode's seed as well.
        queries: How a caregiver is asked that is elsewhere.

    Raises:
        CaregiverError: There is none of that name, it does not act, or there is no robot in the environment.
    """
    if isinstance(who, ReplayedPolicy):
        return OwnPolicy("given again", lambda _: who, env)
    found = find_caregiver(who, queries=queries) if isinstance(who, str) else type(who)
    if found is None or is_caregiver(found):
        if isinstance(who, str) and who.startswith(SCHEMES) and not env.task.info.orders:
            who = make_caregiver(who, env.task.info.plan, seed, queries) or who
        return CaregiverPolicy(env, who, seed)
    return OwnPolicy(str(who), found, env)
