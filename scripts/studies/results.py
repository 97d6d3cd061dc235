"""The results that the documentation shows: runs every evaluation behind them, reports on all, and fills docs/results.

A run that was broken off goes on where it stopped; one that is finished is not run again.
"""

from __future__ import annotations

import argparse
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Sequence

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.verdicts import LEVEL
from study import Parser, markdown_cells

# As `plans.shapes.SHAPES`, but in the order in which they were run: intervals over houses depend on it.
_SHAPES = ["hall", "alcoves", "dead-ends", "open-plan", "loops", "chain", "stairs-only", "many-tables", "far-bins"]


def _houses(first: int) -> list[str]:
    """Return sixty houses that nobody chose, by seeds from the first on: of the generator, homes, and of all shapes."""
    houses = [f"{kind}-{first + i}" for kind in ("house", "home") for i in range(20)]
    for seed in (first, first + 10):
        houses += [*(f"{shape}-{seed}" for shape in _SHAPES), f"hall-{seed + 1}"]
    return houses


BOUNDS = pathlib.Path(__file__).with_name("bounds")  # where `clairvoyant` is; workers of a cluster must find it, too
_CLAIMED = ("none", "nearest", "expected-danger", "foresight")  # of whom README's first claim is
_BEGIN, _END = "<!-- main results -->\n", "<!-- end of main results -->"
_ALL = "none random wanderer nearest guard stairs candles childproof expected-danger foresight knows-goal floor"
_FEW = "none nearest expected-danger foresight floor"
_OTHERS = "toddler:.5 explorer:.25 avoider:.25 seeker:.25"  # children that are no novices
RUNS = {  # in the order of the report
    "grid-test-100": f"--world grid --houses test-100 --caregiver {_ALL} --episodes 20",
    "grid-drawn-10": "--world grid --houses drawn-10 --caregiver none nearest expected-danger foresight --episodes 40",
    "grid-test-20": "--world grid --houses test-20 --caregiver none expected-danger foresight knows-goal clairvoyant "
    "floor --episodes 20",
    "house-120": f"--world house --houses {' '.join(_houses(990_000) + _houses(991_000))} "
    "--caregiver none expected-danger foresight --epsilon 1 0.75 0.5 0.25 0.05 --episodes 4 --seed 91",
    "grid-apartment": f"--world grid --house apartment --caregiver {_ALL} --episodes 200",
    "grid-paper": f"--world grid --house paper --caregiver {_ALL} --episodes 1000",
    "house-paper": "--world house --house paper --caregiver none expected-danger --episodes 10",
}
CHILDREN = {  # who are no novices
    "grid-children": f"--world grid --houses test-100 --caregiver {_FEW} --epsilon {_OTHERS} --episodes 20",
    "house-children": "--world house --houses test-10 --caregiver none expected-danger foresight floor "
    f"--epsilon {_OTHERS} --episodes 1",
}


def command(runs: pathlib.Path, name: str, jobs: int, scheduler: str | None = None) -> list[str]:
    """The command of a run, on this machine or on the cluster of a scheduler."""
    asked = shlex.split((RUNS | CHILDREN)[name])
    where = ["--jobs", str(jobs)] if scheduler is None else ["--executor", "dask", "--scheduler", scheduler]
    return ["evaluate", *asked, *where, "--out", str(runs / name), "--resume"]


def call(arguments: Sequence[str]) -> None:
    """Run a command of this package.

    Raises:
        CaregiverError: It failed.
    """
    print("caregiver-mj", shlex.join(arguments), file=sys.stderr)
    path = os.pathsep.join(filter(None, (str(BOUNDS), os.environ.get("PYTHONPATH"))))
    program = [sys.executable, "-m", "caregiver_mj", *arguments]
    if subprocess.run(program, env=os.environ | {"PYTHONPATH": path}, check=False).returncode:
        raise CaregiverError(f"caregiver-mj {shlex.join(arguments)} failed")


def publish(runs: Sequence[pathlib.Path], docs: pathlib.Path, name: str) -> None:
    """Copy the tables of a report as CSV, the figures that the page of results shows, and the means of each house.

    Args:
        runs: Folders of the runs that the report is of; it is in the first of them.
        docs: The documentation's folder.
        name: Of the folder in it. `tables/` has a file for each table of the report; `houses.csv` has the houses of the
            first run, and `houses_<run>.csv` those of each other.
    """
    report, folder = runs[0], docs / name
    shutil.rmtree(folder, ignore_errors=True)
    for part in ("figures", "tables"):
        (folder / part).mkdir(parents=True)
    for title, rows in report_tables((report / "tables.md").read_text("utf-8")).items():
        rows.to_csv(folder / "tables" / f"{title}.csv", index=False)
    page = (docs / "results.md").read_text("utf-8")
    for figure in sorted((report / "figures").glob("*.png")):
        if f"({name}/figures/{figure.name})" in page:
            shutil.copy(figure, folder / "figures")
    for run_folder in runs:
        table = folder / ("houses.csv" if run_folder == report else f"houses_{run_folder.name}.csv")
        pd.read_parquet(run_folder / "houses.parquet").round(4).to_csv(table, index=False)


