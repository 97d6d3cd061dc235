"""Record episodes for a data set: their specification, environment and actor."""

from __future__ import annotations

import abc
import contextlib
import copy
import dataclasses
import functools
import importlib.metadata
import pathlib
from typing import IO, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from caregiver_mj.caregivers.answers import ReplayedPolicy, replayed
from caregiver_mj.caregivers.caregiver import Caregiver, PrivilegedCaregiver
from caregiver_mj.caregivers.registry import find_caregiver, is_caregiver, make_caregiver, needs_pictures
from caregiver_mj.caregivers.server import Queries
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.envs import TARGETS_ID
from caregiver_mj.envs.house import HouseEnv
from caregiver_mj.envs.targets import TargetsEnv, make_targets
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import EpisodeSpec, plan_of_record, record_of_plan
from caregiver_mj.house.rendering import control, mujoco
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.policy.own import make_policy
from caregiver_mj.recording.ledger import Rollout
from caregiver_mj.recording.steps import RANDOM, TARGETS, About, Steps, frames_file, new_episode
from caregiver_mj.registry import summary
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import TASKS

_TARGET_TASK = "Targets: say once a novice timestep what to protect the children from, to keep them from harm."


@dataclasses.dataclass(frozen=True)
class Recording:
    """The episodes of a data set, and the cameras to record."""

    spec: EpisodeSpec  # one of the episodes; the others differ in their numbers only
    cameras: tuple[str, ...] = ()  # names of cameras to record
    size: tuple[int, int] = (128, 96)  # width and height of images, in pixels, even
    answers: tuple[str, ...] = ()  # the caregiver's earlier answers to replay, a text an episode; or empty

    def check(self) -> None:
        """Raise CaregiverError unless all fields are valid."""
        spec, targets = self.spec, self.spec.task == TARGETS
        find_embodiment(spec.embodiment)
        if spec.world == "grid" and not targets:
            raise CaregiverError(f"task must be {TARGETS} in the grid, got '{spec.task}'")
        if spec.world == "grid" and (self.cameras or spec.options):
            raise CaregiverError("cameras and seconds must be left out in the grid, which has neither")
        if len(set(self.cameras)) < len(self.cameras):
            raise CaregiverError(f"cameras must be different, got {' '.join(self.cameras)}")
        if any(side % 2 or not 32 <= side <= 2160 for side in self.size):
            raise CaregiverError(f"a picture's sides must be even, from 32 to 2160 pixels, got {self.size}")
        if "time_limit" in spec.options and targets:
            raise CaregiverError("seconds must be left out with targets: their episodes have their own length")
        spec.check(replayed=bool(self.answers))

    @property
    def kwargs(self) -> dict[str, Any]:
        """Arguments of the environment, except the house."""
        spec = self.spec
        options: dict[str, Any] = {"embodiment": spec.embodiment} if spec.world == "house" else {}
        options |= {} if spec.sight == "all" else {"sight": spec.sight}
        options |= {} if spec.child_speed == WALKING_SPEED else {"child_speed": spec.child_speed}
        given = {"epsilon": str(spec.family), "task_kwargs": options | spec.options}
        given |= {"world": spec.world} if spec.task == TARGETS else {}
        return {key: value for key, value in given.items() if value}

    def make(self) -> HouseEnv | TargetsEnv:
        """Make the environment.

        Raises:
            CaregiverError: The recording is invalid.
        """
        self.check()
        spec = self.spec
        kwargs = self.kwargs | {"house": spec.plan, "epsilon": spec.family}
        asked = spec.caregiver != RANDOM and not self.answers
        if self.cameras or (asked and needs_pictures(spec.caregiver, spec.queries)):
            kwargs["render_mode"] = "rgb_array"
        return make_targets(**kwargs) if spec.task == TARGETS else HouseEnv(spec.task, **kwargs)

    def env_spec(self, house: str | None = None) -> EnvSpec:
        """Return Gymnasium's specification of the environment, from which any machine can make it.

        Args:
            house: Name of the house in the package, or None. Without a name, or with damage of collisions other than
                the default, the specification holds the whole plan.
        """
        spec = copy.deepcopy(gymnasium.spec(TARGETS_ID if self.spec.task == TARGETS else TASKS[self.spec.task].id))
        spec.kwargs = {**spec.kwargs, **self.kwargs, "house": house}
        plan = self.spec.plan
        if house is None or plan.damage != DamageWeights():
            spec.kwargs["house"] = record_of_plan(plan) | {"damage": str(plan.damage)}
            spec.entry_point, spec.vector_entry_point = f"{__name__}:{make_recorded.__name__}", None
        return spec

    def about(self) -> About:
        """Return the description of the data set."""
        (env, _), spec = prepared(self), self.spec
        if isinstance(env, HouseEnv):
            rate, names = 1 / env.dm_env.control_timestep(), env.dm_env.action_spec().name.split("\t")
        else:
            rate, names = spec.child_speed / spec.plan.cell_size, ["target"]  # one decision per novice timestep
        kind = None if spec.task == TARGETS else TASKS[spec.task].find_kind()
        return About(
            task=(summary(kind) or spec.task) if kind else _TARGET_TASK,
            robot=spec.embodiment if spec.world == "house" else "",
            policy="actions drawn at random" if spec.caregiver == RANDOM else f"caregiver '{spec.caregiver}'",
            rate=round(rate, 6),
            actions=tuple(names),
            hazards=tuple(map(str, spec.plan.hazards)),
            version=importlib.metadata.version("caregiver_mj"),
        )

    def spaces(self) -> tuple[spaces.Dict, spaces.Space[Any]]:
        """Return the spaces of observations and of actions."""
        env, _ = prepared(self)
        assert isinstance(env.observation_space, spaces.Dict)  # no flat observations are recorded
        return env.observation_space, env.action_space


