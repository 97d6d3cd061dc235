"""The results that the documentation shows: reports on finished runs, fills docs/results.md and folders beside it."""

from __future__ import annotations

import argparse
import math
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from typing import Any

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.verdicts import LEVEL
from caregiver_mj.recording.record import COLUMNS
from caregiver_mj.viz.report.run import PUBLISHED
from study import Page, Parser, Rows, markdown_cells, read_table

DOCS = pathlib.Path(__file__).parents[2] / "docs"
_CLAIMED = ("none", "nearest", "expected-danger", "foresight")  # of whom README's first claim is
_EPISODES_OF_THE_PAPER = 20
_GRID = "results/houses.csv"
_OTHERS = {  # further runs of the page, by what they leave there
    "results/houses_grid-drawn-10.csv": "`drawn-10`, ten houses drawn by hand",
    "results/houses_grid-shapes.csv": "`shapes-test-100`, houses of all shapes",
    "special/houses_villa.csv": "`villa`, drawn by hand, 1,000 episodes at epsilon .25 and .05",
    "special/houses_stairs-20.csv": "`paper` with stairs at 20",
    "children/houses_grid-others.csv": "eleven other kinds and shares of random moves, in `test-100`",
    "children/houses_grid-drawn.csv": "`seeker:0.5` in `drawn-10`",
}


def call(arguments: Sequence[str]) -> None:
    """Run a command of this package.

    Raises:
        CaregiverError: It failed.
    """
    program = [sys.executable, "-m", "caregiver_mj", *arguments]
    if subprocess.run(program, stdout=sys.stderr, check=False).returncode:
        raise CaregiverError(f"caregiver-mj {shlex.join(arguments)} failed")


def publish(runs: Sequence[pathlib.Path], beside: Sequence[pathlib.Path], docs: pathlib.Path, name: str) -> None:
    """Copy the tables of a report as CSV, the figures that the page of results shows, and the means of each house.

    Args:
        runs: Folders of the runs that the report is of, if any; it is in the first of them.
        beside: Those of others, of which only the means of each house are copied.
        docs: The documentation's folder.
        name: Of the folder in it. `tables/` has a file for each table of the report; `houses.csv` has the houses of the
            first run, and `houses_<run>.csv` those of each other.
    """
    folder = docs / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for report in runs[:1]:
        for part in ("figures", "tables"):
            (folder / part).mkdir()
        for title, rows in report_tables((report / "tables.md").read_text("utf-8")).items():
            rows.to_csv(folder / "tables" / f"{title}.csv", index=False)
        page = (docs / "results.md").read_text("utf-8")
        for figure in sorted((report / "figures").glob("*.png")):
            if f"({name}/figures/{figure.name})" in page:
                shutil.copy(figure, folder / "figures")
    for run_folder in (*runs, *beside):
        table = folder / ("houses.csv" if run_folder in runs[:1] else f"houses_{run_folder.name}.csv")
        means = pd.read_parquet(run_folder / "houses.parquet").drop(columns="wall_seconds", errors="ignore")
        if (means.world == "grid").all():  # columns that only the house counts are empty there
            means = means.drop(columns=[one.name for one in COLUMNS if one.world == "house"], errors="ignore")
        means.round(4).to_csv(table, index=False)


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
    tables = (pd.read_csv(docs / file) for file in (_GRID, "results/houses_grid-drawn-10.csv", "house/houses.csv"))
    test, drawn, house = (table[table.caregiver.isin(_CLAIMED) & _of_novices(table)] for table in tables)
    acting = pd.concat([test, drawn])[lambda cells: cells.caregiver != "none"]
    harmed, pairs = int((acting.harm_verdict == "more").sum()), acting.groupby("caregiver").size().max()
    # In tables of houses a p of 1 / 2^14 is rounded.
    harm = _read_harm(docs, "results")
    could = [_decidable(harm, name) + _decidable_in(drawn, name) for name in _CLAIMED[1:]]
    worst = _read_harm(docs, "children").query("caregiver == 'expected-danger'").iloc[0]
    most = worst.difference.split()[0].lstrip("+")
    robot = house[house.caregiver != "none"]
    struck, grazed, dropped = (
        round((robot[column] * robot.episodes).sum()) for column in ("strikes", "strikes_surface", "candles_dropped")
    )
    shown = max(_decidable_in(robot, name) for name in robot.caregiver.unique())
    text = (
        "In the grid, `nearest`, `expected-danger` (the paper's rule) and `foresight` (a planner) significantly "
        f"increased damage in {harmed} of {pairs} conditions (a house and a toddler); an increase could have been "
        f"detected in at least {min(could)}. The worst is a child that follows the robot: with children of "
        f"other kinds `expected-danger` increased damage in {worst.harmed}, by up to {most} an "
        f"episode. In {robot.episodes.sum():,} physical episodes the robot struck a child {grazed} times by the "
        f"stricter of two counts ({struck} by the other) and dropped {dropped} things; an increase of damage could "
        f"have been detected in {shown} of {robot.groupby('caregiver').size().max()}. [Limits](docs/guide/limits.md)"
    )
    rows = [
        f"| {title} | " + " | ".join(f"{_summed(cells, name):.1f}" for name in ("none", *_CLAIMED[2:])) + " |"
        for title, cells in (
            (f"grid, {test.house.nunique()} houses (`test-100`)", test),
            (f"grid, {drawn.house.nunique()} houses drawn by hand (`drawn-10`)", drawn),
            (f"physical house, {house.house.nunique()} of all shapes", house),
        )
    ]
    head = [
        "| damage in an episode, five toddlers, one at a time, summed | alone | `expected-danger` | `foresight` |",
        "|---|---|---|---|",
    ]
    return "\n".join([textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False), "", *head, *rows])


