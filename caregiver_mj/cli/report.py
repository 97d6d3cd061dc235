"""`caregiver-mj report`: makes a page of a finished run."""

from __future__ import annotations

import argparse


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    command = commands.add_parser(
        "report",
        help="write a page about finished runs: tables, figures, maps, film",
        description="Write report.html, tables.md and figures/ into DIR.",
    )
    command.add_argument(
        "folders",
        nargs="+",
        metavar="DIR",
        help="folder of a run; more, of other worlds or houses, are shown beside it",
    )
    film = command.add_mutually_exclusive_group()
    film.add_argument("--video", metavar="FILE.mp4", help="film to show (default: the first in a DIR)")
    film.add_argument("--render", action="store_true", help="film episode 0 of the run in the house: DIR/report.mp4")
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz import report  # takes seconds to import, for pandas, scipy and matplotlib

    print(report.write_report(arguments.folders, arguments.video, render=arguments.render))
