"""Targets in the house: the robot carries out what somebody else decides, once a novice timestep."""

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
    """An episode that halts wherever a decision is due."""

    due = False

    def decide(self) -> None:
        self.due = self.policy.see(self.timestep)

    def step(self) -> None:
        self.advance(self.policy.act())


class TargetHouse:
    """An episode in the house, up to one decision and from there to the next; a batch of one.

    A decision is due whenever it has just become clear where all children are heading, which is when the scripted
    caregivers decide, too.

    Attributes:
        dm_env: The `dm_env.Environment` within.
        policy: Who acts in it.
        diverged: Whether the episode is over because the simulation has come apart.

    The others are as of `TargetGrid`.
    """

    def __init__(
        self,
        house: str | os.PathLike[str] | FloorPlan,
        epsilon: ChildrenLike | Sequence[ChildrenLike],
        task_kwargs: dict[str, Any] | None = None,
        visuals: bool = False,
        **options: Any,
    ):
        """Make it; the options are further arguments of `Encoder`."""
        kwargs = {"random": 0, **(task_kwargs or {})}  # of tables that are drawn, as in `HouseEnv`
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
        """Begin the episode of a seed, up to the first decision; until then the robot keeps out of the way."""
        (seed,) = seeds
        self.diverged = False
        self._rollout.begin(seed)
        self._cost = CostMeter(self.dm_env.task)
        self.encoder.trace.clear()
        self._go_on()

    def act(self, actions: np.ndarray) -> None:
        """Go on to the next decision, or to the end."""
        self.caregiver.targets = self.encoder.slots.targets(actions, 1)
        self._rollout.due = False
        self._go_on()

    @property
    def ended(self) -> bool:
        """Whether the episode is over."""
        return self.diverged or self._rollout.over

    def _go_on(self) -> None:
        try:
            decides = self._rollout.run_on(until=lambda: self._rollout.due)
        except DivergenceError:
            self.diverged = True
            return
        if decides:
            self.encoder.trace.appendleft(self.percept().previous_cell)

    def percept(self) -> Percept:
        """Return what a caregiver sees, of a batch of one."""
        return self.policy.percept()

    def cost(self) -> dict[str, np.ndarray]:
        """Return what the last decision has cost, as of `CostMeter`, (1,) each."""
        return {key: np.array([value]) for key, value in self._cost.read().items()}

    def outcome(self) -> dict[str, Any]:
        """Return what is measured of the episode."""
        return self.dm_env.task.outcome()

    def scores(self) -> np.ndarray:
        """Return the score of the episode so far, (1,), see `caregiver_mj.experiments.score`."""
        return self._scorer(self.dm_env.task.timestep, self.outcome())
