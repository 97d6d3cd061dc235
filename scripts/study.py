"""Run a study of the project: `python scripts/study.py NAME [options]`.

A study is a module in `studies/`. Its docstring describes the measurement, `add_options` declares its options, and
`run` prints the results, or returns a `Page` for the template `studies/NAME.md`.
"""

from __future__ import annotations

import argparse
import ast
import csv
import dataclasses
import functools
import hashlib
import importlib
import inspect
import io
import json
import pathlib
import re
import shlex
import sys
import textwrap
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import jinja2
import numpy as np
import pandas as pd
import rich.box
import rich.table
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress, track

from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.provenance import source_digest, versions
from caregiver_mj.experiments.run_folder import RunFolder, check_folder
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import episode_seed, episode_streams
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.figure_style import as_bytes

Job = TypeVar("Job", bound=Hashable)
Result = TypeVar("Result")
Item = TypeVar("Item")
Rows = list[dict[str, str]]  # of a table, by its titles
AnyWorld = TypeVar("AnyWorld", bound=GridWorld)

FOLDER = pathlib.Path(__file__).with_name("studies")
# Houses for measuring the robot's skills: those of the package, and a generated one with 13 x 14 cells, four candles
# and four bare tables.
HOUSES = ("paper", "apartment", "house-20")
_WIDTH = 120  # characters of a line of a page, and of a printed table without a terminal


# -- Options -----------------------------------------------------------------------------------------


class Parser(argparse.ArgumentParser):
    """The options of a study, which can be formatted as the command that makes its page."""

    def __init__(self, name: str, description: str | None):
        super().__init__(
            prog=f"study.py {name}", description=description, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        self._name, self._said = name, list[argparse.Action]()

    def add(self, name: str, default: Any = None, what: str = "", *, said: bool = True, **details: Any) -> None:
        """Add the option `--name`.

        Args:
            name: Name without the dashes.
            default: Default value, whose type, or for a list that of its members, is the option's; False makes a flag.
            what: Help text, to which the default is added.
            said: Whether the page depends on it, so that the command in the page includes it.
            details: Further arguments of `argparse.ArgumentParser.add_argument`.
        """
        members = default if isinstance(default, list) else [default]
        if default is False:
            details["action"] = "store_true"
        elif members and members[0] is not None:
            details.setdefault("type", type(members[0]))
            what = f"{what} (default: {' '.join(map(str, members))})".lstrip()
        if isinstance(default, list):
            details.setdefault("nargs", "+")
        action = self.add_argument(f"--{name}", default=default, help=what, **details)
        if said:
            self._said.append(action)

    def add_jobs(self) -> None:
        """Add `--jobs`."""
        self.add("jobs", 2, "worker processes", said=False)

    def add_file(self, name: str, what: str, metavar: str = "FILE", **details: Any) -> None:
        """Add an option for a file or folder, on which the page does not depend."""
        self.add(name, None, what, said=False, type=pathlib.Path, metavar=metavar, **details)

    def add_trials(self, name: str, count: int, first: int = 0) -> None:
        """Add the options of trials in the house: their number (`--<name>`), `--first`, `--jobs` and `--json`."""
        self.add(name, count, "number of trials", dest="trials")
        self.add("first", first, "seed of the first", metavar="SEED")
        self.add_file("json", "also write all results to a file")
        self.add_jobs()

    def command(self, options: argparse.Namespace) -> str:
        """Return the command that makes a page, with all options other than defaults."""
        words = ["python", "scripts/study.py", self._name]
        for action in self._said:
            if (value := getattr(options, action.dest)) != action.default:
                values = value if isinstance(value, list) else [] if value is True else [value]
                words += [action.option_strings[0], *map(str, values)]
        return shlex.join([*words, "--docs", "docs"])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a study; return the exit status, which is 2 for bad input."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    chooser = argparse.ArgumentParser(
        prog="study.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, epilog=_contents()
    )
    chooser.add_argument("name", choices=names(), metavar="NAME", help="one of those below; NAME --help says more")
    name = chooser.parse_args(given[:1]).name
    study = importlib.import_module(f"studies.{name}")
    parser = Parser(name, study.__doc__)
    study.add_options(parser)
    if (FOLDER / f"{name}.md").exists():
        parser.add_file("docs", "write the page and its figures there", "DIR")
    options = parser.parse_args(given[1:])
    try:
        found = study.run(options)
    except CaregiverError as error:
        parser.error(str(error))
    if not isinstance(found, Page):
        return int(found or 0)
    text, tables = take_tables(found.text(name, parser.command(options)))
    print(text, end="")
    if options.docs:
        found.write(options.docs, name, text, tables)
    return 0


