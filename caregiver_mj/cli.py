"""The command `caregiver-mj`.

Exit status: 0 done, 2 bad input (one line that says what and where), 1 anything else.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shlex
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

import rich.box
import rich.console
import rich.progress
import rich.table
import rich.text

from caregiver_mj.caregivers.caregiver import CAREGIVERS
from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError, RenderingError
from caregiver_mj.experiments import evaluation
from caregiver_mj.experiments.run_folder import RunFolder, StorageError
from caregiver_mj.experiments.workers import WorkerError
from caregiver_mj.plans import floor_plan, symbols
from caregiver_mj.plans.floor_plan import FloorPlan

PROGRAM = "caregiver-mj"

# How `house show` paints each kind of cell: rich style, and what to call it (one, several).
_CELLS = {
    symbols.WALL: ("white on grey30", "wall", "walls"),
    symbols.FREE: ("grey50", "free cell", "free cells"),
    symbols.STAIRWELL: ("bold white on red3", "stairwell", "stairwells"),
    symbols.CANDLE: ("bold black on orange1", "table with a candle", "tables with a candle"),
    symbols.TABLE: ("black on tan", "bare table", "bare tables"),
    symbols.BIN: ("bold white on green4", "toy bin", "toy bins"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command.

    Args:
        argv: Arguments without the program's name; those of the process by default.

    Returns:
        The exit status.
    """
    argv = list(sys.argv[1:] if argv is None else argv)
    try:
        arguments = _parser().parse_args(argv)
        arguments.argv = argv
        arguments.run(arguments)
        sys.stdout.flush()
    except (RenderingError, StorageError, WorkerError) as error:
        return _fail(error, 1)
    except CaregiverError as error:
        return _fail(error, 2)
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return _fail("interrupted", 1)
    return 0


