"""Run episodes in the house or in the grid: from their specification to their measures, and of a block to rows."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import dm_env
import numpy as np

from caregiver_mj.caregivers.answers import ReplayedCaregiver, kept, packed, replayed, unpacked
from caregiver_mj.caregivers.registry import find_caregiver, make_caregiver
from caregiver_mj.children.child_group import side_by_side
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import Result
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.experiments.spec import BARE_TABLES, NOBODY, EpisodeSpec, episode_random, episode_streams
from caregiver_mj.grid.world import CAREGIVER_ACTIONS, BareTablesWorld, GridWorld
from caregiver_mj.outside import plain
from caregiver_mj.recording.ledger import Ledger, Rollout
from caregiver_mj.recording.record import EpisodeRecord

if TYPE_CHECKING:
    from caregiver_mj.caregivers.caregiver import Caregiver

MAPS = ("visits", "damage")  # summed for every free cell over all episodes
Observer = Callable[[Any], None]  # called with a `Rollout`
# Fields that must be equal in a batch.
_SHARED = [field.name for field in dataclasses.fields(EpisodeSpec) if field.name not in ("family", "episode")]


class DivergenceError(CaregiverError):
    """The simulation diverged, as wild actions can make it."""


class HouseRollout(Rollout):
    """An episode in the house, control step by control step, in an environment of `caregiver_mj.tasks.load`.

    It has the same states as `env.step` with the same actions, but makes only the time steps that are read. Baselines,
    and episodes with actions from outside, have no policy.
    """

    action: Any  #: the policy's answer to the last time step, zeros without a policy; None at the end of the episode
    steps: int  #: control steps done

    def __init__(self, env: Any, policy: Any = None):
        from caregiver_mj.house.rendering import control  # here, for the grid does without MuJoCo

        self._physics_error = control.PhysicsError
        self.env, self.policy, self.which = env, policy, "the episode"  # name in messages
        self._task, self._physics = env.task, env.physics  # looked up once
        self._is_delayed = not (policy or env.task.sensing.is_exact)  # a delay is counted in observations
        self._nothing = np.zeros(env.action_spec().shape)
        self._substeps = round(env.control_timestep() / env.physics.timestep())
        # A user's task may rely on a call for each time step, in the order of `env.step`.
        answers = (env.task.get_reward, env.task.get_observation, env.task.get_termination)
        self._asks = any(not answer.__module__.startswith("caregiver_mj.") for answer in answers)
        self._timestep: dm_env.TimeStep | None = None
        self._discount: float | None = None  # discount at the end of the episode

    @property
    def caregiver(self) -> Caregiver | None:
        """The policy's caregiver, if it has one."""
        return getattr(self.policy, "caregiver", None)

    @property
    def ledger(self) -> Ledger:  # type: ignore[override]  # the task's, a new one in every episode
        return self.env.task.ledger

    @property
    def over(self) -> bool:
        return self._discount is not None

    @property
    def timestep(self) -> dm_env.TimeStep:
        """The last time step."""
        if self._timestep is None:
            reward = self._task.get_reward(self._physics)
            self._timestep = self._made(reward, self._task.get_observation(self._physics))
        return self._timestep

    def _made(self, reward: Any, observation: Any) -> dm_env.TimeStep:
        kind, discount = (dm_env.StepType.LAST, self._discount) if self.over else (dm_env.StepType.MID, 1.0)
        return dm_env.TimeStep(kind, reward, discount, observation)

    @property
    def seconds(self) -> float:
        """Simulated seconds since the start."""
        return self.steps * self.env.control_timestep()

    def begin(self, seed: int) -> None:
        """Begin the episode with a seed."""
        self.env.task.reseed(episode_random(seed))
        self._timestep, self._discount, self.steps = self.env.reset(), None, 0
        self.decide()

    def step(self) -> None:
        self.advance(self.action)

    def advance(self, action: Any) -> None:
        """Run one control step with an action, from outside or the policy's, or raise DivergenceError."""
        task, physics = self._task, self._physics
        try:
            task.before_step(action, physics)
            physics.step(self._substeps)
        except self._physics_error:
            raise DivergenceError(
                f"actions made the simulation diverge at {physics.time():.1f} s of {self.which}"
            ) from None
        task.after_step(physics)
        self.steps += 1
        self._timestep = None
        reward = task.get_reward(physics) if self._asks else None
        if self._asks or self._is_delayed:
            observation = task.get_observation(physics)
        self._discount = 1.0 if self.steps >= task.control_steps else task.get_termination(physics)
        if self._asks:
            self._timestep = self._made(reward, observation)
        self.decide()

    def decide(self) -> None:
        """Let the policy answer the last time step."""
        if self.over:
            self.action = None
        else:
            self.action = self.policy(self.timestep) if self.policy else self._nothing

    def outcomes(self) -> list[dict[str, Any]]:
        return [self.env.task.outcome()]


