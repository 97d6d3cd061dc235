"""`caregiver-mj compare` and `pool`: two runs against each other, several as one, and tables in a terminal."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from typing import Any

import rich.box
import rich.console
import rich.table

from caregiver_mj.errors import CaregiverError

_COMPARED = ("pairs", "first", "second", "difference", "p", "verdict")
_LESS_NEEDED = ("pairs", "first", "second", "p")  # where there is little room, this first
_TITLES = {  # of a column, and what it is where there is little room
    "damage": "damage",
    "normalised": "norm.",
    "left": "left",
    "timesteps": "steps",
    "cells": "cells",
    "toys": "toys",
    "blocked": "block.",
    "done": "done",
}
_WIDEST = 10_000  # letters of a line, more than there are in any
_HARM = ("cells with harm", "worse episodes", "worst: house", "epsilon", "alone", "with", "difference")
_COLUMNS = ("timesteps_to_threshold", "cells_visited", "toys_reached", "moves_blocked", "interventions_done")


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands."""
    text = "compare two finished runs of one world, episode by episode"
    command = commands.add_parser(
        "compare",
        help=text,
        description="Print the results of the second run less those of the first, paired by episode.",
    )
    command.add_argument("folders", nargs=2, metavar="DIR", help="folder of a run")
    command.add_argument(
        "--caregiver",
        nargs="+",
        default=(),
        metavar="NAME",
        help="caregiver in the first run, and in the second if it is another",
    )
    command.add_argument("--json", action="store_true", help="print the table as JSON only")
    command.set_defaults(run=_compare)
    text = "put finished runs together that differ in their seed alone"
    command = commands.add_parser("pool", help=text, description="Make one run of the episodes of several.")
    command.add_argument(
        "folders", nargs="+", metavar="DIR", help="folder of a run; all settings but the seed must be the same"
    )
    command.add_argument("--out", required=True, metavar="DIR", help="folder for the episodes and the table")
    command.add_argument("--json", action="store_true", help="print the table as JSON only")
    command.set_defaults(run=_pool)


