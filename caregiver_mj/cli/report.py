"""`caregiver-mj report`: makes a page of a finished run."""

from __future__ import annotations

import argparse
import os


def add_to(commands: argparse._SubParsersAction) -> None:
    """Adds the command."""
    command = commands.add_parser(
        "report",
        help="make a page of a finished run: tables, figures, maps, film",
        description="Writes report.html, tables.md and figures/ into DIR.",
    )
    command.add_argument("folders", nargs="+", metavar="DIR", help="of a run; more, of other worlds, are set beside it")
    film = command.add_mutually_exclusive_group()
    film.add_argument("--video", metavar="FILE.mp4", help="the film to show; else the first in a DIR, if there is one")
    film.add_argument("--render", action="store_true", help="film the house first, into DIR/report.mp4")
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz import report  # takes seconds to import, for pandas, scipy and matplotlib

    film = arguments.video
    if arguments.render:
        run, *_ = [report.read_run(folder) for folder in arguments.folders]  # all, before it takes a minute
        film = os.path.join(arguments.folders[0], "report.mp4")
        from caregiver_mj.viz import film as films

        films.render_episode(film, house=run.plan, caregiver=run.caregiver, seed=run.settings["seed"], **report.FILM)
    print(report.write_report(arguments.folders, film))