def make_house(spec: EpisodeSpec, *, answers: str = "", visuals: bool = True) -> HouseRollout:
    """Make the house and the policy of an episode, which takes a second.

    `answers` of an earlier run are replayed. A caregiver that looks at pictures always has visuals.
    """
    from caregiver_mj import tasks  # here, for the grid does without MuJoCo
    from caregiver_mj.policy.own import make_policy

    who: Any = replayed(spec.plan, answers) if answers else spec.caregiver
    found = None if answers else find_caregiver(spec.caregiver, queries=spec.queries)
    kwargs = {"robot": spec.has_robot, "embodiment": spec.embodiment, **spec.options}
    if spec.child_speed != WALKING_SPEED:  # a user's task need not have this argument
        kwargs["child_speed"] = spec.child_speed
    env = tasks.load(
        spec.task,
        spec.plan,
        spec.family,
        np.random.RandomState(0),  # for random tables; `begin` seeds the episode
        task_kwargs=kwargs,
        visuals=visuals or getattr(found, "needs_pictures", False),
        sight=spec.sight,
    )
    policy = make_policy(env, who, spec.seed, spec.queries) if spec.has_robot else None
    return HouseRollout(env, policy)


_kept_house = functools.lru_cache(maxsize=1)(make_house)  # consecutive episodes mostly share caregiver and family


def make_grid(specs: Sequence[EpisodeSpec], answers: str = "") -> GridWorld:
    """Make the grid for a batch of episodes: equally many of each family, one family after the other."""
    first, families = specs[0], tuple(dict.fromkeys(spec.family for spec in specs))
    each = len(specs) // len(families)
    if [spec.family for spec in specs] != [family for family in families for _ in range(each)]:
        raise CaregiverError("specs must be one family after the other, with as many episodes of each")
    children = side_by_side(first.plan, families, each)
    if first.caregiver == BARE_TABLES:
        return BareTablesWorld(first.plan, children)
    given = ReplayedCaregiver(first.plan, unpacked(answers)) if answers else None
    caregiver = given or make_caregiver(first.caregiver, first.plan, first.seed, first.queries)
    actions = CAREGIVER_ACTIONS * (WALKING_SPEED / first.child_speed)
    return GridWorld(first.plan, children, caregiver, caregiver_actions=actions, sight=first.sight)


@contextlib.contextmanager
def keep_answers(rollout: Any) -> Iterator[Callable[[], str]]:
    """Record a caregiver's answers, or the actions of another policy; yield a function that returns them as text."""
    actions: list[np.ndarray] = []

    def note(house: HouseRollout) -> None:
        if house.action is not None:
            actions.append(house.action)

    before = rollout.observers
    if getattr(rollout, "policy", None) and not rollout.caregiver:
        rollout.observers = [*before, note]
    try:
        with kept(rollout.caregiver) as text:
            yield lambda: packed(actions=np.array(actions, float)) if actions else text()
    finally:
        rollout.observers = before


class Outcome(NamedTuple):
    """The results of some episodes."""

    measured: list[dict[str, Any]]  # measures of each episode, by column
    visits: np.ndarray  # timesteps that children ended in each free cell, (episodes, free cells)
    damage: np.ndarray  # damage to children there, (episodes, free cells)
    answers: str  # the caregiver's answers, for a replay


