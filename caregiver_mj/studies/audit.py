"""Whether the robot kept its limits: runs an episode, or reads a logged one, and prints the worst of each."""

from __future__ import annotations

import argparse
import pathlib

from rich.console import Console

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.audit import Check, NearChild, check_limits, near_child
from caregiver_mj.recording.telemetry import EpisodeLog
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.studies.display import make_console, make_table
from caregiver_mj.tasks import load


def report(console: Console, seconds: float, checks: list[Check], near: NearChild) -> None:
    """Prints what came out for an episode of so many seconds."""
    table = make_table(f"Limits in {seconds:.0f} s", "", "worst", "limit", "unit", "ratio", "where", "at s")
    for check in checks:
        row = (check.name, f"{check.worst:.4g}", f"{check.limit:.4g}", check.unit, f"{check.ratio:.3f}", check.where)
        table.add_row(*row, f"{check.time:.2f}", style="" if check.ratio <= 1 else "bold red")
    console.print(table)
    console.print(
        f"Near the child: a moving part came to {near.separation:.3f} m, one that moved towards it to "
        f"{near.approach_separation:.3f} m.\n"
        f"Within 0.5 m a part was faster than 0.25 m/s for {near.fast_seconds:.1f} s; contacts at "
        f"{near.contact_speed:.3f} m/s at most."
    )


def main(arguments: list[str] | None = None) -> int:
    """Audits an episode; returns the exit status, which is 1 if a limit was not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--house", default="paper", help="name or file of a floor plan (default: paper)")
    parser.add_argument("--epsilon", type=float, default=0.5, help="share of the novice's moves that are random")
    parser.add_argument("--seed", type=int, default=0, help="seed of the episode")
    parser.add_argument("--seconds", type=float, default=340.0, help="simulated seconds (default: a whole episode)")
    parser.add_argument("--embodiment", metavar="NAME", help="the robot (default: the task's own)")
    parser.add_argument("--save", type=pathlib.Path, metavar="FILE.npz", help="keep the log of the episode")
    parser.add_argument("--log", type=pathlib.Path, metavar="FILE.npz", help="read a log instead of running an episode")
    options = parser.parse_args(arguments)
    if options.log:
        log = EpisodeLog.load(options.log)
    else:
        task_kwargs = {"embodiment": options.embodiment} if options.embodiment else None
        env = load("supervise", options.house, options.epsilon, random=options.seed, task_kwargs=task_kwargs)
        log = EpisodeLog.record(env, CaregiverPolicy(env), round(options.seconds / env.control_timestep()))
    if options.save:
        log.save(options.save)
    checks = check_limits(log, find_embodiment(options.embodiment))
    report(make_console(), len(log.commands) * log.control_timestep, checks, near_child(log))
    return int(any(check.ratio > 1 for check in checks))
