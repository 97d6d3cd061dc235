"""Many trials in the house: how a study is asked for them, runs them, and counts what must not happen in them."""

from __future__ import annotations

import argparse
import dataclasses
import json
import pathlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypedDict, TypeVar

from rich.console import Console
from rich.progress import track

from caregiver_mj.experiments.workers import run_jobs

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclasses.dataclass(frozen=True)
class Trial:
    """What every trial tells.

    Attributes:
        house: Name of the house.
        seed: Seed of all chance in it.
        strikes: Times that the robot struck a child.
        drops: Candles that fell.
    """

    house: str
    seed: int
    strikes: int
    drops: int


AnyTrial = TypeVar("AnyTrial", bound=Trial)


class Mishaps(TypedDict):
    """What of a `Trial` is counted alike in all of them."""

    strikes: int
    drops: int


def mishaps(outcome: Mapping[str, float]) -> Mishaps:
    """A trial's strikes and drops, by a task's outcome."""
    return {"strikes": int(outcome["strikes"]), "drops": int(outcome["candles_dropped"])}


def total(trials: Iterable[Trial], what: str) -> str:
    """Strikes, or drops, of several trials together, as text."""
    return str(sum(getattr(trial, what) for trial in trials))


def by_house(trials: Sequence[AnyTrial]) -> dict[str, list[AnyTrial]]:
    """The trials in each house, and all of them."""
    houses = dict.fromkeys(trial.house for trial in trials)
    return {name: [trial for trial in trials if trial.house == name] for name in houses} | {"all": list(trials)}


# -- Running them ------------------------------------------------------------------------------------


def run_all(function: Callable[[Job], Result], jobs: Sequence[Job], processes: int, doing: str) -> list[Result]:
    """Runs a function over jobs in worker processes, and shows on standard error how far it has got.

    Args:
        function: What to run, as importable from a new process.
        jobs: Hashable jobs.
        processes: How many workers; 1 runs the jobs in this process.
        doing: What is being done, in words.

    Returns:
        Results in the order of the jobs.
    """
    running = run_jobs(function, jobs, processes)
    found = dict(track(running, doing, total=len(jobs), console=Console(stderr=True)))
    return [found[job] for job in jobs]


def add_trials(parser: argparse.ArgumentParser, name: str, count: int) -> None:
    """Adds the options of a study: how many trials (called `--<name>`), `--first`, `--jobs` and `--json`."""
    parser.add_argument(f"--{name}", dest="trials", type=int, default=count, help="how many (default: %(default)s)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="also write all results to a file")
    add_jobs(parser)


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Adds `--jobs`."""
    parser.add_argument("--jobs", type=int, default=2, help="worker processes (default: 2)")


def seeds(options: argparse.Namespace) -> range:
    """The seeds that the options ask for, one for each trial."""
    return range(options.first, options.first + options.trials)


def write_json(options: argparse.Namespace, trials: Iterable[Trial]) -> None:
    """Writes all results to a file, if the options ask for one."""
    if options.json:
        rows = [dataclasses.asdict(trial) for trial in trials]
        options.json.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