def run(specs: Sequence[EpisodeSpec], observers: Sequence[Observer] = (), *, answers: str = "") -> Outcome:
    """Run one episode, or in the grid a batch that differs in family and number only.

    Args:
        specs: The episodes: one in the house; in the grid equally many of each family, one family after the other.
        observers: Called with the `Rollout` at the start and after every step.
        answers: As of `make_house`.

    Raises:
        DivergenceError: The caregiver's actions made the simulation diverge.
        CaregiverError: A specification is invalid, or they are no batch.
    """
    _check_together(specs)
    first, start = specs[0], time.perf_counter()
    rollout: Any
    if first.in_grid:
        rollout = make_grid(specs, answers)
        streams = functools.cache(episode_streams)  # families of a batch have the same
        begin = functools.partial(rollout.reset, [streams(spec.own_seed, len(spec.family)) for spec in specs])
    else:
        make = make_house if answers else _kept_house
        rollout = make(dataclasses.replace(first, episode=0), answers=answers, visuals=False)
        rollout.which = str(first)
        begin, start = functools.partial(rollout.begin, first.own_seed), time.perf_counter()
    rollout.observers = observers
    with keep_answers(rollout) as text:
        begin()
        rollout.notify()
        rollout.run_on()
        given = text()
    times = {
        "sim_seconds": EPISODE_TIMESTEPS * first.plan.cell_size / first.child_speed
        if first.in_grid
        else rollout.env.physics.time(),
        "wall_seconds": (time.perf_counter() - start) / len(specs),
    }
    ledger = rollout.ledger
    return Outcome([one | times for one in rollout.outcomes()], ledger.visits, ledger.damage_at, given)


def _check_together(specs: Sequence[EpisodeSpec]) -> None:
    if not specs:
        raise CaregiverError("specs must be at least 1, got 0")
    first = specs[0]
    first.check_world(first.world)
    if len(specs) > 1 and not first.in_grid:
        raise CaregiverError(f"specs must be 1 in the house, got {len(specs)}")
    for spec in specs[1:]:
        if others := [name for name in _SHARED if getattr(spec, name) != getattr(first, name)]:
            raise CaregiverError(f"specs must differ in family and episode alone, got another {others[0]}")


def run_block(settings: Settings, block: Block, answers: str | None = None) -> Result:
    """Return the `rows`, each family's `maps` and the caregiver's `answers` of a block; or replay such answers."""
    if answers is not None:
        check_answers(block, answers)
    specs = settings.specs(block)
    outcome = run(specs, answers=answers or "")
    rows = [
        EpisodeRecord(
            world=spec.world,
            house=spec.plan.name,
            caregiver=spec.caregiver,
            family=str(spec.family),
            epsilon=spec.family.epsilon,
            children=len(spec.family),
            episode=number,
            seed=spec.own_seed,
            sight=spec.sight,
            **measured,
        )
        for spec, number, measured in zip(specs, [*block.numbers] * len(block.families), outcome.measured, strict=True)
    ]
    maps = (outcome.visits, outcome.damage)
    sums = [values.reshape(len(block.families), len(block.numbers), -1).sum(axis=1).tolist() for values in maps]
    return {
        "rows": list(map(vars, rows)),
        "maps": {
            str(family): dict(zip(MAPS, of_family, strict=True))
            for family, *of_family in zip(block.families, *sums, strict=True)
        },
        "answers": outcome.answers,
    }


def check_answers(block: Block, answers: Any) -> None:
    """Raise CaregiverError unless `answers` is the text of a block's caregiver, empty for a baseline."""
    if not isinstance(answers, str) or bool(answers) == (block.caregiver in NOBODY):
        wanted = "none" if block.caregiver in NOBODY else "the text of its arrays"
        raise CaregiverError(f"the answers of '{block.caregiver}' must be {wanted}, got {plain(repr(answers), 40)}")
