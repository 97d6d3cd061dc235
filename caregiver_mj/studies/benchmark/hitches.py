"""The worst control step: how long the policy makes the robot wait for an action, at most."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Iterable, Iterator

from dm_control.rl import control
from rich.console import Console

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.studies.benchmark.effort import EPSILON, Effort
from caregiver_mj.studies.display import make_table
from caregiver_mj.studies.houses import HOUSES, load_house
from caregiver_mj.studies.relocations.knock import Knock
from caregiver_mj.tasks import load

_GOAL = 0.050  # seconds of computing
_CAREGIVERS = ("paper", "foresight")


@dataclasses.dataclass(frozen=True)
class Step:
    """A control step.

    Attributes:
        seconds: Of computing in the policy.
        at: When, in simulated seconds.
        activity: What the robot was doing.
    """

    seconds: float
    at: float
    activity: str


def hitches(effort: Effort, console: Console) -> dict[str, dict[str, float | str]]:
    """Worst control steps, without the first of an episode, at which the robot stands."""
    table = make_table("Worst control step", "episodes", "steps", "worst ms", "over 50 ms", "at s", "while it would")
    figures: dict[str, dict[str, float | str]] = {}
    for name, episodes in _kinds(effort):
        worst, steps, over = Step(0.0, 0.0, ""), 0, 0  # and not all steps, for the garbage collector would count those
        for env, policy, knock in episodes:
            for step in _play(env, policy, knock, effort.seconds):
                worst, steps = max(worst, step, key=lambda step: step.seconds), steps + 1
                over += step.seconds > _GOAL
        figures[name] = {"worst": worst.seconds, "over": over, "steps": steps, "activity": worst.activity}
        row = (f"{1e3 * worst.seconds:.1f}", str(over), f"{worst.at:.1f}", worst.activity)
        table.add_row(name, str(steps), *row)
    console.print(table)
    console.print(f"goal: none takes more than {1e3 * _GOAL:g} ms of computing, other processes not counted\n")
    return figures


Episode = tuple[control.Environment, CaregiverPolicy, Knock | None]


def _kinds(effort: Effort) -> Iterable[tuple[str, Iterable[Episode]]]:
    """Kinds of episodes by their names: whole ones, and candles that are knocked over at the start."""
    for caregiver in _CAREGIVERS:
        yield f"supervise, {caregiver}", (_supervised(house, caregiver) for house in HOUSES[:2])
    yield "candles knocked over", map(_knocked, range(effort.jobs))


def _supervised(house: str, caregiver: str) -> Episode:
    env = load("supervise", load_house(house), EPSILON, random=0, visuals=False)
    return env, CaregiverPolicy(env, caregiver), None


def _knocked(seed: int) -> Episode:
    env = load("relocate_candle", load_house(HOUSES[seed % len(HOUSES)]), EPSILON, random=seed, visuals=False)
    policy = CaregiverPolicy(env)
    env.reset()
    knock = Knock(env.physics, env.task.goal_candle, seed)
    env.task.reseed(seed)
    return env, policy, knock


def _play(env: control.Environment, policy: CaregiverPolicy, knock: Knock | None, most: float) -> Iterator[Step]:
    """The control steps of an episode, or of its first seconds, without the very first."""
    timestep = env.reset()
    while not timestep.last() and env.physics.time() < most:
        start = time.process_time()
        action = policy(timestep)
        if not timestep.first():
            yield Step(time.process_time() - start, env.physics.time(), policy.activity)
        if knock:
            knock.apply()
        timestep = env.step(action)
        if knock and policy.interventions_done:
            most = -math.inf