def _compare(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.finished import (
        compare_runs,  # need pandas, which takes a second to import
        read_finished,
    )

    first, second = map(read_finished, arguments.folders)
    found = compare_runs(first, second, arguments.caregiver)
    console = output(arguments.json)
    print_comparison(found, arguments.folders, console)
    for key, (ours, theirs) in found["settings"].items():
        console.print(f"not the same: {key}, {_told(ours)} and {_told(theirs)}", markup=False, highlight=False)
    if arguments.json:
        print(json.dumps(found, indent=1, allow_nan=False))


def _told(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def print_comparison(found: dict[str, Any], folders: list[str], console: rich.console.Console) -> None:
    """Print what `compare_runs` has found in two folders: as many columns as there is room for, and none cut short."""
    shapes = [(_COMPARED, False), *((_without(_LESS_NEEDED[:i]), True) for i in range(len(_LESS_NEEDED) + 1))]
    _print_widest((_comparison(found, folders, columns, narrow) for columns, narrow in shapes), console)


def _without(gone: Sequence[str]) -> tuple[str, ...]:
    return tuple(title for title in _COMPARED if title not in gone)


def _comparison(found: dict[str, Any], folders: list[str], columns: Sequence[str], narrow: bool) -> rich.table.Table:
    from caregiver_mj.experiments.verdicts import MARGINS  # brings SciPy

    first = found["rows"][0]
    where = first["house"] if "houses" in first else f"'{first['house']}'"
    caption = (
        "mean damage of paired episodes; in brackets the 95 % interval of the mean difference; p of a row alone, "
        "verdict with Holm's correction for all rows; equivalent: neither less than the other by "
        f"{MARGINS['damage']:.0%}"
    )
    if gone := _without(columns):
        caption += f"; no room for: {', '.join(gone)}"
    table = _empty_table(f"{first['world']} {where}: second ({folders[1]}) less first ({folders[0]})", caption, narrow)
    for title in ("epsilon", "caregiver", *columns):
        table.add_column(title, justify="left" if title in ("caregiver", "verdict") else "right", no_wrap=True)
    for row in found["rows"]:
        names = dict.fromkeys((row["baseline"], row["caregiver"]))
        low, high = (row[f"damage_difference_ci_{end}"] for end in ("low", "high"))
        cells = {
            "pairs": str(row["episodes"]),
            "first": f"{row['first']:.2f}",
            "second": f"{row['second']:.2f}",
            "difference": _with_ends(row["damage_difference_mean"], low, high),
            "p": "" if (p := row["damage_p"]) is None else f"{p:.3f}" if p >= 0.001 else "<.001",
            "verdict": _verdict(row),
        }
        table.add_row(row["family"], ", ".join(names), *(cells[title] for title in columns))
    return table


def _verdict(row: dict[str, Any]) -> str:
    """The verdict on the difference; where there is none, that it is within the margin, if that is shown."""
    from caregiver_mj.experiments.verdicts import Verdict  # brings SciPy

    found = row["damage_verdict"]
    within = row.get("damage_equivalence") == Verdict.EQUIVALENT
    return Verdict.EQUIVALENT.value if within and found == Verdict.NONE else found


def _pool(arguments: argparse.Namespace) -> None:
    from caregiver_mj.experiments.finished import (
        pool_runs,
        read_finished,  # needs pandas, which takes a second to import
    )

    if len(arguments.folders) < 2:
        raise CaregiverError(f"runs to be pooled must be at least 2, got {len(arguments.folders)}")
    summary = pool_runs([read_finished(folder) for folder in arguments.folders], arguments.out)
    console = output(arguments.json)
    print_table(summary, console)
    print_harm(summary, console)
    if arguments.json:
        print(json.dumps(summary, indent=1, allow_nan=False))


def output(aside: bool) -> rich.console.Console:
    """Return where a table for people goes: aside to standard error, where standard output is for a program."""
    console = rich.console.Console(stderr=aside)
    if not console.is_terminal:
        console.width = 120  # a pipe or a file has no width to fit
    return console


def print_table(summary: dict[str, Any], console: rich.console.Console) -> None:
    """Print a row for each caregiver and family: as many columns as there is room for, and none cut short."""
    shapes = [(list(_TITLES), False), *((list(_TITLES)[:count], True) for count in range(len(_TITLES), 0, -1))]
    _print_widest((_table(summary, columns, narrow, console) for columns, narrow in shapes), console)


def print_harm(summary: dict[str, Any], console: rich.console.Console) -> None:
    """Print for each caregiver where it does harm; or, in a line, why nobody knows."""
    rows = summary["harm"]
    if rows:
        shapes = [(_HARM, False), *((_HARM[:count], True) for count in range(len(_HARM), 0, -1))]
        _print_widest((_harm(rows, columns, narrow) for columns, narrow in shapes), console)
    elif all(row["caregiver"] != "none" for row in summary["rows"]):
        console.print("harm cannot be judged without the caregiver 'none'", highlight=False)


def _harm(rows: list[dict[str, Any]], columns: Sequence[str], narrow: bool) -> rich.table.Table:
    caption = (
        "a cell is a house and a child; harm: more damage than alone, by a one-sided test of paired episodes, "
        "corrected by Holm over a caregiver's cells, at 5 %"
    )
    if (decidable := min(row["cells_decidable"] for row in rows)) < rows[0]["cells"]:
        caption += f"; so few pairs differ that it could be shown in as few as {decidable} of {rows[0]['cells']} cells"
    if gone := [title for title in _HARM if title not in columns]:
        caption += f"; no room for: {', '.join(gone)}"
    made = _empty_table("harm: damage with the caregiver less alone, in the same episodes", caption, narrow)
    made.add_column("caregiver", no_wrap=True)
    for title in columns:
        made.add_column(title, justify="left" if title.startswith("worst") else "right", no_wrap=True)
    for row in rows:
        worst = row["worst"]
        low, high = (worst[f"damage_difference_ci_{end}"] for end in ("low", "high"))
        cells = (
            f"{row['cells_harmed']} of {row['cells']}",
            f"{100 * row['episodes_worse']:.1f} %",
            worst["house"],
            worst["family"],
            f"{worst['damage_alone']:.2f}",
            f"{worst['damage_with']:.2f}",
            _with_ends(worst["damage_difference"], low, high),
        )
        made.add_row(row["caregiver"], *cells[: len(columns)])
    return made


def _empty_table(title: str, caption: str, narrow: bool) -> rich.table.Table:
    return rich.table.Table(
        title=title,
        caption=caption,
        box=rich.box.SIMPLE_HEAD,
        padding=0 if narrow else (0, 1),
        pad_edge=not narrow,
    )


def _with_ends(value: float, low: float | None, high: float | None) -> str:
    """A difference with the ends of its interval, which are infinite where there is none."""

    def signed(number: float) -> str:
        return f"{round(number, 2) + 0.0:+.2f}"  # no minus before a zero

    ends = "-inf" if low is None else signed(low), "inf" if high is None else signed(high)
    return f"{signed(value)} ({ends[0]} to {ends[1]})"


def _print_widest(tables: Iterable[rich.table.Table], console: rich.console.Console) -> None:
    """Print the first of some tables, the widest before, that there is room for; or the last of them."""
    room = console.options.update(width=_WIDEST)
    for table in tables:
        width = console.measure(table, options=room).maximum
        if width <= console.width:
            break
    console.width = max(width, console.width)  # if the narrowest is too wide, the terminal may break its lines
    console.print(table)


def _table(
    summary: dict[str, Any], columns: Sequence[str], narrow: bool, console: rich.console.Console
) -> rich.table.Table:
    rows = summary["rows"]
    first = rows[0]
    episodes = f"{first['episodes']} episodes each" if first["episodes"] > 1 else "1 episode each"
    where = first["house"] if "houses" in first else f"'{first['house']}'"
    many = summary.get("seeds")
    seeds = f"seeds {', '.join(map(str, many))}" if many else f"seed {summary['seed']}"
    plus_minus = "±" if console.encoding.lower().startswith("utf") else "+-"
    caption = f"mean {plus_minus} standard deviation"
    caption += "; left: damage over that of 'none'" if "left" in columns else ""
    if gone := [title for title in _TITLES if title not in columns]:
        caption += f"; no room for: {', '.join(gone)}"
    made = _empty_table(f"{first['world']} {where}, {episodes}, {seeds}", caption, narrow)
    only_children = not any("," in row["family"] for row in rows)
    made.add_column("epsilon" if only_children or narrow else "epsilon of each", justify="right", no_wrap=True)
    made.add_column("caregiver", no_wrap=True)
    for title in columns:
        made.add_column(_TITLES[title] if narrow else title, justify="right", no_wrap=True)
    against_none = (row for row in summary["comparisons"] if row["baseline"] == "none")
    left = {(row["caregiver"], row["family"]): row["damage_left"] for row in against_none}
    for i, row in enumerate(rows):
        ratio = 1.0 if row["caregiver"] == "none" else left.get((row["caregiver"], row["family"]))
        cells = (
            f"{row['damage_mean']:.1f} {plus_minus} {row['damage_sd']:.1f}",
            f"{row['damage_normalised_mean']:.2f}",
            "" if ratio is None else f"{ratio:.2f}",
            *(f"{row[f'{column}_mean']:.1f}" for column in _COLUMNS),
        )
        made.add_row(
            row["family"],
            row["caregiver"],
            *cells[: len(columns)],
            end_section=i + 1 < len(rows) and rows[i + 1]["family"] != row["family"],
        )
    return made
