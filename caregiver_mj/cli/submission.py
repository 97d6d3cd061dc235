"""`caregiver-mj submit`, `verify` and `leaderboard`: a run as one file, what comes of its answers, and all of them."""

from __future__ import annotations

import argparse
import pathlib
from typing import TYPE_CHECKING

from caregiver_mj.cli import parsing
from caregiver_mj.errors import CaregiverError
from caregiver_mj.viz import progress_bar

if TYPE_CHECKING:
    import pandas as pd

    from caregiver_mj.experiments.submission import Submission
    from caregiver_mj.experiments.workers import Executor


def add_submit(command: argparse.ArgumentParser) -> None:
    """Add the options of `submit`."""
    command.set_defaults(run=_submit)
    command.description = "Pack a finished run, and what its caregivers answered, into one file."
    command.add_argument("folder", metavar="DIR", help="folder of the run")
    command.add_argument("--out", required=True, metavar="FILE.submission", help="file to write")
    command.add_argument("--title", default="", metavar="TEXT", help="what it is to be called")
    command.add_argument("--authors", default="", metavar="TEXT", help="whose it is")
    command.add_argument("--notes", default="", metavar="TEXT", help="what there is to know about it")


def add_verify(command: argparse.ArgumentParser) -> None:
    """Add the options of `verify`."""
    command.set_defaults(run=_verify)
    command.description = "Give the answers of a file again, with no caregiver present: every row has to come back."
    command.add_argument("files", nargs="+", metavar="FILE.submission", help="file to verify")
    parsing.add_executor(command)


def add_leaderboard(command: argparse.ArgumentParser) -> None:
    """Add the options of `leaderboard`."""
    command.set_defaults(run=_leaderboard)
    command.description = "Verify all files of a folder, and print a table for each track in Markdown."
    command.add_argument("folder", metavar="DIR", help="folder with FILE.submission")
    parsing.add_executor(command)


def _submit(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.submission import submit  # needs pandas, a second to import

    submit(arguments.folder, arguments.out, {key: getattr(arguments, key) for key in ("title", "authors", "notes")})
    print(arguments.out)


def _verify(arguments: argparse.Namespace) -> None:
    with parsing.make_executor(arguments) as executor:
        for path in arguments.files:
            submission, episodes = _verified(path, executor)
            print(f"{submission.path}: verified, episodes: {len(episodes)}")


def _leaderboard(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.submission import SUFFIX, board

    paths = sorted(pathlib.Path(arguments.folder).glob(f"*{SUFFIX}"))
    if not paths:
        raise CaregiverError(f"'{arguments.folder}' must hold at least 1 FILE{SUFFIX}, got none")
    with parsing.make_executor(arguments) as executor:
        print(board([_verified(path, executor) for path in paths]), end="")


def _verified(path: str | pathlib.Path, executor: Executor) -> tuple[Submission, pd.DataFrame]:
    from caregiver_mj.experiments.submission import read_submission, verify

    submission = read_submission(path)
    with progress_bar() as bar:
        task = bar.add_task("verified", total=sum(map(len, submission.results)))
        return submission, verify(submission, executor, lambda count: bar.advance(task, count))
