"""Damage and strikes by the speed of the child: a row for each speed, of finished runs in the grid and the house."""

from __future__ import annotations

import argparse
import pathlib

import pandas as pd

from study import Parser, fill_in, read_run, table

_NAMES = {"none": "alone", "expected-danger": "`expected-danger`", "foresight": "`foresight`"}


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_file("runs", "finished runs, of one speed each", "DIR", nargs="+", required=True)
    parser.add_file("docs", "write it into the guide's page there", "DIR")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write it into the guide."""
    print(text := report(options.runs))
    if options.docs:
        fill_in(options.docs / "guide" / "children.md", "child_speed", text)


def report(runs: list[pathlib.Path]) -> str:
    """Return the table: damage of an episode, the mean over houses and children, and all strikes in the house."""
    parts = []
    for folder in runs:
        episodes, settings = read_run(folder)
        parts.append(episodes.assign(speed=f"{settings.child_speed:.2f}"))
    rows = pd.concat(parts)
    damage = rows.pivot_table("damage", "speed", ["world", "caregiver"])
    columns = [(world, name) for world in ("grid", "house") for name in _NAMES if (world, name) in damage]
    strikes = rows[rows.world == "house"].groupby("speed").strikes.sum()
    lines = [
        (speed, *(f"{by_column[column]:.2f}" for column in columns), str(strikes.get(speed, "–")))
        for speed, by_column in damage.iterrows()
    ]
    titles = [f"{world}, {_NAMES[name]}" for world, name in columns]
    return table(("m/s", *titles, "strikes"), [[cell.replace("nan", "–") for cell in line] for line in lines])
