"""A house with the scripted caregiver, and an episode of it on tape."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from unittest import mock

import dm_env
import mujoco
import numpy as np

from caregiver_mj.house.scene import child_joints
from caregiver_mj.house.touch import Touch
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.studies.benchmark.clock import Clock
from caregiver_mj.studies.benchmark.effort import EPSILON
from caregiver_mj.tasks import load


class Scene:
    """A house with the scripted caregiver, and an episode of it on tape.

    Attributes:
        env: The environment.
        policy: What acts in it.
        steps: Control timesteps of the episode.
    """

    def __init__(self, house: str | FloorPlan, seconds: float):
        self.env = load("supervise", house, EPSILON, random=0, task_kwargs={"time_limit": float("inf")})
        self.policy = CaregiverPolicy(self.env)
        self.steps = round(seconds / self.env.control_timestep())

    def play(self, act: Callable[[dm_env.TimeStep], np.ndarray] | None = None) -> float:
        """Plays the episode from its start, with the policy or what is given in its place; returns its seconds."""
        act = act or self.policy
        self.env.task.reseed(0)
        timestep = self.env.reset()
        start = time.perf_counter()
        for _ in range(self.steps):
            timestep = self.env.step(act(timestep))
        return time.perf_counter() - start

    def run(self) -> tuple[float, float, float]:
        """Plays the episode: seconds in all, in the physics, in the policy."""
        physics, policy = Clock(), Clock()
        with physics.of(self.env.physics, "step"):
            total = self.play(policy.around(self.policy))
        return total, physics.own, policy.own

    def record(self) -> None:
        """Plays the episode once, and keeps what drives the physics in it."""
        physics = self.env.physics
        model, data, step = physics.model.ptr, physics.data.ptr, physics.step
        joints = [model.joint(name) for name in child_joints(0)]
        self._q = np.array([joint.qposadr[0] for joint in joints])
        # The task writes the wheels' speeds as well; with them the replay is the same to the last bit.
        wheels = [model.joint(f"robot/{name}") for name in self.env.task.embodiment.names.wheels]
        self._v = np.array([joint.dofadr[0] for joint in (*joints, *wheels)])
        self._tape: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

        def taped(nstep: int) -> None:
            if not self._tape:
                self._start = copy.copy(data)
            driven = data.qpos[self._q], data.qvel[self._v]
            touches: list[Touch] = []
            controls = np.empty((nstep, model.nu))
            for i in range(nstep):  # what the actuators are told changes with every step
                step(1)
                controls[i], touches = data.ctrl, touches + physics.touches
            physics.touches = touches
            self._tape.append((controls, *driven))

        with mock.patch.object(physics, "step", taped):
            self.play()
        self._end = data.qpos.copy()

    def replay(self) -> tuple[float, float]:
        """Replays the tape through bare `mj_step`.

        Returns:
            Seconds that it took, and by how much the end differs from that of the episode.
        """
        model, data = self.env.physics.model.ptr, mujoco.MjData(self.env.physics.model.ptr)
        mujoco.mj_copyData(data, model, self._start)
        ctrl, qpos, qvel = data.ctrl, data.qpos, data.qvel
        start = time.perf_counter()
        for controls, positions, velocities in self._tape:
            qpos[self._q], qvel[self._v] = positions, velocities
            for ctrl[:] in controls:
                mujoco.mj_step(model, data)
        return time.perf_counter() - start, float(np.abs(data.qpos - self._end).max())
