"""The tasks in the house as Gymnasium environments, and the house of `TargetsEnv`."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.target_observation import Encoder, Observations
from caregiver_mj.children.child_group import ChildrenLike
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.envs.spaces import CostMeter, Seed, check_render_mode, episode_seed, plain_seed
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.experiments.runner import DivergenceError, HouseRollout
from caregiver_mj.experiments.score import Scorer
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import control
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load

# Regular motion stays well within these bounds; the effects of wild actions are clipped.
_SPEED, _TURN_RATE = 2.0, 26.0  # m/s; rad/s, of a child that turns round
_ARM_SLACK, _FINGER_SLACK = 0.1, 0.03  # rad, m; compliance of a joint limit
_ARM_SPEED = 50.0  # rad/s; with random actions, which jump across the range fifty times a second
_LOWEST, _HIGHEST = -1.0, 2.0  # m; height of a candle
_UNKNOWN = 1e6  # bound of observations of user tasks, and of the clock of an endless task

Bounds = tuple[np.ndarray | float, np.ndarray | float]


class HouseEnv(gymnasium.Env):
    """A task in the house; actions are those of the task, in its units.

    An episode is truncated when its time is over, or when wild actions make the simulation diverge. That step returns
    the last good observation, no reward, and `info["diverged"]` True.

    After a reset `info` has the `seed` that reproduces the episode. After a step it has `diverged`, and `cost` with its
    two parts, see `CostMeter`; after the last one also `outcome`, the measures of the episode by column, and
    `episode_score`, see `caregiver_mj.experiments.score`.

    Attributes:
        dm_env: The wrapped `dm_env.Environment`.
        timestep: Its last time step, for a `CaregiverPolicy`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012 (Gymnasium's own manner)

    def __init__(
        self,
        task: str = "supervise",
        house: str | os.PathLike[str] | FloorPlan = "paper",
        epsilon: ChildrenLike | Sequence[ChildrenLike] = 0.5,
        *,
        observation: str = "numbers",
        task_kwargs: dict[str, Any] | None = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        camera: str = "overview",
    ):
        """Make an environment.

        Args:
            task: One of `ALL_TASKS`.
            house: A floor plan, its name in the package, or its path.
            epsilon: The children, as `load` takes them.
            observation: Kind of observation: "numbers", a dictionary; or "flat", one array, in the order of that
                dictionary's keys.
            task_kwargs: Further arguments of the task, as `load` takes them.
            render_mode: "rgb_array", or None for a house without visual geometry, which runs faster.
            width: Width of an image, in pixels.
            height: Height of an image, in pixels.
            camera: Camera of the images: "overview", "follow", or another one of the house.

        Raises:
            CaregiverError: As of `load`; or the observation, render mode, camera or image size is invalid.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        kwargs = {"random": 0, **(task_kwargs or {})}  # for random tables; `reset` seeds the episode
        self.dm_env = load(task, house, epsilon, task_kwargs=kwargs, visuals=render_mode is not None)
        self._rollout = HouseRollout(self.dm_env)
        self._picture = {} if render_mode is None else picture(self.dm_env.physics, width, height, camera)
        self.metadata = self.metadata | {"render_fps": round(1 / self.dm_env.control_timestep())}
        self._scorer = Scorer(self.dm_env.task.plan, self.dm_env.task.family)
        self._observe = _BoundedObservations(self.dm_env, observation)
        self.observation_space = self._observe.space
        action = self.dm_env.action_spec()
        low, high = action.minimum.astype(np.float32), action.maximum.astype(np.float32)
        self.action_space = spaces.Box(low, high, action.shape, np.float32)
        self._observation: Observations | None = None  # the last one; None between episodes

    def reset(self, *, seed: Seed = None, options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begin the episode with a seed, as in the column `seed` of `evaluate`; without one it draws a seed.

        A `Generator` or a `RandomState` draws the seed.
        """
        asked = plain_seed(seed)
        super().reset(seed=asked)
        drawn = episode_seed(asked, self.np_random)
        self._rollout.begin(drawn)
        self.timestep = self._rollout.timestep
        self._observation = self._observe(self.timestep.observation)
        self._cost = CostMeter(self.dm_env.task)
        return self._observation, {"seed": drawn}

    def step(self, action: np.ndarray) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        if self._observation is None:
            raise gymnasium.error.ResetNeeded("call reset() before the first step and after the end of an episode")
        try:
            self._rollout.advance(np.asarray(action))
        except DivergenceError:
            last, self._observation = self._observation, None
            return copy.deepcopy(last), 0.0, False, True, self._info(ended=True, diverged=True)
        self.timestep = timestep = self._rollout.timestep
        ended = timestep.last()
        terminated = ended and timestep.discount == 0.0
        observation = self._observe(timestep.observation)
        self._observation = None if ended else observation
        return observation, float(timestep.reward), terminated, ended and not terminated, self._info(ended)

    def render(self) -> np.ndarray | None:
        if self.render_mode is None:
            return None
        return self.dm_env.physics.render(**self._picture)

    def close(self) -> None:
        self.dm_env.close()

    def _info(self, ended: bool, diverged: bool = False) -> dict[str, Any]:
        info = {**self._cost.read(), "diverged": diverged}
        if not ended:
            return info
        outcome = self.dm_env.task.outcome()
        return info | {"outcome": outcome, "episode_score": self._scorer(self.dm_env.task.timestep, outcome).item()}


def picture(physics: Physics, width: int, height: int, camera: str) -> dict[str, Any]:
    """Return arguments of `Physics.render`.

    Raises:
        CaregiverError: The camera is unknown, or the image size is invalid.
    """
    largest = physics.model.vis.global_
    for what, size, most in (("width", width, largest.offwidth), ("height", height, largest.offheight)):
        check_integer(f"the {what} of a picture, in pixels,", size, 1, most)
    physics.check_cameras([camera])
    return {"width": int(width), "height": int(height), "camera_id": camera}


# -- Observations within finite bounds -----------------------------------------------------------------


class _BoundedObservations:
    """Clips the observations of an environment to finite bounds, in a `space`: a dictionary, or a box if flat.

    Positions are clipped one cell outside the house, headings are wrapped to [-pi, pi). A scalar becomes an array of
    one, because learners such as those of Stable-Baselines3 reject scalars.
    """

    def __init__(self, env: control.Environment, observation: str):
        """Prepare the spaces; observations are "numbers", by name, or "flat", one array in that order."""
        if observation not in ("numbers", "flat"):
            raise CaregiverError(f"no observation '{observation}' of the robot's own actions: there are numbers, flat")
        bounds = _bounds(env)
        within = {key: seen.within for key, seen in env.task.observed.items()}
        self._boxes = {}
        for key, spec in sorted(env.observation_spec().items()):  # the order of `spaces.Dict`
            if (name := within.get(key, "")) not in bounds:
                raise CaregiverError(
                    f"`within` of observation '{key}' must be one of {', '.join(filter(None, bounds))}, got {name!r}"
                )
            self._boxes[key] = _box(*bounds[name], spec.shape or (1,))
        self._poses = {key for key in within if within[key] == "pose"}
        self._is_flat, keys = observation == "flat", spaces.Dict({**self._boxes})
        self.space: spaces.Space[Any] = spaces.flatten_space(keys) if self._is_flat else keys

    def __call__(self, observation: Mapping[str, np.ndarray]) -> dict[str, np.ndarray] | np.ndarray:
        """Return a clipped observation, in new arrays."""
        within = {}
        for key, box in self._boxes.items():
            value = np.array(observation[key], float).reshape(box.shape)
            if key in self._poses:
                value[..., 2] = np.remainder(value[..., 2] + np.pi, 2 * np.pi) - np.pi
            within[key] = np.clip(value, box.low, box.high, out=value)
        return np.concatenate([value.ravel() for value in within.values()]) if self._is_flat else within


def _box(low: np.ndarray | float, high: np.ndarray | float, shape: tuple[int, ...]) -> spaces.Box:
    """Return a box; bounds are broadcast, and may be longer than the last dimension."""
    low, high = (np.broadcast_to(np.atleast_1d(bound)[: shape[-1]], shape).astype(float) for bound in (low, high))
    return spaces.Box(low, high, shape, np.float64)


def _bounds(env: control.Environment) -> dict[str, Bounds]:
    """Return the bounds by the names of `Observed.within`."""
    task = env.task
    rows, columns = task.plan.shape
    x, y = (columns / 2 + 1) * task.plan.cell_size, (rows / 2 + 1) * task.plan.cell_size
    speed = _SPEED * max(1.0, task.child_speed / WALKING_SPEED)
    pose, rates = np.array([x, y, np.pi]), np.array([speed, speed, _TURN_RATE])
    place = np.array([-x, -y, _LOWEST]), np.array([x, y, _HIGHEST])
    way = np.array([2 * x, 2 * y, _HIGHEST - _LOWEST])
    bounds: dict[str, Bounds] = {
        "": (-_UNKNOWN, _UNKNOWN),
        "clock": (0.0, min(task.time_limit / task.novice_timestep + 1, _UNKNOWN)),
        "pose": (-pose, pose),  # the last number is an angle
        "rates": (-rates, rates),
        "place": place,
        "way": (-way, way),
        "height": (0.0, _HIGHEST),
        "gate": (-0.1, 1.6),
        "quaternion": (-1.0, 1.0),
        "share": (0.0, 1.0),
        "arm speed": (-_ARM_SPEED, _ARM_SPEED),
    }
    if task.has_robot:
        action, layout = env.action_spec(), task.embodiment.layout
        for name, which, slack in (("arm", layout.arm, _ARM_SLACK), ("fingers", layout.gripper, _FINGER_SLACK)):
            bounds[name] = action.minimum[which] - slack, action.maximum[which] + slack
    return bounds


# -- Supervision by targets ----------------------------------------------------------------------------


class _Decisions(HouseRollout):
    """An episode that pauses when a decision is due."""

    due = False

    def decide(self) -> None:
        self.due = self.policy.see(self.timestep)

    def step(self) -> None:
        self.advance(self.policy.act())


class TargetHouse:
    """An episode in the house, a batch of one, that runs from decision to decision; see `TargetGrid`.

    A decision is due when all children's moves have become clear, which is also when scripted caregivers decide.

    Attributes:
        dm_env: The wrapped `dm_env.Environment`.
        policy: The policy, which executes the targets.
        diverged: Whether the episode ended because the simulation diverged.
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
        """Return the cost of the last decision, see `CostMeter`, (1,) each."""
        return {key: np.array([value]) for key, value in self._cost.read().items()}

    def outcome(self) -> dict[str, Any]:
        """Return the measures of the episode, by column."""
        return self.dm_env.task.outcome()

    def scores(self) -> np.ndarray:
        """Return the score of the episode so far, (1,), see `caregiver_mj.experiments.score`."""
        return self._scorer(self.dm_env.task.timestep, self.outcome())