def report_tables(text: str) -> dict[str, pd.DataFrame]:
    """Return the tables of a report in Markdown, as printed, with the run in the first column.

    Args:
        text: Its headings are "Title", or "Title — run" where each run has the table.

    Returns:
        Tables by their titles in small letters, with underscores.
    """
    found: dict[str, list[pd.DataFrame]] = {}
    for heading, lines in re.findall(r"^#+ ([^\n]*)\n+((?:\|[^\n]*\n)+)", text, re.M):
        title, _, run = heading.partition(" — ")
        titles, *rows = markdown_cells(lines)
        made = pd.DataFrame(rows, columns=titles)
        made.insert(0, "run", run)
        found.setdefault(re.sub(r"\W+", "_", title.lower()).strip("_"), []).append(made)
    return {title: pd.concat(tables, ignore_index=True) for title, tables in found.items()}


def main_results(docs: pathlib.Path) -> str:
    """Return README's first claim and its table, from the tables in the documentation."""
    tables = (pd.read_csv(docs / "results" / f"houses{name}.csv") for name in ("", "_grid-drawn-10", "_house-120"))
    test, drawn, house = (table[table.caregiver.isin(_CLAIMED)] for table in tables)
    acting = pd.concat([test, drawn])[lambda cells: cells.caregiver != "none"]
    harmed, pairs = int((acting.harm_verdict == "more").sum()), acting.groupby("caregiver").size().max()
    harm = pd.read_csv(
        docs / "results" / "tables" / "harm_by_hazards.csv"
    )  # in tables of houses a p of 1 / 2^14 is rounded
    could = [
        _decidable(harm, "Grid, 100 houses (test-100)", name) + _decidable_in(drawn, name) for name in _CLAIMED[1:]
    ]
    others = pd.read_csv(docs / "children" / "tables" / "harm_by_hazards.csv").query("caregiver == 'expected-danger'")
    worst = others.iloc[0]  # in the grid
    most = worst.difference.split()[0].lstrip("+")
    robot = house[house.caregiver != "none"]
    struck, grazed, dropped = (
        round((robot[column] * robot.episodes).sum()) for column in ("strikes", "strikes_surface", "candles_dropped")
    )
    shown = max(_decidable_in(robot, name) for name in robot.caregiver.unique())
    text = (
        "In the grid, `nearest`, `expected-danger` (the paper's rule) and `foresight` (a planner) significantly "
        f"increased damage in {harmed} of {pairs} conditions (a house and a toddler); an increase could have been "
        f"detected in {min(could)} to {max(could)}. The worst is a child that follows the robot: with children of "
        f"other kinds `expected-danger` increased damage in {worst['cells with harm']}, by up to {most} an "
        f"episode. In {robot.episodes.sum():,} physical episodes the robot struck a child {struck} times "
        f"({grazed} by the stricter count) and dropped {dropped} things; an increase of damage could have been "
        f"detected in {shown} of {robot.groupby('caregiver').size().max()}. [Limits](docs/guide/limits.md)"
    )
    rows = [
        f"| {title} | " + " | ".join(f"{_summed(cells, name):.1f}" for name in ("none", *_CLAIMED[2:])) + " |"
        for title, cells in (
            ("grid, 100 houses (`test-100`)", test),
            ("grid, ten houses drawn by hand (`drawn-10`)", drawn),
            ("physical house, 120 of all shapes", house),
        )
    ]
    head = [
        "| damage in an episode, summed over five toddlers | alone | `expected-danger` | `foresight` |",
        "|---|---|---|---|",
    ]
    return "\n".join([textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False), "", *head, *rows])


def _decidable(harm: pd.DataFrame, run: str, caregiver: str) -> int:
    """Return in how many pairs of a run harm could be shown, as the report says."""
    return int(harm.loc[(harm.run == run) & (harm.caregiver == caregiver), "could be shown in"].item())


def _decidable_in(cells: pd.DataFrame, caregiver: str) -> int:
    """Return the same of few pairs, whose p are not too small for four digits."""
    least = cells.loc[cells.caregiver == caregiver, "harm_p_least"]
    return int((least * len(least) <= LEVEL).sum())


def _summed(cells: pd.DataFrame, caregiver: str) -> float:
    """Return the damage of an episode, a mean over houses, summed over toddlers."""
    return float(cells[cells.caregiver == caregiver].groupby("family").damage.mean().sum())


def write_main_results(docs: pathlib.Path, readme: pathlib.Path) -> None:
    """Write them into README, between its two marks."""
    before, _, rest = readme.read_text("utf-8").partition(_BEGIN)
    after = rest.partition(_END)[2]
    readme.write_text(f"{before}{_BEGIN}{main_results(docs)}\n{_END}{after}", "utf-8")


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("runs", pathlib.Path("runs"), type=pathlib.Path, metavar="DIR")
    parser.add("docs", pathlib.Path("docs"), type=pathlib.Path, metavar="DIR")
    parser.add_jobs()
    parser.add("scheduler", None, "of a Dask cluster, to run on that instead", metavar="ADDRESS")
    parser.add("only", [], "run these, publish nothing", choices=[*RUNS, *CHILDREN], metavar="RUN")


def run(options: argparse.Namespace) -> None:
    """Run what is missing, report, and publish."""
    for name in options.only or [*RUNS, *CHILDREN]:
        call(command(options.runs, name, options.jobs, options.scheduler))
    if options.only:
        return
    for group, name in ((RUNS, "results"), (CHILDREN, "children")):
        folders = [options.runs / run for run in group]
        call(["report", *map(str, folders)])
        publish(folders, options.docs, name)
    write_main_results(options.docs, options.docs.parent / "README.md")