def _fail(error: object, status: int) -> int:
    message = str(error)
    if status == 2:  # one line, whatever the name of a file may hold
        message = " ".join(message.split())
    print(f"{PROGRAM}: {message}", file=sys.stderr)
    return status


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others."""

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix(PROGRAM).strip()
        raise CaregiverError(f"{command}: {message}" if command else message)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog=PROGRAM, description="A robot caregiver, a toddler, and a house with stairs and candles.")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    command = commands.add_parser(
        "evaluate",
        help="run caregivers against novices and print the table",
        description="Runs every caregiver against every novice. Episode i has the same novice under all of them.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    command.add_argument("--world", default="house", help="house (physical) or grid (the paper's)")
    _add_house(command)
    command.add_argument("--caregiver", nargs="+", default=["none", "paper"], metavar="NAME", help=" ".join(CAREGIVERS))
    command.add_argument(
        "--epsilon", nargs="+", type=float, default=evaluation.EPSILONS, help="the novices' shares of random moves"
    )
    command.add_argument("--episodes", type=int, default=20, metavar="N", help="for each caregiver and novice")
    _add_seed(command)
    command.add_argument("--jobs", type=int, default=1, metavar="N", help="worker processes")
    command.add_argument("--out", metavar="DIR", help="where to keep the episodes and the table")
    command.add_argument("--resume", action="store_true", help="continue the run that is in DIR, if there is one")
    command.add_argument("--json", action="store_true", help="print the table as JSON, and it alone")
    command.set_defaults(run=_evaluate)

    command = commands.add_parser(
        "render",
        help="film an episode in the physical house",
        description="Films an episode of the run that `evaluate` does with the same seed, children and caregiver.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    command.add_argument("--task", default="supervise", help="name of the task")
    _add_house(command)
    command.add_argument(
        "--epsilon", default="0.5", help="the novice's share of random moves; of several children, as in 1,.25"
    )
    command.add_argument("--caregiver", default="paper", metavar="NAME", help=" ".join(CAREGIVERS))
    _add_seed(command, "of the run to which the episode belongs")
    command.add_argument("--episode", type=int, default=0, metavar="N", help="its number in that run")
    command.add_argument("--seconds", type=float, default=30.0, help="length of the film at most")
    command.add_argument("--out", required=True, metavar="FILE.mp4", help="the film")
    command.add_argument("--still", metavar="FILE.png", help="also a picture of a telling moment")
    command.set_defaults(run=_render)

    command = commands.add_parser(
        "report",
        help="make a page of a finished run: tables, figures, maps, film",
        description="Writes report.html, tables.md and figures/ into DIR.",
    )
    command.add_argument("folders", nargs="+", metavar="DIR", help="of a run; more, of other worlds, are set beside it")
    film = command.add_mutually_exclusive_group()
    film.add_argument("--video", metavar="FILE.mp4", help="the film to show; else the first in a DIR, if there is one")
    film.add_argument("--render", action="store_true", help="film episode 0 of the run in the house: DIR/report.mp4")
    command.set_defaults(run=_report)

    house = commands.add_parser("house", help="look at a floor plan")
    plans = house.add_subparsers(metavar="show|check", required=True)
    for name, run, text in (
        ("show", _house_show, "print a floor plan in colour, with its objects counted"),
        ("check", _house_check, "say whether a floor plan is valid"),
    ):
        command = plans.add_parser(name, help=text, description=text)
        command.add_argument("house", metavar="NAME|FILE", help=_houses())
        command.set_defaults(run=run)
    return parser


def _add_house(command: argparse.ArgumentParser) -> None:
    command.add_argument("--house", default="paper", metavar="NAME|FILE", help=_houses())


def _houses() -> str:
    return f"{', '.join(floor_plan.house_names())}, or a text file"


def _add_seed(command: argparse.ArgumentParser, text: str = "all chance comes from it") -> None:
    command.add_argument("--seed", type=int, default=0, help=text)


# -- evaluate ----------------------------------------------------------------------------------------


def _evaluate(arguments: argparse.Namespace) -> None:
    settings = evaluation.Settings(
        plan=FloorPlan.load(arguments.house),
        world=arguments.world,
        caregivers=tuple(dict.fromkeys(arguments.caregiver)),
        epsilons=tuple(dict.fromkeys(arguments.epsilon)),
        episodes=arguments.episodes,
        seed=arguments.seed,
    )
    settings.check()
    if arguments.jobs < 1:
        raise CaregiverError(f"jobs must be at least 1, not {arguments.jobs}")
    if arguments.resume and arguments.out is None:
        raise CaregiverError("--resume needs the folder of the run: --out DIR")
    folder = None
    if arguments.out is not None:
        folder = RunFolder(arguments.out, settings.record(), resume=arguments.resume)
    finished = 0
    total = len(settings.caregivers) * len(settings.epsilons) * settings.episodes
    errors = rich.console.Console(stderr=True)
    columns = (
        rich.progress.TextColumn("{task.description}"),
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeElapsedColumn(),
        rich.progress.TimeRemainingColumn(),
    )
    try:
        with rich.progress.Progress(*columns, console=errors) as bar:
            task = bar.add_task("episodes", total=total)

            def progress(episodes: int) -> None:
                nonlocal finished
                finished += episodes
                bar.update(task, advance=episodes)

            result = evaluation.evaluate(settings, folder, jobs=arguments.jobs, progress=progress)
    except (KeyboardInterrupt, StorageError, WorkerError) as error:
        if folder is None:
            raise
        again = arguments.argv if arguments.resume else [*arguments.argv, "--resume"]
        what = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        raise StorageError(
            f"{what}; {finished} of {total} episodes are kept in '{folder.path}', "
            f"go on with: {PROGRAM} {shlex.join(again)}"
        ) from None
    output = rich.console.Console(stderr=arguments.json)
    if not output.is_terminal:
        output.width = 120  # a pipe or a file has no width to fit
    output.print(_table(result.summary))
    if arguments.json:
        print(json.dumps(result.summary, indent=1, allow_nan=False))


def _table(summary: dict[str, Any]) -> rich.table.Table:
    """The readable form of summary.json."""
    first = summary["rows"][0]
    episodes = f"{first['episodes']} episodes each" if first["episodes"] > 1 else "1 episode each"
    table = rich.table.Table(
        title=f"{first['world']} '{first['house']}', {episodes}, seed {summary['seed']}",
        caption="mean ± standard deviation; left: damage over that of 'none'",
        box=rich.box.SIMPLE_HEAD,
    )
    table.add_column("epsilon", justify="right", no_wrap=True)
    table.add_column("caregiver", no_wrap=True)
    for title in ("damage", "normalised", "left", "timesteps", "cells", "toys", "blocked", "done"):
        table.add_column(title, justify="right", no_wrap=True)
    left = {(row["caregiver"], row["epsilon"]): row["damage_left"] for row in _against_none(summary)}
    for i, row in enumerate(rows := summary["rows"]):
        ratio = 1.0 if row["caregiver"] == "none" else left.get((row["caregiver"], row["epsilon"]))
        table.add_row(
            f"{row['epsilon']:g}",
            row["caregiver"],
            f"{row['damage_mean']:.1f} ± {row['damage_sd']:.1f}",
            f"{row['damage_normalised_mean']:.2f}",
            "" if ratio is None else f"{ratio:.2f}",
            *(
                f"{row[f'{column}_mean']:.1f}"
                for column in ("timesteps_to_threshold", "cells_visited", "toys_reached", "moves_blocked")
            ),
            f"{row['interventions_done_mean']:.1f}",
            end_section=i + 1 < len(rows) and rows[i + 1]["epsilon"] != row["epsilon"],
        )
    return table


def _against_none(summary: dict[str, Any]) -> list[dict[str, Any]]:
    return [row for row in summary["comparisons"] if row["baseline"] == "none"]


# -- render ------------------------------------------------------------------------------------------


def _render(arguments: argparse.Namespace) -> None:
    plan = FloorPlan.load(arguments.house)
    family = Family.parse(arguments.epsilon)
    if arguments.caregiver not in CAREGIVERS:
        raise CaregiverError(f"no caregiver '{arguments.caregiver}': there are {', '.join(CAREGIVERS)}")
    if arguments.seed < 0 or arguments.episode < 0:
        raise CaregiverError(f"seed and episode must not be negative: {arguments.seed}, {arguments.episode}")
    if not (arguments.seconds > 0 and math.isfinite(arguments.seconds)):
        raise CaregiverError(f"seconds must be a positive length, not {arguments.seconds}")

    from caregiver_mj.viz import film  # here, for it takes seconds to import

    film.render_episode(
        arguments.out,
        task=arguments.task,
        house=plan,
        epsilon=family,
        seed=arguments.seed,
        episode=arguments.episode,
        seconds=arguments.seconds,
        caregiver=arguments.caregiver,
        still=arguments.still,
    )
    print(arguments.out)


# -- report ------------------------------------------------------------------------------------------


def _report(arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz import report  # takes seconds to import, for pandas, scipy and matplotlib

    print(report.write_report(arguments.folders, arguments.video, render=arguments.render))


# -- house -------------------------------------------------------------------------------------------


def _house_show(arguments: argparse.Namespace) -> None:
    plan = FloorPlan.load(arguments.house)
    text = rich.text.Text()
    for row in plan.rows:
        for kind in row:
            text.append(f"{kind} ", _CELLS[kind][0])  # two characters are about square
        text.append("\n")
    for kind, (style, one, several) in _CELLS.items():
        count = len(plan.cells_of(kind))
        text.append(f"\n{kind} ", style)
        text.append(f" {count} {one if count == 1 else several}")
    height, width = plan.shape
    size = f"{width * plan.cell_size:g} m x {height * plan.cell_size:g} m, {plan.cell_size:g} m a cell"
    console = rich.console.Console()
    console.print(f"{plan.name}: {width} x {height} cells, {size}\n", highlight=False, markup=False)
    console.print(text, soft_wrap=True)


def _house_check(arguments: argparse.Namespace) -> None:
    plan = FloorPlan.load(arguments.house)
    height, width = plan.shape
    counts = []
    for kind, (_, one, several) in _CELLS.items():
        count = len(plan.cells_of(kind))
        if kind != symbols.WALL:
            counts.append(f"{count} {one if count == 1 else several}")
    print(f"OK: {plan.name}, {width} x {height} cells, {', '.join(counts)}")
