"""Commands on finished runs, and the printed tables of all commands.

`caregiver-mj report`, `compare` and `pool` report, compare and pool runs; `submit`, `verify` and `leaderboard` pack a
run as a file, verify such files, and rank them.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import pathlib
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import rich.box
import rich.console
import rich.table
import rich.text

from caregiver_mj.cli import parsing
from caregiver_mj.errors import CaregiverError
from caregiver_mj.outside import plain, visible
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import progress_bar

if TYPE_CHECKING:
    import pandas as pd

    from caregiver_mj.experiments.submission import Submission
    from caregiver_mj.experiments.workers import Executor

_TITLES = {  # titles of columns, and short forms
    "damage": "damage", "normalised": "norm", "left": "left", "score": "score", "timesteps": "steps", "cells": "cells",
    "toys": "toys", "blocked": "block", "done": "done",
}  # fmt: skip
_LEFT_ALIGNED = ("caregiver", "quantity", "verdict", "worst: house")  # columns; others are right-aligned
_HARM = "harm"  # verdict to print in red
_LONGEST = 120  # characters of a setting that differs in two runs
_WIDEST = 10_000  # characters; wider than any line
_COLUMNS = ("timesteps_to_threshold", "cells_visited", "toys_reached", "moves_blocked", "interventions_done")


def add_report(command: argparse.ArgumentParser) -> None:
    """Add the options of `report`."""
    command.set_defaults(run=_report)
    command.description = "Write report.html, tables.md and figures/ into DIR."
    text = "folder of a run; further ones, of other worlds or houses, are shown beside it"
    command.add_argument("folders", nargs="+", metavar="DIR", help=text)
    film = command.add_mutually_exclusive_group()
    film.add_argument("--video", metavar="FILE.mp4", help="film to show (default: the first in a DIR)")
    film.add_argument("--render", action="store_true", help="film episode 0 of the run in the house: DIR/report.mp4")
    text = "caregiver to report on, beside the others (default: the paper's rule, or the first one that acts)"
    parsing.add(command, "--caregiver", default="", help=text)
    parsing.add(command, "--trust")


def add_compare(command: argparse.ArgumentParser) -> None:
    """Add the options of `compare`."""
    command.set_defaults(run=_compare)
    for name in ("first", "second"):
        command.add_argument(name, metavar=name.upper(), help=f"folder of the {name} run")
    text = "caregiver in the first run, and in the second if different"
    parsing.add(command, "--caregiver", nargs="+", default=(), help=text)
    parsing.add(command, "--json")


def add_pool(command: argparse.ArgumentParser) -> None:
    """Add the options of `pool`."""
    command.set_defaults(run=_pool)
    text = "folder of a run; all settings but the seed must be the same"
    command.add_argument("folders", nargs="+", metavar="DIR", help=text)
    command.add_argument("--out", required=True, metavar="DIR", help="folder for the episodes and the table")
    parsing.add(command, "--json")


def add_submit(command: argparse.ArgumentParser) -> None:
    """Add the options of `submit`."""
    command.set_defaults(run=_submit)
    command.add_argument("folder", metavar="DIR", help="folder of the run")
    command.add_argument("--out", required=True, metavar="FILE.submission", help="new file to write")
    command.add_argument("--title", default="", metavar="TEXT", help="title of the submission")
    command.add_argument("--authors", default="", metavar="TEXT", help="its authors")
    command.add_argument("--notes", default="", metavar="TEXT", help="further notes")


def add_verify(command: argparse.ArgumentParser) -> None:
    """Add the options of `verify`."""
    command.set_defaults(run=_verify)
    command.add_argument("files", nargs="+", metavar="FILE.submission", help="file to verify")
    parsing.add(command, "--trust", *parsing.WORKERS)


def add_leaderboard(command: argparse.ArgumentParser) -> None:
    """Add the options of `leaderboard`."""
    command.set_defaults(run=_leaderboard)
    command.add_argument("folder", metavar="DIR", help="folder with FILE.submission")
    parsing.add(command, "--trust", *parsing.WORKERS)


def _report(arguments: argparse.Namespace) -> None:
    from caregiver_mj.viz import report  # takes seconds to import, for pandas, scipy and matplotlib

    options = {name: getattr(arguments, name) for name in ("caregiver", "render", "trust")}
    print(report.write_report(arguments.folders, arguments.video, **options))


def _compare(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.finished import compare_runs, read_finished  # need pandas, a second to import

    folders = [arguments.first, arguments.second]
    first, second = map(read_finished, folders)
    found = compare_runs(first, second, arguments.caregiver)
    console = output(arguments.json)
    print_comparison(found, folders, console)
    print_verdicts(found["verdicts"], console)
    for key, values in found["settings"].items():
        ours, theirs = (_only(*pair) for pair in (values, values[::-1]))
        console.print(plain(f"not the same: {key}, {ours} and {theirs}"), markup=False, highlight=False)
    if arguments.json:
        print(json.dumps(found, indent=1, allow_nan=False))


def _only(value: Any, other: Any) -> str:
    """Return a value as text; for lists, the elements that are not in the other."""
    if isinstance(value, list) and isinstance(other, list):
        value = ", ".join(str(one) for one in value if one not in other) or "no more"
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def print_comparison(found: dict[str, Any], folders: list[str], console: rich.console.Console) -> None:
    """Print the result of `compare_runs` for two folders."""
    from caregiver_mj.experiments.verdicts import MARGINS, Verdict  # bring SciPy

    first, rows = found["rows"][0], []
    for row in found["rows"]:
        verdict = row["damage_verdict"]
        if verdict == Verdict.NONE and row.get("damage_equivalence") == Verdict.EQUIVALENT:
            verdict = Verdict.EQUIVALENT.value
        cells = {
            "epsilon": row["family"],
            "caregiver": ", ".join(dict.fromkeys((row["baseline"], row["caregiver"]))),
            "pairs": str(row["episodes"]),
            "first": f"{row['first']:.2f}",
            "second": f"{row['second']:.2f}",
            "difference": _with_ends(row, "damage_difference", "_mean"),
            "p": "" if (p := row["damage_p"]) is None else f"{p:.3f}" if p >= 0.001 else "<.001",
            "verdict": verdict,
        }
        rows.append(cells)
    title = f"{first['world']} {_where(first)}: second ({folders[1]}) less first ({folders[0]})"
    legend = (
        "epsilon: share of random moves; pairs: episodes that both have; first, second: mean damage in these; "
        "difference: its mean, and in brackets the 95 % interval of that; p: of a row alone; verdict: with Holm's "
        f"correction for all rows; equivalent: neither less than the other by {MARGINS['damage']:.0%}"
    )
    print_rows(console, title, legend, rows)


def _where(row: dict[str, Any]) -> str:
    return row["house"] if "houses" in row else f"'{row['house']}'"


def _pool(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.finished import pool_runs, read_finished  # need pandas, a second to import

    print_summary(pool_runs([read_finished(folder) for folder in arguments.folders], arguments.out), arguments.json)


def _submit(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.submission import submit  # needs pandas, a second to import

    card = {key: getattr(arguments, key) for key in ("title", "authors", "notes")}
    settings = submit(arguments.folder, arguments.out, card)
    print(arguments.out)
    if "none" not in settings.caregivers:
        print("caregiver-mj: not for a leaderboard: there is no caregiver 'none' to compare with", file=sys.stderr)


def _verify(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.submission import read_submission

    # All are read before verifying, which is slow.
    submissions = [read_submission(path, trust=arguments.trust) for path in arguments.files]
    with parsing.make_executor(arguments) as executor:
        for submission in submissions:
            print(f"{visible(str(submission.path))}: verified, episodes: {len(_verified(submission, executor))}")


def _leaderboard(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.submission import SUFFIX, board, check_comparable, read_submission

    paths = sorted(pathlib.Path(arguments.folder).glob(f"*{SUFFIX}"))
    if not paths:
        raise CaregiverError(f"'{arguments.folder}' must hold at least 1 FILE{SUFFIX}, got none")
    submissions, verified, refused = [], [], list[CaregiverError]()
    for path in paths:  # read all before verifying, which is slow
        with _collect_errors(path, refused):
            submissions.append(check_comparable(read_submission(path, trust=arguments.trust)))
    with parsing.make_executor(arguments) as executor:
        for submission in submissions:
            with _collect_errors(submission.path, refused):
                found = submission, _verified(submission, executor)
                board([found])  # so that an error in its row refuses this file only
                verified.append(found)
    if verified:
        print(board(verified), end="", flush=True)
    for refusal in refused[:-1]:
        print(f"caregiver-mj: {plain(refusal)}", file=sys.stderr)
    if refused:
        raise refused[-1]


@contextlib.contextmanager
def _collect_errors(path: pathlib.Path, refused: list[CaregiverError]) -> Iterator[None]:
    """Append the error of a file in this context to `refused`."""
    try:
        yield
    except CaregiverError as error:
        refused.append(error)
    except Exception as error:
        refused.append(CaregiverError(f"'{path}' cannot be verified: {type(error).__name__}: {error}"))


def _verified(submission: Submission, executor: Executor) -> pd.DataFrame:
    from caregiver_mj.experiments.submission import verify

    with progress_bar() as bar:
        task = bar.add_task("verified", total=sum(map(len, submission.results)))
        return verify(submission, executor, lambda count: bar.advance(task, count))


def output(aside: bool) -> rich.console.Console:
    """Return the console for tables: `aside` selects standard error, if standard output is for a program."""
    # Names of houses, caregivers and answers may be a stranger's: no markup, and no `:emoji:`.
    console = rich.console.Console(stderr=aside, markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = _WIDEST  # a pipe or a file has no width
    return console


def print_summary(summary: dict[str, Any], as_json: bool) -> None:
    """Print the tables of a run; with `as_json` to standard error, and its summary as JSON."""
    console = output(as_json)
    print_table(summary, console)
    print_harm(summary, console)
    if as_json:
        print(json.dumps(summary, indent=1, allow_nan=False))


def print_table(summary: dict[str, Any], console: rich.console.Console) -> None:
    """Print a row for each caregiver and family."""
    first = summary["rows"][0]
    plus_minus = "±" if console.encoding.lower().startswith("utf") else "+-"
    several = any("," in row["family"] for row in summary["rows"])
    shares = {(row["caregiver"], row["family"]): row for row in summary["comparisons"] if row["baseline"] == "none"}
    rows = []
    for row in summary["rows"]:
        of_none = {"damage_left": 1.0, "score": 0.0} if row["caregiver"] == "none" else {}
        found = of_none or shares.get((row["caregiver"], row["family"]), {})
        cells = (
            f"{row['damage_mean']:.1f} {plus_minus} {row['damage_sd']:.1f}",
            f"{row['damage_normalised_mean']:.2f}",
            *("" if (share := found.get(name)) is None else f"{share:.2f}" for name in ("damage_left", "score")),
            *(f"{row[f'{column}_mean']:.1f}" for column in _COLUMNS),
        )
        who = {"epsilon of each" if several else "epsilon": row["family"], "caregiver": row["caregiver"]}
        rows.append(who | dict(zip(_TITLES, cells, strict=True)))
    episodes = f"{first['episodes']} episode{'s' if first['episodes'] > 1 else ''} a row"
    many = summary.get("seeds")
    seeds = f"seeds {', '.join(map(str, many))}" if many else f"seed {summary['seed']}"
    title = f"{first['world']} {_where(first)}, {episodes}, {seeds}"
    legend = (
        f"epsilon: share of random moves; means of an episode, damage {plus_minus} standard deviation; normalised: "
        "damage over the greatest of any episode; left: damage over that of 'none'; score: 0 as 'none', 1 with "
        "bare tables only, less for strikes and drops of the robot; timesteps until damage is above "
        f"{DAMAGE_THRESHOLD:g}; cells visited; toys reached; moves blocked; interventions done"
    )
    print_rows(console, title, legend, rows, sections=True)


def print_harm(summary: dict[str, Any], console: rich.console.Console) -> None:
    """Print where each caregiver does more damage than alone, then the verdicts on all three parts of harm."""
    if found := summary["harm"]:
        rows = [_harm_cells(row) for row in found]
        title = "harm by hazards: damage with the caregiver less alone, in the same episodes"
        caption = (
            "harm in: (house, toddler) pairs, by a one-sided test of paired episodes, with Holm's correction over the "
            "pairs of a caregiver, at 5 %; worst: the pair of the greatest difference, of those with harm if any"
        )
        print_rows(console, title, caption, rows)
    print_verdicts(summary["verdicts"], console)


def _harm_cells(row: dict[str, Any]) -> dict[str, str]:
    worst = row["worst"]
    return {
        "caregiver": row["caregiver"],
        "harm in": f"{row['cells_harmed']} of {row['cells']}",
        "worse episodes": f"{100 * row['episodes_worse']:.1f} %",
        "worst: house": worst["house"],
        "epsilon": worst["family"],
        "alone": f"{worst['damage_alone']:.2f}",
        "with": f"{worst['damage_with']:.2f}",
        "difference": _with_ends(worst, "damage_difference"),
    }


def print_verdicts(verdicts: Sequence[dict[str, Any]], console: rich.console.Console) -> None:
    """Print for each caregiver whether it does harm, with a line for each part, in red if it does."""
    if not verdicts:
        return
    table = rich.table.Table(title="harm", box=rich.box.SIMPLE_HEAD)
    table.caption = "no harm shown needs all three parts"
    for column in ("caregiver", "part", "verdict"):
        table.add_column(column, no_wrap=True)
    table.add_column("finding", overflow="fold")
    for row in verdicts:
        who = f"{row['run']}: {row['caregiver']}" if "run" in row else row["caregiver"]
        lines = [("all", row["verdict"], ""), *((p["title"], p["verdict"], p["text"]) for p in row["parts"].values())]
        for number, line in enumerate(lines, 1):
            cells = (who if number == 1 else "", *line)
            red = "bold red" if line[1] == _HARM else ""
            table.add_row(*map(rich.text.Text, cells), style=red, end_section=number == len(lines))
    console.print(table)


def _with_ends(row: dict[str, Any], key: str, suffix: str = "") -> str:
    """Return a difference with the ends of its interval."""
    from caregiver_mj.experiments.intervals import in_words, signed  # imported where used, like pandas

    return f"{signed(row[key + suffix])} ({in_words(row[f'{key}_ci_low'], row[f'{key}_ci_high'])})"


def print_rows(
    console: rich.console.Console, title: str, legend: str, rows: list[dict[str, str]], sections: bool = False
) -> None:
    """Print a table with a legend below; where it is too wide, with short titles, and entries in several lines.

    With sections, a line separates rows with different first entries.
    """
    room = console.options.update(width=_WIDEST)
    for narrow in (False, True):
        table = rich.table.Table(title=plain(title), box=rich.box.SIMPLE_HEAD, padding=(0, 0 if narrow else 1))
        table.pad_edge = table.show_edge = not narrow
        for column in rows[0]:
            heading = _TITLES.get(column, column.removesuffix(" of each")) if narrow else column
            table.add_column(heading, justify="left" if column in _LEFT_ALIGNED else "right", overflow="fold")
        for row, following in itertools.zip_longest(map(list, map(dict.values, rows)), rows[1:]):
            last = sections and following and row[0] != next(iter(following.values()))
            table.add_row(*map(plain, row), end_section=bool(last))
        if console.measure(table, options=room).maximum <= console.width:
            break
    console.print(table)
    console.print(legend, style="table.caption", markup=False, highlight=False)
