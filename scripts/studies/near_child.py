"""How the robot moves near the child: whole episodes in three houses, half of them with a child that heads for it.

A strike is a contact of the child with a part of the robot that moves towards it faster than 0.05 m/s. Separations are
of parts faster than that; the child may also run into a robot that moves.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools

import numpy as np
from rich.console import Console

from caregiver_mj.children.family import ChildSpec
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from studies.audit import EpisodeLog, NearChild, near_child, strike_times
from study import (
    HOUSES,
    Parser,
    Trial,
    by_house,
    load_house,
    make_console,
    make_table,
    mishaps,
    run_all,
    seeds,
    total,
    write_json,
)

_EPSILONS = (0.5, 0.25, 0.75)
_LASTING = 0.5  # seconds; touches that follow each other more closely are one contact


@dataclasses.dataclass(frozen=True)
class Episode(Trial):
    """How an episode went.

    Attributes:
        epsilon: Of the child.
        adversarial: Whether the child headed for the robot.
        strike_times: When, in seconds: every physics step of a contact that was too fast.
        near: How the robot moved near the child.
        interventions_done: Interventions that were completed.
        blocked: The child's moves into the robot.
    """

    epsilon: float
    adversarial: bool
    strike_times: tuple[float, ...]
    near: NearChild
    interventions_done: int
    blocked: int


@dataclasses.dataclass(frozen=True)
class Job:
    """An episode to run: its house, its seed and what its child is like."""

    house: str
    seed: int
    epsilon: float
    adversarial: bool

    @classmethod
    def of_seed(cls, seed: int) -> Job:
        """With each seed another house, then another epsilon; a novice and an adversary take turns in each."""
        place = seed // 2
        return cls(HOUSES[place % len(HOUSES)], seed, _EPSILONS[place % 9 // 3], bool(seed % 2))


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_trials("episodes", 200)
    parser.add("seconds", 340.0, "simulated seconds, at most")


def run(options: argparse.Namespace) -> None:
    """Run the study; print its table."""
    jobs = [Job.of_seed(seed) for seed in seeds(options)]
    episodes = run_all(functools.partial(supervise, options.seconds), jobs, options.jobs, "supervising")
    report(make_console(), episodes)
    write_json(options.json, episodes)


def supervise(seconds: float, job: Job) -> Episode:
    """Runs an episode, for some simulated seconds at most."""
    child = ChildSpec(job.epsilon, "adversary") if job.adversarial else job.epsilon
    env = load("supervise", load_house(job.house), child, random=job.seed)
    policy = CaregiverPolicy(env)
    log = EpisodeLog.record(env, policy, round(seconds / env.control_timestep()))
    outcome = env.task.outcome()
    return Episode(
        **dataclasses.asdict(job),
        **mishaps(outcome),
        strike_times=tuple(strike_times(log).round(3).tolist()),
        near=near_child(log),
        interventions_done=policy.interventions_done,
        blocked=int(outcome["moves_blocked"]),
    )


def report(console: Console, episodes: list[Episode]) -> None:
    """Prints what came out."""
    title = "Near the child (worst of all episodes; fast: mean seconds an episode above 0.25 m/s within 0.5 m)"
    table = make_table(title, "house", "child", "runs", "strikes", "gap m", "approach m", "fast s",
                       "contact m/s", "blocked", "done", "drops")  # fmt: skip
    for house, group in by_house(episodes).items():
        for child, adversarial in (("novice", False), ("adversarial", True)):
            if found := [episode for episode in group if episode.adversarial == adversarial]:
                table.add_row(house, child, *_figures(found))
    console.print(table)
    for episode in episodes:
        if episode.strike_times:
            child = "adversarial" if episode.adversarial else f"epsilon {episode.epsilon}"
            console.print(
                f"{episode.house}, seed {episode.seed}, {child}: {episode.strikes} strikes, contacts too fast at "
                f"{_contacts(episode.strike_times)} s, {episode.near.contact_speed:.3f} m/s at most",
                highlight=False,
            )


def _figures(episodes: list[Episode]) -> tuple[str, ...]:
    """The table's figures for some episodes."""
    near = [episode.near for episode in episodes]
    return (
        str(len(episodes)),
        total(episodes, "strikes"),
        f"{min(n.separation for n in near):.3f}",
        f"{min(n.approach_separation for n in near):.3f}",
        f"{np.mean([n.fast_seconds for n in near]):.1f}",
        f"{max(n.contact_speed for n in near):.3f}",
        f"{np.mean([episode.blocked for episode in episodes]):.1f}",
        f"{np.mean([episode.interventions_done for episode in episodes]):.1f}",
        total(episodes, "drops"),
    )


def _contacts(times: tuple[float, ...]) -> str:
    """When contacts began, by every physics step of them; one that lasts is told once."""
    pairs = zip((-1.0, *times[:-1]), times, strict=True)
    return ", ".join(f"{time:.2f}" for before, time in pairs if time - before > _LASTING)