def _read_harm(docs: pathlib.Path, name: str) -> pd.DataFrame:
    """Return a report's table of harm by hazards; its columns have been called differently."""
    titles = ("run", "caregiver", "harmed", "detectable", "worse", "worst", "alone", "with", "difference")
    return pd.read_csv(docs / name / "tables" / "harm_by_hazards.csv", names=titles, header=0)


def _of_novices(cells: pd.DataFrame) -> pd.Series:
    """Return which rows are of novices, and not of children with names."""
    return ~cells.family.astype(str).str.contains("[a-z]")


def _decidable(harm: pd.DataFrame, caregiver: str) -> int:
    """Return in how many pairs of the first run harm could be shown, as the report says."""
    return int(harm.loc[(harm.run == harm.run.iloc[0]) & (harm.caregiver == caregiver), "detectable"].item())


def _decidable_in(cells: pd.DataFrame, caregiver: str) -> int:
    """Return the same of few pairs, whose p are not too small for four digits."""
    least = cells.loc[cells.caregiver == caregiver, "harm_p_least"]
    return int((least * len(least) <= LEVEL).sum())


def _summed(cells: pd.DataFrame, caregiver: str) -> float:
    """Return the damage of an episode, a mean over houses, summed over toddlers."""
    return float(cells[cells.caregiver == caregiver].groupby("family").damage.mean().sum())


def tables_of_the_paper(docs: pathlib.Path) -> str:
    """Return README's table of what the rule leaves in house `paper`, beside the paper's."""
    lines = ["| random moves | paper | here | deviation | why |", "|---|---|---|---|---|"]
    for row in Tables(docs).paper():
        theirs, ours = row["paper"], row["grid"][0]
        why = "chance of 20 episodes" if row["by_chance"] else "beyond chance: their map is missing"
        lines.append(f"| {100 * row['epsilon']:g} % | {theirs:.3f} | {ours:.3f} | {ours - theirs:+.3f} | {why} |")
    return "\n".join(lines)


def write_readme(docs: pathlib.Path, readme: pathlib.Path) -> None:
    """Write both into README, each from `<!-- name -->` to `<!-- end of name -->`."""
    text = readme.read_text("utf-8")
    for name, made in {"claim": main_results, "paper": tables_of_the_paper}.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        if not 0 <= text.find(begin) < text.find(end):
            raise CaregiverError(f"{readme} must have a place for '{name}', got none")
        before, _, rest = text.partition(begin)
        text = f"{before}{begin}{made(docs)}\n{end}{rest.partition(end)[2]}"
    readme.write_text(text, "utf-8")


