"""How the robot moves near the child: whole episodes in three houses, half of them with a child that heads for it.

A strike is a contact of the child with a part of the robot that moves towards it faster than 0.05 m/s. Separations are
of parts faster than that; the child may also run into a robot that moves.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import json
import pathlib

import numpy as np
from display import make_console, make_table
from houses import three_houses
from rich.progress import track

import caregiver_mj
from caregiver_mj.children.family import ChildSpec
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.recording.telemetry import NearChild, Recorder, near_child, strike_times

_EPSILONS = (0.5, 0.25, 0.75)


@dataclasses.dataclass(frozen=True)
class Episode:
    """How an episode went.

    Attributes:
        house: Name of the house.
        seed: Its seed.
        epsilon: Of the child.
        adversarial: Whether the child headed for the robot.
        strikes: Times that the robot struck the child.
        strike_times: When, in seconds: every physics step of a contact that was too fast.
        near: How the robot moved near the child.
        interventions_done: Interventions that were completed.
        blocked: The child's moves into the robot.
        dropped: Candles that fell.
    """

    house: str
    seed: int
    epsilon: float
    adversarial: bool
    strikes: int
    strike_times: tuple[float, ...]
    near: NearChild
    interventions_done: int
    blocked: int
    dropped: int


@dataclasses.dataclass(frozen=True)
class Job:
    """An episode to run: the number of its house, its seed and what its child is like."""

    house: int
    seed: int
    epsilon: float
    adversarial: bool


def run(seconds: float, job: Job) -> Episode:
    """Runs an episode."""
    plan = three_houses()[job.house]
    child = ChildSpec(job.epsilon, "adversary") if job.adversarial else job.epsilon
    env = caregiver_mj.load("supervise", plan, child, random=job.seed)
    policy = caregiver_mj.CaregiverPolicy(env)
    timestep = env.reset()
    with Recorder(env) as recorder:
        while not timestep.last() and env.physics.time() < seconds:
            timestep = env.step(policy(timestep))
    log = recorder.log()
    figures = env.task.outcome()
    return Episode(
        house=plan.name,
        seed=job.seed,
        epsilon=job.epsilon,
        adversarial=job.adversarial,
        strikes=int(figures["strikes"]),
        strike_times=tuple(strike_times(log).round(3).tolist()),
        near=near_child(log),
        interventions_done=policy.interventions_done,
        blocked=int(figures["moves_blocked"]),
        dropped=int(figures["candles_dropped"]),
    )


def report(results: list[Episode]) -> None:
    """Prints what came out."""
    console = make_console()
    title = "Near the child (worst of all episodes; fast: mean seconds an episode above 0.25 m/s within 0.5 m)"
    table = make_table(title, "house", "child", "runs", "strikes", "gap m", "approach m", "fast s",
                       "contact m/s", "blocked", "done", "drops")  # fmt: skip
    houses = dict.fromkeys(row.house for row in results)
    for name, adversarial in ((name, adversarial) for name in (*houses, None) for adversarial in (False, True)):
        rows = [row for row in results if name in (row.house, None) and row.adversarial == adversarial]
        if not rows:
            continue
        near = [row.near for row in rows]
        table.add_row(
            name or "all",
            "adversarial" if adversarial else "novice",
            str(len(rows)),
            str(sum(row.strikes for row in rows)),
            f"{min(n.separation for n in near):.3f}",
            f"{min(n.approach_separation for n in near):.3f}",
            f"{np.mean([n.fast_seconds for n in near]):.1f}",
            f"{max(n.contact_speed for n in near):.3f}",
            f"{np.mean([row.blocked for row in rows]):.1f}",
            f"{np.mean([row.interventions_done for row in rows]):.1f}",
            str(sum(row.dropped for row in rows)),
        )
    console.print(table)
    for row in results:
        if row.strike_times:
            # A contact that lasts is told once.
            pairs = zip((-1.0, *row.strike_times[:-1]), row.strike_times, strict=True)
            times = [time for before, time in pairs if time - before > 0.5]
            child = "adversarial" if row.adversarial else f"epsilon {row.epsilon}"
            when = ", ".join(f"{time:.2f}" for time in times)
            console.print(
                f"{row.house}, seed {row.seed}, {child}: {row.strikes} strikes, contacts too fast at {when} s, "
                f"{row.near.contact_speed:.3f} m/s at most",
                highlight=False,
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=200, help="episodes (default: 200)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first (default: 0)")
    parser.add_argument("--seconds", type=float, default=340.0, help="simulated seconds (default: whole episodes)")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes (default: 2)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write all results to a file")
    args = parser.parse_args()
    jobs = [
        Job(i // 2 % len(three_houses()), i, _EPSILONS[i // 2 % 9 // 3], bool(i % 2))
        for i in range(args.first, args.first + args.episodes)
    ]
    found = run_jobs(functools.partial(run, args.seconds), jobs, args.jobs)
    results = [result for _, result in track(found, "supervising", total=len(jobs))]
    results.sort(key=lambda result: result.seed)
    report(results)
    if args.json:
        rows = [dataclasses.asdict(result) for result in results]
        args.json.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