def names() -> list[str]:
    """Return the names of all studies."""
    return sorted(path.stem for path in FOLDER.glob("[!_]*.py"))


def _contents() -> str:
    """Return a list of studies, with the first lines of their docstrings, read without importing them."""
    lines = ["studies:"]
    for name in names():
        summary, *_ = (ast.get_docstring(ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))) or "").splitlines()
        lines.append(f"  {name:17} {summary}")
    return "\n".join(lines)


# -- Pages -------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Page:
    """The content of a study's template."""

    values: Mapping[str, Any]  # by their names in the template; the template has `command` besides
    # By the names of their files, such as "coverage.png".
    figures: Mapping[str, Figure] = dataclasses.field(default_factory=dict)
    name: str = ""  # name of the page; that of the study by default

    def text(self, study: str, command: str) -> str:
        """Return the page of a command."""
        environment = jinja2.Environment(loader=jinja2.FileSystemLoader(FOLDER), undefined=jinja2.StrictUndefined)
        environment.filters |= {made.__name__: made for made in (interval, listed, percent, share, side, verdict)}
        environment.filters["form"] = format
        environment.globals["table"] = table
        return fill(environment.get_template(f"{study}.md").render(self.values, command=command))

    def write(self, folder: pathlib.Path, study: str, text: str, tables: Mapping[str, str]) -> None:
        """Write the page, with the marks that it had, the tables beside it, and its figures."""
        folder.mkdir(parents=True, exist_ok=True)
        if (page := folder / f"{self.name or study}.md").exists():
            title, _, rest = text.partition("\n\n")
            old = "".join(found[0] for found in MARK.finditer(page.read_text("utf-8")))
            text = f"{title}\n\n{old}\n{rest}" if old else text
        for file, table_text in {f"{self.name or study}.md": text, **tables}.items():
            (folder / file).write_text(table_text, encoding="utf-8")
        for file, figure in self.figures.items():
            (folder / file).write_bytes(as_bytes(figure, file.rpartition(".")[2]))


# Of `scripts/reproduce`: entry and version; and the line below that says that this is no longer the code's.
MARK = re.compile(r"<!-- scripts/reproduce: ([\w-]+); (.+) -->\n(?:\*`\1`, of .*\*\n)?")
_TABLE = re.compile(r"<!-- (\S+\.csv) -->\n(\|.*(?:\n\|.*)*)\n+")


def take_tables(text: str) -> tuple[str, dict[str, str]]:
    """Take long tables out of a page: those below a mark such as `<!-- calibration_children.csv -->`.

    Args:
        text: The page in Markdown.

    Returns:
        The page without them, and each as CSV, by the name of its file. Tables of one name are one file: their titles
        must be equal.
    """
    files: dict[str, io.StringIO] = {}
    for name, lines in _TABLE.findall(text):
        rows = markdown_cells(lines)[name in files :]
        csv.writer(files.setdefault(name, io.StringIO()), lineterminator="\n").writerows(rows)
    tables = {name: file.getvalue() for name, file in files.items()}
    return _TABLE.sub("", text).rstrip("\n") + "\n", tables


def markdown_cells(lines: str) -> list[list[str]]:
    """The cells of a table in Markdown, titles first, without marks of code and emphasis."""
    rows = [re.split(r"(?<!\\)\|", line.strip())[1:-1] for line in lines.strip().splitlines()]
    return [[re.sub(r"[`*\\]", "", cell).strip() for cell in row] for row in (rows[0], *rows[2:])]


def read_table(docs: pathlib.Path, page: str, before: str = "") -> Rows:
    """Return a table: a CSV file, or the first one after some words of a page, without its marks."""
    text = (docs / page).read_text("utf-8")
    if page.endswith(".csv"):
        titles, *rows = csv.reader(text.splitlines())
    else:
        text = text.partition(before)[2]
        titles, *rows = markdown_cells(text[text.index("\n|") :].lstrip().partition("\n\n")[0])
    return [dict(zip(titles, row, strict=True)) for row in rows]


def fill(text: str) -> str:
    """Wrap the paragraphs and list items of a page in Markdown."""
    return "\n\n".join(_fill(block) for block in re.split(r"\n\s*\n", text.strip())) + "\n"


