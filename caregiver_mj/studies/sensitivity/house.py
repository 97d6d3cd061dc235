"""The physical house: speed and yielding."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import track

from caregiver_mj.experiments.fingerprint import source_digest
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.seeds import episode_random, episode_seed
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.versions import versions
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.tasks import load

HOUSE = "paper"
ALONE, OWN = "none", "paper"


@dataclasses.dataclass(frozen=True)
class Robot:
    """A caregiver in the house.

    Attributes:
        caregiver: Its name.
        speed: The share of its base's highest speed that it may use.
    """

    caregiver: str = OWN
    speed: float = 1.0


ROBOTS: Mapping[str, Robot | None] = {
    ALONE: None,
    OWN: Robot(),
    "paper-still": Robot("paper-still"),
    "paper at 75 % of its speed": Robot(speed=0.75),
    "paper at 50 % of its speed": Robot(speed=0.5),
}


def slowed(robot: Embodiment, share: float) -> Embodiment:
    """The same robot with a slower base; it accelerates and turns as before."""
    limits = robot.limits
    base = dataclasses.replace(limits.base, velocity=share * limits.base.velocity)
    limits = dataclasses.replace(limits, base=base, base_speed=share * limits.base_speed)
    return dataclasses.replace(robot, name=f"{robot.name}-{share:g}", limits=limits)


@dataclasses.dataclass(frozen=True)
class Job:
    """An episode: of which of `ROBOTS`, with what novice, and its number."""

    robot: str
    epsilon: float
    episode: int

    def __str__(self) -> str:
        """Its name on disk."""
        return f"{self.robot}_epsilon_{self.epsilon:g}_episode_{self.episode:06d}".replace(" ", "_").replace("%", "pc")


def measure(
    episodes: int, jobs: int, out: str | os.PathLike[str] | None = None, epsilons: Sequence[float] = EPSILONS
) -> pd.DataFrame:
    """Runs the episodes: a row each.

    Args:
        episodes: How many for each robot and epsilon.
        jobs: Worker processes.
        out: A folder in which finished episodes are kept, and looked for first.
        epsilons: Shares of random moves.
    """
    work = [Job(robot, epsilon, i) for epsilon in epsilons for robot in ROBOTS for i in range(episodes)]
    settings = {"study": "sensitivity", "house": HOUSE, "versions": versions()}
    settings["source"] = source_digest(modules=(__name__,))
    folder = None if out is None else RunFolder(out, settings, resume=True)
    done = {job: found for job in work if folder and (found := folder.read(str(job)))}
    pending = [job for job in work if job not in done]
    with contextlib.closing(run_jobs(run, pending, jobs)) as running:
        for job, row in track(running, "in the house", total=len(pending), console=Console(stderr=True)):
            if folder:
                folder.write(str(job), row)
            done[job] = row
    return pd.DataFrame([done[job] for job in work])


def run(job: Job) -> dict[str, Any]:
    """Runs an episode."""
    env, policy = make(ROBOTS[job.robot], job.epsilon)
    env.task.reseed(episode_random(episode_seed(0, job.episode)))
    timestep = env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep) if policy else np.zeros(env.action_spec().shape))
    return dataclasses.asdict(job) | env.task.outcome()


@functools.lru_cache(maxsize=1)  # jobs of one robot and epsilon follow each other
def make(robot: Robot | None, epsilon: float) -> tuple[Any, CaregiverPolicy | None]:
    """A house with a novice, and what acts in it, if anything does."""
    kwargs: dict[str, Any] = {"robot": robot is not None}
    if robot:
        kwargs["embodiment"] = slowed(find_embodiment(), robot.speed)
    env = load("supervise", FloorPlan.load(HOUSE), epsilon, np.random.RandomState(0), task_kwargs=kwargs)
    return env, CaregiverPolicy(env, robot.caregiver) if robot else None
