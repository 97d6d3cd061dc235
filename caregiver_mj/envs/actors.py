"""Who acts in an environment that is recorded."""

from __future__ import annotations

import abc
from typing import Any

import gymnasium
import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver, make_caregiver
from caregiver_mj.caregivers.told import ToldCaregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.envs.house import HouseEnv
from caregiver_mj.envs.targets import TargetsEnv
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.own import make_policy


class Actor(abc.ABC):
    """Acts in one environment."""

    def begin(self, seed: int) -> None:  # noqa: B027 (the first time step may tell it)
        """Begin the episode of a seed, which the environment has begun."""

    @abc.abstractmethod
    def act(self) -> tuple[Any, int]:
        """Return the next action, as the environment takes it, and the hazard to protect from with it, or NOTHING."""


class RandomActor(Actor):
    """Draws actions from the whole space of them."""

    def __init__(self, env: gymnasium.Env):
        self._env = env

    def begin(self, seed: int) -> None:
        self._env.action_space.seed(seed)

    def act(self) -> tuple[np.ndarray, int]:
        action = self._env.action_space.sample()
        if not isinstance(self._env, TargetsEnv):
            return action, NOTHING
        return action, int(self._env.world.encoder.slots.targets([action], 1)[0])


class HouseCaregiver(Actor):
    """A caregiver with the robot's own actions, or a policy of such."""

    def __init__(self, env: HouseEnv, caregiver: str, seed: int):
        self._env, self._policy = env, make_policy(env.dm_env, caregiver, seed)

    def act(self) -> tuple[np.ndarray, int]:
        return self._policy(self._env.timestep), self._policy.target


class TargetCaregiver(Actor):
    """A caregiver that says what to protect the children from, once a novice timestep, and leaves the rest.

    In an evaluation it is asked before each of its actions. Where its answer changes within a timestep, as it may once
    a candle has been put down, the episodes part.
    """

    def __init__(self, env: TargetsEnv, caregiver: str, seed: int):
        """Prepare it.

        Raises:
            CaregiverError: It does nothing, has no targets or does more than choose them, or must be told more than an
                environment tells.
        """
        self._world = env.world
        found = find_caregiver(caregiver)
        if found is not None and not is_caregiver(found):
            raise CaregiverError(f"caregiver must choose targets, got '{caregiver}', a policy of the robot's actions")
        made = make_caregiver(caregiver, env.world.caregiver.plan, seed)
        if made is None:
            raise CaregiverError(f"caregiver must be one that acts, got '{caregiver}'")
        if isinstance(made, ToldCaregiver):
            raise CaregiverError(
                f"caregiver must choose targets from what it sees, got '{caregiver}', which "
                "needs privileged information"
            )
        if more := _beside_targets(made):
            raise CaregiverError(
                f"caregiver must do no more than choose targets, got '{caregiver}', which has its own {', '.join(more)}"
            )
        made.pace = env.world.caregiver.pace
        self._caregiver = made

    def begin(self, seed: int) -> None:
        children = self._world.children
        tape, *_ = Tape.draw_family(np.random.RandomState(seed), children)
        self._caregiver.reset(1, [tape.caregiver_seed], children)

    def act(self) -> tuple[np.ndarray, int]:
        percept = self._world.percept()
        self._caregiver.watch(percept)
        chosen = self._caregiver.choose(percept)
        return np.array(self._world.encoder.slots.actions(chosen)[0]), int(chosen[0])


def _beside_targets(caregiver: Caregiver) -> list[str]:
    """What a caregiver has its own way of, where its targets do not say so and an environment goes the usual way."""
    methods = ("prepare", "decide", "protect", "destination")
    own = [name for name in methods if getattr(type(caregiver), name) is not getattr(Caregiver, name)]
    return own if caregiver.yields else [*own, "yields"]