class Tables:
    """The tables in the documentation, for the template."""

    def __init__(self, docs: pathlib.Path):
        """Look for them in a folder."""
        self.docs = docs

    def read(self, file: str, before: str = "") -> Rows:
        """Return a table, as `read_table` does."""
        return read_table(self.docs, file, before)

    def row(self, table: str, caregiver: str) -> dict[str, str]:
        """Return the cells of a caregiver of the first run in a table of a report; without what follows an interval."""
        every = self.read(table)
        rows = [row for row in every if row["run"] == every[0]["run"] and row["caregiver"] == caregiver]
        return {title: _interval(cell) for title, cell in rows[0].items()} if rows else {}

    def left(self, name: str, caregiver: str) -> list[str]:
        """Return the damage left by a caregiver in the first run of a report, a cell for each child."""
        return [*self.row(f"{name}/tables/damage_left_by_each_caregiver.csv", caregiver).values()][2:]

    def harm(self, name: str, caregiver: str) -> tuple[str, str, str]:
        """Return in how many conditions a caregiver does harm, and could be shown to, and the greatest difference."""
        row = _read_harm(self.docs, name).query("caregiver == @caregiver").iloc[0]
        return row.harmed, row.detectable, _interval(row.difference)

    def closed(self, caregiver: str) -> str:
        """Return the share of the way from the rule to the planner that a caregiver goes; "" if it was not run."""
        sums = self.sums(_GRID)
        rule, planner = sums["expected-danger"], sums["foresight"]
        return f"{(rule - sums[caregiver]) / (rule - planner):.0%}" if caregiver in sums else ""

    def houses(self, file: str) -> pd.DataFrame:
        """Return the means in each house."""
        return pd.read_csv(self.docs / file)

    def exists(self, file: str) -> bool:
        """Return whether there is such a file."""
        return (self.docs / file).exists()

    def sums(self, file: str) -> dict[str, float]:
        """Return the damage of an episode, a mean over houses, summed over children, by caregiver."""
        cells = self.houses(file)
        return {name: _summed(cells, name) for name in cells.caregiver.unique()}

    def harmed(self, file: str) -> dict[str, str]:
        """Return in how many conditions each caregiver increases the damage, in how many it could be shown, and all."""
        every = self.houses(file)
        return {
            name: f"{(own.harm_verdict == 'more').sum()}/{_decidable_in(every, name)}/{len(own)}"
            for name, own in every.groupby("caregiver")
        }

    def paper(self) -> list[dict[str, Any]]:
        """Return the rows of the paper's Tables I and II beside ours: damage left, and timesteps."""
        grid, house = (self.houses(f"{file}-paper.csv") for file in ("results/houses_grid", "house/houses_house"))
        rows = []
        for epsilon in sorted(grid.epsilon.unique(), reverse=True):
            of = {name: grid[(grid.caregiver == name) & (grid.epsilon == epsilon)].iloc[0] for name in _CLAIMED}
            alone, rule = of["none"], of["expected-danger"]
            without, guarded = PUBLISHED["damage_normalised"][epsilon]
            physical = house[(house.caregiver == "expected-danger") & (house.epsilon == epsilon)].iloc[0]
            rows.append(
                {
                    "epsilon": epsilon,
                    "paper": guarded / without,
                    "by_chance": by_chance(guarded / without, _estimate(rule), rule.episodes),
                    "grid": _estimate(rule),
                    "steps": [*zip(PUBLISHED["timesteps_to_threshold"][epsilon], _steps(alone, rule), strict=True)],
                    "house": _estimate(physical),
                }
            )
        return rows


def by_chance(theirs: float, ours: Sequence[float], episodes: int) -> bool:
    """Return whether a number of the paper is in the interval of as few episodes as its own.

    Ours, with its interval, is of more `episodes`; that of fewer is wider by the root of their ratio.
    """
    value, *ends = ours
    low, high = (value + math.sqrt(episodes / _EPISODES_OF_THE_PAPER) * (end - value) for end in ends)
    return bool(low <= theirs <= high)


def _estimate(cell: Any) -> list[float]:
    return [cell.damage_left, cell.damage_left_ci_low, cell.damage_left_ci_high]


def _steps(*cells: Any) -> list[float]:
    return [cell.timesteps_to_threshold for cell in cells]


def _interval(cell: str) -> str:
    """Return a cell of a report as pages have it: a number with its interval, or all of another cell."""
    cell = cell.replace("−", "-")
    found = re.match(r"(\S+) \[(\S+), (\S+)\]", cell)
    return f"{found[1]} ({found[2]} to {found[3]})" if found else cell


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add_file("runs", "finished runs to report on and publish", "DIR", nargs="+")
    parser.add_file("beside", "others, of which the means of each house are published", "DIR", nargs="+")
    parser.add("name", "results", "of the folder in the documentation", said=False)


def run(options: argparse.Namespace) -> Page:
    """Report on runs and publish them; return the page of what is published."""
    docs = options.docs or DOCS
    if options.docs:
        if options.runs:
            call(["report", *map(str, options.runs)])
        if options.runs or options.beside:
            publish(options.runs or (), options.beside or (), docs, options.name)
        write_readme(docs, docs.parent / "README.md")
    return Page({"tables": Tables(docs), "others": _OTHERS})
