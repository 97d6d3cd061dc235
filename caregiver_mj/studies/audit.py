"""Whether the robot kept its limits: runs episodes, or reads a logged one, and prints the worst of each.

Two tables: what was commanded, and what was measured at every physics step. The exit status is 1 if a limit was not
kept.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.audit import Check, NearChild, check_limits, near_child
from caregiver_mj.recording.motion_audit import check_motion, off_a_pad, pushed
from caregiver_mj.recording.telemetry import EpisodeLog
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.studies.display import make_console, make_table
from caregiver_mj.studies.houses import load_house
from caregiver_mj.studies.trials import add_jobs, run_all
from caregiver_mj.tasks import load


@dataclasses.dataclass(frozen=True)
class Conditions:
    """What all episodes of an audit have in common.

    Attributes:
        epsilon: Share of the novice's moves that are random.
        seconds: Simulated seconds, at most.
        embodiment: Name of the robot; None for the task's own.
        save: Where to keep the log, if anywhere.
    """

    epsilon: float
    seconds: float
    embodiment: str | None
    save: pathlib.Path | None


@dataclasses.dataclass(frozen=True)
class Audit:
    """What came out for one episode, or for several.

    Attributes:
        seconds: How long it was.
        commanded: Limits of what was commanded.
        measured: Limits of what was measured.
        near: How the robot moved near the child.
        pushed: Seconds in which a child ran into it, or had just done so, whose accelerations do not count.
        off: Seconds in which a pad was off the candle in the hand for a moment, see `check_motion`.
    """

    seconds: float
    commanded: list[Check]
    measured: list[Check]
    near: NearChild
    pushed: float
    off: float = 0.0

    @classmethod
    def of(cls, log: EpisodeLog, embodiment: str | None, name: str = "") -> Audit:
        """Audits an episode, which may have a name to be told by."""
        robot = find_embodiment(embodiment)
        commanded, measured = (
            [dataclasses.replace(found, where=", ".join(filter(None, (found.where, name)))) for found in checks]
            for checks in (check_limits(log, robot), check_motion(log, robot))
        )
        left_out = (float(found(log).sum() * log.physics_timestep) for found in (pushed, off_a_pad))
        return cls(len(log.commands) * log.control_timestep, commanded, measured, near_child(log), *left_out)

    @classmethod
    def of_dict(cls, values: Mapping[str, Any]) -> Audit:
        """The audit that `dataclasses.asdict` has made a dictionary of."""
        commanded, measured = ([Check(**check) for check in values[which]] for which in ("commanded", "measured"))
        return cls(values["seconds"], commanded, measured, NearChild(**values["near"]), values["pushed"], values["off"])

    @property
    def is_kept(self) -> bool:
        """Whether the robot kept all of its limits."""
        return all(check.ratio <= 1 for check in (*self.commanded, *self.measured))

    @classmethod
    def worst_of(cls, audits: Sequence[Audit]) -> Audit:
        """The worst of every limit of several episodes, and their times together."""
        near = [audit.near for audit in audits]
        return cls(
            sum(audit.seconds for audit in audits),
            _worst([audit.commanded for audit in audits]),
            _worst([audit.measured for audit in audits]),
            NearChild(
                min(n.separation for n in near),
                min(n.approach_separation for n in near),
                sum(n.fast_seconds for n in near),
                max(n.contact_speed for n in near),
            ),
            sum(audit.pushed for audit in audits),
            sum(audit.off for audit in audits),
        )


def _worst(audits: Sequence[list[Check]]) -> list[Check]:
    return [max(checks, key=lambda check: check.ratio) for checks in zip(*audits, strict=True)]


def run(conditions: Conditions, job: tuple[str, int]) -> Audit:
    """Audits the episode of a house and a seed."""
    house, seed = job
    task_kwargs = {"embodiment": conditions.embodiment} if conditions.embodiment else None
    env = load("supervise", load_house(house), conditions.epsilon, random=seed, task_kwargs=task_kwargs)
    log = EpisodeLog.record(env, CaregiverPolicy(env), round(conditions.seconds / env.control_timestep()))
    if conditions.save:
        log.save(conditions.save)
    return Audit.of(log, conditions.embodiment, f"{house} {seed}")


def report(console: Console, audit: Audit) -> None:
    """Prints what came out."""
    for what, checks in (("commanded", audit.commanded), ("measured", audit.measured)):
        table = make_table(
            f"Limits in {audit.seconds:.0f} s: {what}", "", "worst", "limit", "unit", "ratio", "where", "at s"
        )
        for check in checks:
            row = (check.name, f"{check.worst:.4g}", f"{check.limit:.4g}", check.unit, f"{check.ratio:.3f}")
            table.add_row(*row, check.where, f"{check.time:.2f}", style="" if check.ratio <= 1 else "bold red")
        console.print(table)
    near = audit.near
    console.print(
        f"Near the child: a moving part came to {near.separation:.3f} m, one that moved towards it to "
        f"{near.approach_separation:.3f} m.\n"
        f"Within 0.5 m a part was faster than 0.25 m/s for {near.fast_seconds:.1f} s; contacts at "
        f"{near.contact_speed:.3f} m/s at most.\n"
        f"For {audit.pushed:.1f} s it was being pushed by the child, or had just been: left out of what was measured "
        "of accelerations, jerks and balance.\n"
        f"For {audit.off:.2f} s a pad was off the candle in the hand for a moment, or had just been: left out of "
        "accelerations and jerks over 5 ms; those over 20 ms count."
    )


def main(arguments: list[str] | None = None) -> int:
    """Audits episodes; returns the exit status, which is 1 if a limit was not kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--house", nargs="+", default=["paper"], help="names or files of floor plans (default: paper)")
    parser.add_argument("--epsilon", type=float, default=0.5, help="share of the novice's moves that are random")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first episode in each house")
    parser.add_argument("--episodes", type=int, default=1, help="how many in each house (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=340.0, help="simulated seconds (default: a whole episode)")
    parser.add_argument("--embodiment", metavar="NAME", help="the robot (default: the task's own)")
    parser.add_argument("--save", type=pathlib.Path, metavar="FILE.npz", help="keep the log, of a single episode")
    parser.add_argument("--log", type=pathlib.Path, metavar="FILE.npz", help="read a log instead of running an episode")
    add_jobs(parser)
    options = parser.parse_args(arguments)
    if options.log:
        audit = Audit.of(EpisodeLog.load(options.log), options.embodiment)
    else:
        jobs = [(house, options.seed + i) for house in options.house for i in range(options.episodes)]
        if options.save and len(jobs) > 1:
            parser.error("--save is for a single episode")
        conditions = Conditions(options.epsilon, options.seconds, options.embodiment, options.save)
        processes = min(options.jobs, len(jobs))
        audit = Audit.worst_of(run_all(functools.partial(run, conditions), jobs, processes, "auditing"))
    report(make_console(), audit)
    return int(not audit.is_kept)
