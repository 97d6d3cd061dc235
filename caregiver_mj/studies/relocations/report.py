"""What came out of many relocations, on screen."""

from __future__ import annotations

import collections
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from rich.console import Console

from caregiver_mj.studies.display import make_table
from caregiver_mj.studies.relocations.relocation import Relocation
from caregiver_mj.studies.trials import by_house, total

_WIDTH = 100  # characters of the table
_MOST_COLUMNS = 5  # one for each house and one for all of them, if there is room for so many
_SLOW = 1.0  # seconds from arrived to lifted or clear above which a relocation is named
# Rows of the table beside which there is a figure to compare with: what they shall be, and the prototype's.
_GOALS = {
    "done": "all",
    "arrived to lifted, s: median": "0.60",
    "arrived to lifted, s: worst": "1.50",
    "arrived to clear, s: median": "0.60",
    "arrived to clear, s: worst": "1.50",
    "tilt if done, deg: worst": "5.00",
}
_PROTOTYPE = {
    "done": "200/200",
    "arrived to lifted, s: median": "0.36",
    "arrived to clear, s: median": "0.32",
    "error if done, mm: worst": "0.5",
    "tilt if done, deg: worst": "0.0",
}
_NOTE = """\
goal: at most (done: at least; 98 % with --noise 0.005).
prototype: measured before this project, on another robot in another scene. To lifted is its 0.20 s
to grasped and 0.16 s of lifting, to clear its 0.14 s to released and 0.18 s of withdrawing."""

Rows = Sequence[Relocation]
_PERCENTILES = {"median": 50, "95 %": 95, "worst": 100}
# What is told of the relocations of a house, of which the percentiles: a figure of each, and its digits.
_SPREADS: dict[str, tuple[Callable[[Relocation], float], int]] = {
    "arrived to lifted, s": (lambda row: row.lifting, 2),
    "arrived to clear, s": (lambda row: row.clearing, 2),
    "error if done, mm": (lambda row: math.nan if row.failure else 1000 * row.error, 1),
    "tilt if done, deg": (lambda row: math.nan if row.failure else row.tilt, 2),
    "all of it, s": (lambda row: row.seconds, 1),
}


def report(console: Console, relocations: Rows) -> None:
    """Prints what came out."""
    _print_figures(console, relocations)
    console.print(_NOTE, highlight=False)
    _print_touches(console, relocations)
    for line in (*_slow(relocations), *_wrong(relocations)):
        console.print(line, highlight=False)


def report_each(console: Console, found: Mapping[str, Rows]) -> None:
    """Prints what came out under each condition, by its name."""
    table = make_table("Relocations", "", "done", "tipped", "drops", "strikes", "to lifted, s", "to clear, s")
    for name, rows in found.items():
        medians = [_percentile([getattr(row, what) for row in rows], 50, 2) for what in ("lifting", "clearing")]
        table.add_row(name, _done(rows), *(total(rows, what) for what in ("tipped", "drops", "strikes")), *medians)
    console.print(table, width=_WIDTH)
    for name, rows in found.items():
        for line in _wrong(rows):
            console.print(f"{name}: {line}", highlight=False)


def _done(rows: Rows) -> str:
    return f"{sum(not row.failure for row in rows)}/{len(rows)}"


def _print_figures(console: Console, relocations: Rows) -> None:
    groups = by_house(relocations)
    if len(groups) > _MOST_COLUMNS:
        groups = {"all": list(relocations)}
    table = make_table("Relocations", "", *groups, "goal", "prototype")

    def add(name: str, figures: Sequence[str]) -> None:
        table.add_row(name, *figures, _GOALS.get(name, ""), _PROTOTYPE.get(name, ""))

    add("done", list(map(_done, groups.values())))
    for name, (figure, digits) in _SPREADS.items():
        for words, percent in _PERCENTILES.items():
            spread = [_percentile(list(map(figure, rows)), percent, digits) for rows in groups.values()]
            add(f"{name}: {words}", spread)
    for mishap in ("strikes", "tipped", "drops"):
        add(mishap, [total(rows, mishap) for rows in groups.values()])
    console.print(table, width=_WIDTH)


def _percentile(values: list[float], percent: float, digits: int) -> str:
    known = [value for value in values if not math.isnan(value)]
    return f"{np.percentile(known, percent):.{digits}f}" if known else "-"


def _print_touches(console: Console, relocations: Rows) -> None:
    touches = collections.Counter(pair for row in relocations for pair in row.touches)
    for (part, thing), count in touches.most_common():
        seeds = ", ".join(f"{row.house} {row.seed}" for row in relocations if (part, thing) in row.touches)
        console.print(f"touched in {count}: {part} and {thing} ({seeds})", highlight=False)
    if not touches:
        console.print("The robot touched nothing but candles and the toddler, and candles nothing but it and tables.")


def _slow(relocations: Rows) -> list[str]:
    """The slow ones, the slowest first."""
    lines = []
    for what in ("lifting", "clearing"):
        slow = [(getattr(row, what), row) for row in relocations if getattr(row, what) > _SLOW]
        slow.sort(key=lambda one: -one[0])
        lines += [f"{row.house}, seed {row.seed}: {what} took {seconds:.2f} s" for seconds, row in slow]
    return lines


def _wrong(relocations: Rows) -> list[str]:
    """What went wrong in which."""
    lines = []
    for row in relocations:
        mishaps = (row.strikes, "strikes"), (row.tipped, "tipped"), (row.drops, "drops")
        counts = [f"{count} {what}" for count, what in mishaps if count]
        failure = row.failure and f"{row.failure}; a child stood in the only way for {row.barred:.1f} s"
        lines += [f"{row.house}, seed {row.seed}: {wrong}" for wrong in (failure, *counts) if wrong]
    return lines