def make_recorded(house: Any, task: str = TARGETS, **options: Any) -> HouseEnv | TargetsEnv:
    """Make an environment of a `Recording.env_spec`, whose house may be a dictionary of the whole plan.

    The options are further arguments of `HouseEnv` or `make_targets`.

    Raises:
        CaregiverError: See these.
    """
    if isinstance(house, dict):
        house = plan_of_record(house, DamageWeights.of(house["damage"]))
    return make_targets(house=house, **options) if task == TARGETS else HouseEnv(task, house, **options)


@functools.lru_cache(maxsize=1)  # for consecutive episodes: a house takes a second to build
def prepared(recording: Recording, number: int = 0) -> tuple[HouseEnv | TargetsEnv, Actor]:
    """Return the environment and the actor of a recording; `number` selects the answers of an episode."""
    env, spec = recording.make(), recording.spec
    if recording.cameras:
        house_of(env).physics.check_cameras(recording.cameras)
    if spec.caregiver == RANDOM:
        return env, RandomActor(env)
    if isinstance(env, TargetsEnv):
        return env, TargetCaregiver(env, spec.caregiver, spec.seed, spec.queries)
    who = replayed(spec.plan, recording.answers[number]) if recording.answers else spec.caregiver
    return env, HouseCaregiver(env, who, spec.seed, spec.queries)


def house_of(env: HouseEnv | TargetsEnv) -> control.Environment:
    """Return the wrapped environment in MuJoCo."""
    return env.world.dm_env if isinstance(env, TargetsEnv) else env.dm_env


class EnvRollout(Rollout):
    """An episode of an environment with an actor, and Gymnasium's results of its last step."""

    observation: Any  # a dictionary
    row: tuple[Any, ...] | None  # action, reward, cost, damage, strikes and hazard of the last step; None at first

    def __init__(self, env: HouseEnv | TargetsEnv, actor: Actor):
        self.env, self.actor = env, actor

    @property
    def over(self) -> bool:
        return self._over

    def begin(self, seed: int) -> None:
        """Begin the episode with a seed."""
        self.observation, self.info = self.env.reset(seed=seed)
        self.actor.begin(seed)
        self._over, self.terminated, self.row = False, False, None

    def step(self) -> None:
        action, intervention = self.actor.act()
        self.observation, reward, self.terminated, truncated, info = self.env.step(action)
        self.row = action, reward, info["cost"], info["damage"], info["strikes"], intervention
        self._over, self.info = self.terminated or truncated, info

    def outcomes(self) -> list[dict[str, Any]]:
        return [self.info["outcome"]]


