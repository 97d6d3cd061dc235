"""Targets in the house: the robot executes the chosen target, once a novice timestep."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.target_observation import Encoder
from caregiver_mj.children.child_group import ChildrenLike
from caregiver_mj.envs.spaces import CostMeter
from caregiver_mj.experiments.runner import DivergenceError, HouseRollout
from caregiver_mj.experiments.score import Scorer
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load


class _Decisions(HouseRollout):
    """An episode that pauses when a decision is due."""

    due = False

    def decide(self) -> None:
        self.due = self.policy.see(self.timestep)

    def step(self) -> None:
        self.advance(self.policy.act())


class TargetHouse:
    """An episode in the house, a batch of one, that runs from decision to decision.

    A decision is due when all children's moves have become clear, which is also when scripted caregivers decide.

    Attributes:
        dm_env: The wrapped `dm_env.Environment`.
        policy: The policy, which executes the targets.
        diverged: Whether the episode ended because the simulation diverged.

    The others are as in `TargetGrid`.
    """

    def __init__(
        self,
        house: str | os.PathLike[str] | FloorPlan,
        epsilon: ChildrenLike | Sequence[ChildrenLike],
        task_kwargs: dict[str, Any] | None = None,
        visuals: bool = False,
        **options: Any,
    ):
        """Prepare the episode; the options are further arguments of `Encoder`."""
        kwargs = {"random": 0, **(task_kwargs or {})}  # for random tables, as in `HouseEnv`
        self.dm_env = load("supervise", house, epsilon, task_kwargs=kwargs, visuals=visuals)
        task = self.dm_env.task
        self.caregiver = CommandedCaregiver(task.plan)
        self.policy = CaregiverPolicy(self.dm_env, self.caregiver)
        self._rollout = _Decisions(self.dm_env, self.policy)
        self.children = len(task.children)
        self._scorer = Scorer(task.plan, task.family)
        timesteps = task.time_limit / task.novice_timestep
        self.encoder = Encoder(self.caregiver, self.children, timesteps=timesteps, **options)

    def begin(self, seeds: Sequence[int]) -> None:
        """Begin the episode with a seed, and run to the first decision; until then the robot keeps out of the way."""
        (seed,) = seeds
        self.diverged = False
        self._rollout.begin(seed)
        self._cost = CostMeter(self.dm_env.task)
        self.encoder.trace.clear()
        self._run_on()

    def act(self, actions: np.ndarray) -> None:
        """Run to the next decision, or to the end."""
        self.caregiver.targets = self.encoder.slots.targets(actions, 1)
        self._rollout.due = False
        self._run_on()

    @property
    def ended(self) -> bool:
        """Whether the episode is over."""
        return self.diverged or self._rollout.over

    def _run_on(self) -> None:
        try:
            decides = self._rollout.run_on(until=lambda: self._rollout.due)
        except DivergenceError:
            self.diverged = True
            return
        if decides:
            self.encoder.trace.appendleft(self.percept().previous_cell)

    def percept(self) -> Percept:
        """Return the caregiver's percept."""
        return self.policy.percept()

    def cost(self) -> dict[str, np.ndarray]:
        """Return the cost of the last decision, as of `CostMeter`, (1,) each."""
        return {key: np.array([value]) for key, value in self._cost.read().items()}

    def outcome(self) -> dict[str, Any]:
        """Return the measures of the episode, by column."""
        return self.dm_env.task.outcome()

    def scores(self) -> np.ndarray:
        """Return the score of the episode so far, (1,), see `caregiver_mj.experiments.score`."""
        return self._scorer(self.dm_env.task.timestep, self.outcome())
