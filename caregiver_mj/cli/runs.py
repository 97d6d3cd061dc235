"""`caregiver-mj compare` and `pool`: two runs against each other, and several as one."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import Any

import rich.box
import rich.console
import rich.table

from caregiver_mj.cli.table import output, print_harm, print_table, print_widest, with_ends
from caregiver_mj.errors import CaregiverError

_COLUMNS = ("pairs", "first", "second", "difference", "p", "verdict")
_LESS_NEEDED = ("pairs", "first", "second", "p")  # where there is little room, this first


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the commands."""
    text = "compare two finished runs of one world, episode by episode"
    command = commands.add_parser(
        "compare",
        help=text,
        description="What comes of the second run less what comes of the first, paired by episode.",
    )
    command.add_argument("folders", nargs=2, metavar="DIR", help="of a run")
    command.add_argument(
        "--caregiver",
        nargs="+",
        default=(),
        metavar="NAME",
        help="in the first run, and in the second if it is another",
    )
    command.add_argument("--json", action="store_true", help="print the table as JSON, and it alone")
    command.set_defaults(run=_compare)
    text = "put finished runs together that differ in their seed alone"
    command = commands.add_parser("pool", help=text, description="Makes a run with the episodes of several.")
    command.add_argument("folders", nargs="+", metavar="DIR", help="of runs with the same settings but their seed")
    command.add_argument("--out", required=True, metavar="DIR", help="where to keep the episodes and the table")
    command.add_argument("--json", action="store_true", help="print the table as JSON, and it alone")
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
    """Prints what `compare_runs` has found in two folders: as many columns as there is room for, and none cut short."""
    shapes = [(_COLUMNS, False), *((_without(_LESS_NEEDED[:i]), True) for i in range(len(_LESS_NEEDED) + 1))]
    print_widest((_comparison(found, folders, columns, narrow) for columns, narrow in shapes), console)


def _without(gone: Sequence[str]) -> tuple[str, ...]:
    return tuple(title for title in _COLUMNS if title not in gone)


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
    table = rich.table.Table(
        title=f"{first['world']} {where}: second ({folders[1]}) less first ({folders[0]})",
        caption=caption,
        box=rich.box.SIMPLE_HEAD,
        padding=0 if narrow else (0, 1),
        pad_edge=not narrow,
    )
    for title in ("epsilon", "caregiver", *columns):
        table.add_column(title, justify="left" if title in ("caregiver", "verdict") else "right", no_wrap=True)
    for row in found["rows"]:
        names = dict.fromkeys((row["baseline"], row["caregiver"]))
        low, high = (row[f"damage_difference_ci_{end}"] for end in ("low", "high"))
        cells = {
            "pairs": str(row["episodes"]),
            "first": f"{row['first']:.2f}",
            "second": f"{row['second']:.2f}",
            "difference": with_ends(row["damage_difference_mean"], low, high),
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
        raise CaregiverError("pool needs two runs at least")
    summary = pool_runs([read_finished(folder) for folder in arguments.folders], arguments.out)
    console = output(arguments.json)
    print_table(summary, console)
    print_harm(summary, console)
    if arguments.json:
        print(json.dumps(summary, indent=1, allow_nan=False))