def _fill(block: str) -> str:
    if block.startswith(("#", "|", "!", "    ", "<!--")):
        return block
    items = []
    for item in re.split(r"\n(?=- )", block):
        indent = "  " if item.startswith("- ") else ""
        words = re.sub(r"[ \n]+", " ", item).strip()
        items.append(
            textwrap.fill(words, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        )
    return "\n".join(items)


def fill_in(page: pathlib.Path, study: str, text: str) -> None:
    """Write into an existing page, between `<!-- made by scripts/study.py STUDY -->` and `<!-- end -->`.

    Raises:
        CaregiverError: The page has no such place.
    """
    maker = f"scripts/study.py {study}"
    before, begin, rest = page.read_text(encoding="utf-8").partition(f"<!-- made by {maker} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise CaregiverError(f"{page} must have a place for {maker}, got none")
    page.write_text(f"{before}{begin}\n{text}\n\n{end}{after}", encoding="utf-8")


def table(titles: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown whose first column is text and whose others are numbers."""
    head = [*titles]
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def interval(estimate: Iterable[float], digits: int = 2, sign: str = "", exact: bool = False) -> str:
    """Return an estimate with its interval as text; a dash if undefined or unbounded.

    Args:
        estimate: The value and the ends of its interval.
        digits: Decimal places.
        sign: "+" to sign positive numbers.
        exact: Whether to omit an interval without width.
    """
    value, low, high = (float(number) for number in estimate)
    shown, first, last = (f"{round(number, digits) + 0.0:{sign}.{digits}f}" for number in (value, low, high))  # no -0.0
    if np.isnan(value):
        return "–"
    if exact and low == high:
        return shown
    return f"{shown} ({first} to {last})" if np.isfinite((low, high)).all() else f"{shown} (–)"


def share(estimate: Iterable[float]) -> str:
    """Return an estimate in percent, with its interval, as text."""
    value, low, high = (float(number) for number in estimate)
    shown = f"{100 * value:.0f} %"
    return f"{shown} ({100 * low:.0f} to {100 * high:.0f})" if np.isfinite((value, low, high)).all() else f"{shown} (–)"


def rest(estimate: Estimate[float]) -> Estimate[float]:
    """Return 1 minus an estimated share."""
    value, low, high = estimate
    return Estimate(1 - value, 1 - high, 1 - low)


def percent(value: float, digits: int = 1) -> str:
    """Return a share in percent, as text."""
    return f"{100 * value:.{digits}f} %"


def listed(items: Iterable[Any]) -> str:
    """Return items as an enumeration."""
    *first, last = map(str, items)
    return f"{', '.join(first)} and {last}" if first else last


def side(estimate: Estimate[float], of: float = 0.0) -> int:
    """Return 1 or -1 if the whole interval is above or below a number; else, or if unbounded, 0."""
    if not np.isfinite(estimate).all():
        return 0
    return int(estimate.low > of) - int(estimate.high < of)


def verdict(estimate: Estimate[float], below: str, neither: str, above: str, of: float = 0.0) -> str:
    """Return a word for an interval that is below, above or on neither side of a number."""
    return (neither, above, below)[side(estimate, of)]


# -- Jobs --------------------------------------------------------------------------------------------


def run_all(
    function: Callable[[Job], Result], jobs: Sequence[Job], processes: int, doing: str, out: pathlib.Path | None = None
) -> list[Result]:
    """Run a function over jobs in worker processes, with progress on standard error.

    Args:
        function: An importable function.
        jobs: Hashable jobs, each with a different text.
        processes: Number of workers; 1 runs the jobs in this process.
        doing: Description of the work.
        out: A folder in which results of jobs in the grid are stored as JSON, and looked up first.

    Returns:
        Results in the order of the jobs.

    Raises:
        CaregiverError: The folder holds results of another function, or of other versions.
    """
    settings: dict[str, Any] = {}
    if out:
        settings = {"study": f"{function.__module__}.{function.__qualname__}", "versions": versions()}
        # Results of another version of the package or of the study are refused.
        own = pathlib.Path(inspect.getfile(function)).read_bytes()
        settings["source"] = f"{source_digest('grid')} {hashlib.sha256(own).hexdigest()[:12]}"
    folder = RunFolder(out, settings, resume=True) if out else None
    found: dict[Job, Any] = {job: kept for job in jobs if folder and (kept := folder.read(_file_name(job)))}
    pending = [job for job in jobs if job not in found]
    running = run_jobs(function, pending, processes)
    for job, result in progress(running, doing, len(pending)):
        if folder:
            folder.write(_file_name(job), result)  # type: ignore[arg-type]  # such results are JSON
        found[job] = result
    return [found[job] for job in jobs]


def run_episodes(settings: Settings, jobs: int) -> pd.DataFrame:
    """Return the episodes of an evaluation, a row each, with a progress bar on standard error."""
    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task(f"{settings.world} {settings.place}", total=sum(map(len, settings.blocks())))
        return evaluate(settings, jobs=jobs, progress=lambda done: bar.advance(task, done)).episodes


def read_run(folder: pathlib.Path) -> tuple[pd.DataFrame, Settings]:
    """Return the episodes of a finished run of `caregiver-mj evaluate`, and its settings.

    Raises:
        CaregiverError: The folder holds no finished run, or links.
    """
    check_folder(folder)
    try:
        record = json.loads((folder / "run.json").read_text("utf-8"))
        return pd.read_parquet(folder / "episodes.parquet"), Settings.of_record(record)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CaregiverError(f"'{folder}' must hold a finished run, got {error}") from error


def damage_sums(episodes: pd.DataFrame) -> list[np.ndarray]:
    """Return for each house the damage summed over the families, by episode number."""
    by = episodes.groupby(["house", "episode"], sort=False).damage.sum()
    return [house.to_numpy(float) for _, house in by.groupby(level="house", sort=False)]


def progress(items: Iterable[Item], doing: str, count: int | None = None) -> Iterable[Item]:
    """Yield the items, with progress on standard error."""
    return track(items, doing, total=count, console=Console(stderr=True))


def _file_name(job: Hashable) -> str:
    return re.sub(r"[^\w.,:=-]+", "_", str(job))


def streams(episodes: int, seed: int = 0, children: int = 1) -> list[tuple[RandomStream, ...]]:
    """Return the random streams of the episodes of `evaluate` with a seed."""
    return [episode_streams(episode_seed(seed, episode), children) for episode in range(episodes)]


def run_in_grid(
    make: Callable[[FloorPlan, ChildGroup], AnyWorld],
    plan: FloorPlan,
    families: Iterable[ChildGroup | float | str],
    episodes: int,
    seed: int = 0,
    look: Callable[[AnyWorld], None] | None = None,
) -> AnyWorld:
    """Run the episodes of `evaluate` with a seed in one batch, and return the world.

    Args:
        make: Makes the world from a house and children.
        plan: The house.
        families: Child groups of the same size, one after the other.
        episodes: Number of episodes with each family.
        seed: Seed of the run.
        look: Called with the world after each timestep.
    """
    made = [ChildGroup.of(family) for family in families]
    world = make(plan, side_by_side(plan, made, episodes))
    if look:
        world.observers = [look]
    world.run(streams(episodes, seed, len(made[0])) * len(made))
    return world


@functools.cache  # plans cache their properties
def load_house(name: str) -> FloorPlan:
    """Load a house, once in a process."""
    return FloorPlan.load(name)


# -- Trials in the house -----------------------------------------------------------------------------


def run_trials(function: Callable[[int], dict[str, Any]], options: argparse.Namespace, doing: str) -> pd.DataFrame:
    """Run the trials of the options, and return a row each."""
    seeds = range(options.first, options.first + options.trials)
    return pd.DataFrame(run_all(function, seeds, options.jobs, doing))


def mishaps(outcome: Mapping[str, float]) -> dict[str, int]:
    """Return the strikes and dropped candles of a task's outcome."""
    return {"strikes": int(outcome["strikes"]), "drops": int(outcome["candles_dropped"])}


def write_json(path: pathlib.Path | None, rows: pd.DataFrame) -> None:
    """Write all results to a file, if given."""
    if path:
        path.write_text(json.dumps(rows.to_dict("records"), indent=2) + "\n", encoding="utf-8")


# -- Tables on screen --------------------------------------------------------------------------------


def make_console() -> Console:
    """Return a console that does not squeeze tables in a file."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDTH)


def make_table(title: str, *columns: str) -> rich.table.Table:
    """Return a table whose first column is text and whose others are numbers."""
    made = rich.table.Table(title=title, box=rich.box.SIMPLE_HEAD, title_justify="left")
    for i, column in enumerate(columns):
        made.add_column(column, justify="right" if i else "left", no_wrap=not i)
    return made


if __name__ == "__main__":
    from study import main as run_study  # the module that studies import, not its copy that runs as a script

    raise SystemExit(run_study())