def collect(recording: Recording, store: pathlib.Path, number: int) -> None:
    """Run the episode with a number, and store it in the folder of a `Store`."""
    seed = dataclasses.replace(recording.spec, episode=number).own_seed
    rollout = EnvRollout(*prepared(recording, number if recording.answers else 0))
    observations, rows, cameras = list[dict[str, np.ndarray]](), list[tuple[Any, ...]](), list[tuple[Any, IO[bytes]]]()

    def note(rollout: EnvRollout) -> None:
        observations.append(rollout.observation)
        if rollout.row:
            rows.append(rollout.row)
        for camera, file in cameras:
            file.write(np.ascontiguousarray(camera.render()).tobytes())

    width, height = recording.size
    with new_episode(store, number) as folder:
        with contextlib.ExitStack() as files:
            for name in recording.cameras:
                camera = house_of(rollout.env).physics.camera(name, width, height)
                camera.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # shadows take four fifths of the time
                cameras.append((camera, files.enter_context(open(frames_file(folder, name), "wb"))))
            rollout.observers = [note]
            rollout.begin(seed)
            rollout.notify()
            rollout.run_on()
        actions, rewards, costs, damage, strikes, interventions = map(np.array, zip(*rows, strict=True))
        shape = len(observations), height, width, 3
        Steps(
            number=number,
            seed=seed,
            observations={key: np.array([seen[key] for seen in observations]) for key in observations[0]},
            actions=actions.astype(rollout.env.action_space.dtype),
            rewards=rewards,
            costs=costs,
            damage=damage,
            strikes=strikes,
            interventions=interventions,
            terminated=rollout.terminated,
            diverged=rollout.info["diverged"],
            outcome=rollout.outcomes()[0],
            frames={
                name: np.memmap(frames_file(folder, name), np.uint8, "r", shape=shape) for name in recording.cameras
            },
        ).save(folder)


# -- Actors ------------------------------------------------------------------------------------------


class Actor(abc.ABC):
    """Acts in one environment."""

    def begin(self, seed: int) -> None:  # noqa: B027 (optional)
        """Begin the episode with a seed, after the environment's reset."""

    @abc.abstractmethod
    def act(self) -> tuple[Any, int]:
        """Return the next action, and the hazard under intervention, or NOTHING."""


class RandomActor(Actor):
    """Draws actions from the action space."""

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
    """A caregiver or policy with the robot's own actions."""

    def __init__(self, env: HouseEnv, who: str | Caregiver | ReplayedPolicy, seed: int, queries: Queries = Queries()):
        self._env, self._policy = env, make_policy(env.dm_env, who, seed, queries)

    def act(self) -> tuple[np.ndarray, int]:
        return self._policy(self._env.timestep), self._policy.target


class TargetCaregiver(Actor):
    """A caregiver that chooses targets, once a novice timestep.

    In an evaluation it decides before each of its actions. If its choice changes within a timestep, as it may after
    putting a candle down, the episodes differ.
    """

    def __init__(self, env: TargetsEnv, caregiver: str, seed: int, queries: Queries = Queries()):
        """Make the caregiver.

        Raises:
            CaregiverError: The caregiver does nothing, does more than choose targets, or needs privileged information.
        """
        self._world = env.world
        found = find_caregiver(caregiver, queries=queries)
        wrong = f"caregiver must {{}}, got '{caregiver}'"
        if found is not None and not is_caregiver(found):
            raise CaregiverError(wrong.format("choose targets") + ", a policy of the robot's actions")
        made = make_caregiver(caregiver, env.world.caregiver.plan, seed, queries)
        if made is None:
            raise CaregiverError(wrong.format("be one that acts"))
        if isinstance(made, PrivilegedCaregiver):
            what = "choose targets from what it sees"
            raise CaregiverError(wrong.format(what) + ", which needs privileged information")
        if more := _beside_targets(made):
            what = "do no more than choose targets"
            raise CaregiverError(f"{wrong.format(what)}, which has its own {', '.join(more)}")
        made.pace = env.world.caregiver.pace
        self._caregiver = made

    def begin(self, seed: int) -> None:
        children = self._world.children
        stream, *_ = RandomStream.draw_group(np.random.RandomState(seed), children)
        self._caregiver.reset(1, [stream.caregiver_seed], children)

    def act(self) -> tuple[np.ndarray, int]:
        percept = self._world.percept()
        self._caregiver.watch(percept)
        chosen = self._caregiver.choose(percept)
        return np.array(self._world.encoder.slots.actions(chosen)[0]), int(chosen[0])


def _beside_targets(caregiver: Caregiver) -> list[str]:
    """Return the methods that a caregiver overrides beyond the choice of targets."""
    methods = ("prepare", "decide", "protect", "destination")
    own = [name for name in methods if getattr(type(caregiver), name) is not getattr(Caregiver, name)]
    return own if caregiver.yields else [*own, "yields"]
