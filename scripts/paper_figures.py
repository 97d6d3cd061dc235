"""Draws the figures of docs/results.md, from the tables of other pages."""

from __future__ import annotations

import argparse
import json
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from caregiver_mj.viz.colours import BIN, unit
from caregiver_mj.viz.figure_style import ALONE, GUARDED, HEIGHT, INK, STYLE, WIDTH, Series, explain
from caregiver_mj.viz.figures import damage_left
from study import Rows, read_table

DOCS = pathlib.Path(__file__).parents[1] / "docs"
# A value, then its interval, if there is one: "0.31 (0.19 to 1.97); 34 % (…)" or "0.31 [0.19, ∞]\n3.2 of 10.1".
_ESTIMATE = re.compile(r"([+-]?[\d.]+|–)(?:\s+[(\[]([^()\[\]]*(?: to |, )[^()\[\]]*)[)\]])?")
_COLOURS = {"alone": unit(ALONE), "expected-danger": unit(GUARDED), "foresight": unit(BIN)}


def estimate(cell: str) -> list[float]:
    """Return the value in a table cell and the ends of the interval in brackets behind it, NaN if missing or open."""
    value, ends = _ESTIMATE.match(cell).groups()
    low, high = re.split(" to |, ", ends) if ends else ("–", "–")
    return [np.nan if one in ("–", "-∞", "∞") else float(one) for one in (value, low, high)]


def series(label: str, cells: Sequence[str]) -> Series:
    """Return a line of a table, for a figure."""
    return Series(label, *np.array([estimate(cell) for cell in cells]).T)


def sight(left: Rows) -> Figure:
    """Draw the damage left by sight."""
    rows = {row["sight"]: row for row in left}
    seen = {"all": "sees all", "walls": "walls hide", "camera": "camera of 90°"}
    names = ("expected-danger", "foresight", "foresight that never looks", "last-seen")
    return damage_left([*seen.values()], [series(name, [rows[sight][name] for sight in seen]) for name in names])


def learned(trained: Rows, now: Rows) -> Figure:
    """Draw the damage left by the rule, the planner, the learned caregiver, and MaskablePPO."""
    of = {row["caregiver"]: [*row.values()][2:] for row in now if row["run"] == now[0]["run"]}
    ppo = {row["caregiver"]: [*row.values()][1:] for row in trained}["MaskablePPO"]
    lines = [series(name, of[name]) for name in ("expected-danger", "foresight", "learned") if name in of]
    lines.append(series("MaskablePPO", ppo))
    novices = [title.replace(" random", "") for title in [*trained[0]][1:]]
    figure = damage_left(novices, lines, series("floor", of["floor"]))
    figure.axes[0].set_xlabel("share of the child's moves that are random")
    return figure


def gates(kinds: Rows, worth: Rows) -> Figure:
    """Draw the damage in homes by kind of hazard, and the increase without closing gates."""
    figure, (left, right) = _pair(HEIGHT, width_ratios=(5, 2))
    bars, means = {}, {row["caregiver"]: [float(cell) for cell in [*row.values()][1:]] for row in kinds}
    for number, (name, colour) in enumerate(_COLOURS.items()):
        x = np.arange(len(means[name])) + 0.27 * (number - 1)
        bars[name] = left.bar(x, means[name], 0.25, color=colour)
    left.set_xticks(range(len(kinds[0]) - 1), [*kinds[0]][1:])
    left.set_ylabel("damage, summed over five toddlers")
    for number, row in enumerate(worth):
        _mark(right, number, row["more without closing gates"], row["caregiver"])
    right.axhline(0, color=INK, linewidth=0.8)
    right.set_xticks(range(len(worth)), [row["caregiver"] for row in worth])
    right.set(xlim=(-0.5, len(worth) - 0.5), ylabel="more damage if no gate is closed")
    explain(figure, bars)
    return figure


def physics(shapes: Rows) -> Figure:
    """Draw the damage in grid and house by the shape of the house, and their ratio."""
    figure, (left, right) = _pair(1.3 * HEIGHT, "x", sharey=True)
    places = {shape: place for place, shape in enumerate(dict.fromkeys(row["shape"] for row in shapes))}
    keys = {}
    for row in shapes:
        name = row["caregiver"].replace("paper", "expected-danger")
        y, line = places[row["shape"]] + (0.17 if name == "foresight" else -0.17), {"color": _COLOURS[name]}
        left.hlines(y, *sorted((float(row["grid"]), float(row["house"]))), **line, linewidth=2)
        for world, fill in (("grid", {"markerfacecolor": "white"}), ("house", {})):
            keys[f"{name}, {world}"] = left.plot(float(row[world]), y, "o", **line, **fill, zorder=3, clip_on=False)[0]
        _mark(right, y, row["house / grid"], name, across=True)
    left.set(xlim=(0, None), xlabel="damage in an episode", ylim=(len(places) - 0.4, -0.6))
    left.set_yticks([*places.values()], [*places])
    right.axvline(1, color=INK, linewidth=0.8)
    right.set(xscale="log", xlim=(0.1, 100), xlabel="house / grid")
    right.set_xticks((0.1, 1, 10, 100), ("0.1", "1", "10", "100"))
    explain(figure, keys, most=4)
    return figure


def _pair(height: float, grid: str = "y", **how: Any) -> tuple[Figure, Sequence[Axes]]:
    with mpl.rc_context({**STYLE, "axes.grid.axis": grid}):
        figure = Figure((2 * WIDTH, height), layout="constrained", facecolor="white")
        return figure, figure.subplots(1, 2, **how)


def _mark(axes: Axes, place: float, cell: str, name: str, across: bool = False) -> None:
    """Draw a value with its interval, vertical or horizontal; a dotted line if it is unbounded."""
    value, *ends = estimate(cell)
    x, y = (value, place) if across else (place, value)
    axes.plot(x, y, "o", color=_COLOURS[name], zorder=3)
    if np.isnan(ends).any():
        (axes.axhline if across else axes.axvline)(place, color=_COLOURS[name], linestyle=":")
    else:
        (axes.hlines if across else axes.vlines)(place, *ends, color=_COLOURS[name], linewidth=2)


_GRID = "results/tables/damage_left_by_each_caregiver.csv"
FIGURES: dict[str, tuple[Callable[..., Figure], tuple[tuple[str, ...], ...]]] = {  # what is drawn of which tables
    "safe_sight.svg": (sight, (("sight.md", "share of the way"),)),
    "safe_gates.svg": (gates, (("homes_kinds.csv",), ("homes.md", "## By hazard"))),
    "safe_learned.svg": (learned, (("learning.md", "Damage left"), (_GRID,))),
    "safe_physics.svg": (physics, (("shapes.csv",),)),
}


def tables(file: str, docs: pathlib.Path = DOCS) -> list[Rows]:
    """Return the present tables of a figure."""
    return [read_table(docs, page, *before) for page, *before in FIGURES[file][1]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw all figures, with their numbers in their descriptions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--docs", type=pathlib.Path, default=DOCS, metavar="DIR")
    docs = parser.parse_args(arguments).docs
    for file, (draw, _) in FIGURES.items():
        found = tables(file, docs)
        with mpl.rc_context(STYLE):
            draw(*found).savefig(docs / file, metadata={"Date": None, "Description": json.dumps(found)})


if __name__ == "__main__":
    main()
