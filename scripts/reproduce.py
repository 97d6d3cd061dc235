"""Make every number, table and figure of the documentation, as `scripts/manifest.toml` says.

Entries whose pages are of the present code are left out, and what an interrupted run has finished is not repeated. The
pages of an entry have a mark with the digest of what decides its rows: the sources of the grid or of the house, those
of its studies, and its commands. `--mark` writes below each mark whether that is still the code's.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import hashlib
import importlib.metadata
import importlib.util
import pathlib
import re
import resource
import shlex
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from caregiver_mj.experiments.provenance import OWN, code, source_digest
from study import MARK

ROOT = pathlib.Path(__file__).parents[1]
MANIFEST = pathlib.Path(__file__).with_name("manifest.toml")
_LAST = ("scripts/study.py results --docs {docs}", "scripts/paper_figures.py --docs {docs}")
# Commands that only show what others have run, as `cli` and `viz` do in the package.
_SHOW = ("scripts/study.py results", "scripts/leaderboard_page.py", "examples/learning_page.py")
_TABLE_END = "<!-- end -->"
_CLOCK = re.compile(r"[\d.]+ core-minutes")
_AS = ", rows of "  # in a mark, between the present sources and those that made the rows
_PLACE = re.compile(r" --[\w-]+(?: \S*\{\w+\}\S*)+| --resume")  # options that say where or how, not what


@dataclasses.dataclass(frozen=True)
class Entry:
    """Something that the documentation shows.

    Attributes:
        name: Its name.
        world: "grid" or "house", whose sources decide its rows.
        minutes: Cost on one core.
        pages: The pages that show it, relative to the documentation.
        run: Commands, and for each what `--quick` appends to it; None to leave it out there.
        table: The page, one of `pages`, that has the last line which each command prints, or all if that is a table,
            from the entry's mark to `<!-- end -->`; all that they print is in `measured/NAME.txt`.
        needs: A module without which the entry is left out.
    """

    name: str
    world: str
    minutes: float
    pages: tuple[str, ...]
    run: tuple[tuple[str, str | None], ...]
    table: str = ""
    needs: str = ""

    @functools.cached_property
    def digest(self) -> str:
        """The digest of all that decides its rows."""
        found = hashlib.sha256(source_digest(self.world).encode())
        for command, _ in self.run:
            found.update(command.encode())
        for file in sorted({file for command, _ in self.run for file in _files(command)}):
            found.update(code(file))
        return found.hexdigest()[:12]

    @property
    def made(self) -> str:
        """What the mark of a page says that is made now."""
        return f"version {importlib.metadata.version(OWN)}, sources {self.digest}"

    def is_current(self, docs: pathlib.Path) -> bool:
        """Return whether all pages are of the present code."""
        known = read_marks(docs)  # a new entry may have no page yet
        return all(self.is_mark(known.get(docs / page, {}).get(self.name, "")) for page in self.pages)

    def is_mark(self, mark: str) -> bool:
        """Return whether a mark is of the present code, or of older code with equal rows."""
        return mark.partition(_AS)[0] == self.made


def read_manifest(path: pathlib.Path = MANIFEST) -> dict[str, Entry]:
    """Return the entries by name, in the order in which they are made."""
    found = {}
    for name, entry in tomllib.loads(path.read_text("utf-8")).items():
        run = tuple(
            (command, *quick, "")[:2] if quick != ["-"] else (command, None) for command, *quick in entry["run"]
        )
        found[name] = Entry(name, **entry | {"pages": tuple(entry["pages"]), "run": run})
    return found


def _files(command: str) -> Iterator[pathlib.Path]:
    """Yield the script or study that a command runs, if it decides rows."""
    script, *words = shlex.split(command)
    if command.startswith(_SHOW):
        return
    if script == "scripts/study.py":
        yield ROOT / "scripts/studies" / f"{words[0]}.py"
    elif script.endswith(".py"):
        yield ROOT / script


# -- Marks -------------------------------------------------------------------------------------------


def marks(text: str) -> dict[str, str]:
    """Return what the marks of a page say, by entry."""
    return dict(MARK.findall(text))


def marked(text: str, made: Mapping[str, str], entries: Mapping[str, Entry]) -> str:
    """Return a page with marks that say what is made of which version, and below each whether the code is newer.

    Marks stay where they are; new ones come below the title, and those of no entry go.
    """
    if new := "".join(_mark(name, made[name]) for name in made if name not in marks(text)):
        title, _, rest = text.partition("\n\n")
        text = f"{title}\n\n{new}{'' if MARK.match(rest) else chr(10)}{rest}"

    def renew(found: re.Match[str]) -> str:
        name, old = found[1], made.get(found[1], found[2])
        if name not in entries:
            return ""
        older = "" if entries[name].is_mark(old) else f"*`{name}`, of {old}: outdated.*\n"
        return _mark(name, old) + older

    return MARK.sub(renew, text)


def without_marks(text: str) -> str:
    """Return a page without marks, as its study writes it."""
    title, _, rest = text.partition("\n\n")
    return f"{title}\n\n{MARK.sub('', rest).lstrip()}"


def _mark(name: str, made: str) -> str:
    return f"<!-- scripts/reproduce: {name}; {made} -->\n"


def mark_all(
    docs: pathlib.Path,
    entries: Mapping[str, Entry],
    before: Mapping[pathlib.Path, Mapping[str, str]] = {},
    new: Entry | None = None,
) -> list[pathlib.Path]:
    """Bring the marks of all pages up to date.

    Args:
        docs: Folder of the documentation.
        entries: All entries.
        before: The marks that pages had before they were written anew, by file.
        new: An entry that has just been made.

    Returns:
        The pages that changed.
    """
    changed = []
    for path in sorted({docs / page for entry in entries.values() for page in entry.pages} & {*docs.rglob("*.md")}):
        text = path.read_text("utf-8")
        known = {**before.get(path, {}), **marks(text)}
        of_page = [entry for entry in entries.values() if path in [docs / page for page in entry.pages]]
        made = {entry.name: known.get(entry.name, "an unknown version") for entry in of_page}
        if new in of_page:
            made[new.name] = new.made
        if (renewed := marked(text, made, entries)) != text:
            path.write_text(renewed, "utf-8")
            changed.append(path)
    return changed


def read_marks(docs: pathlib.Path) -> dict[pathlib.Path, dict[str, str]]:
    """Return the marks of all pages, by file."""
    return {path: marks(path.read_text("utf-8")) for path in docs.rglob("*.md")}


def keep_equal(older: pathlib.Path, newer: pathlib.Path, docs: pathlib.Path, entries: Mapping[str, Entry]) -> list[str]:
    """Mark pages of older code as current if rows are equal; return the names of entries with other rows, or none.

    Args:
        older: Folder with `--quick` runs of the code that made the pages.
        newer: Folder with `--quick` runs of the present code.
        docs: Folder of the documentation.
        entries: All entries.
    """
    differ = []
    for entry in entries.values():
        pages = [(page, known[entry.name]) for page, known in read_marks(docs).items() if entry.name in known]
        runs = [older / f"{entry.name}-{mark.partition(_AS)[0].rpartition(' ')[2]}" for _, mark in pages]
        rows = [_rows(run) for run in (newer / f"{entry.name}-{entry.digest}", *runs)]
        if not rows[0] or any(others != rows[0] for others in rows[1:]):
            differ.append(entry.name)
            continue
        for page, mark in pages:
            if not entry.is_mark(mark):
                kept = _mark(entry.name, entry.made + _AS + mark.rpartition(" ")[2])
                page.write_text(page.read_text("utf-8").replace(_mark(entry.name, mark), kept), "utf-8")
    return differ


def _rows(run: pathlib.Path) -> dict[str, str]:
    """Return the tables in a run's folder without clocks, and what its commands have printed, by name."""
    tables = {
        path: pd.read_parquet(path).drop(columns="wall_seconds", errors="ignore") for path in run.rglob("*.parquet")
    }
    found = {path: table.to_csv() for path, table in tables.items()}
    for path in run.glob("*.txt"):
        found[path] = _CLOCK.sub("", path.read_text("utf-8").replace(str(run.parent), ""))
    return {str(path.relative_to(run)): text for path, text in found.items()}


# -- Runs --------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Maker:
    """How entries are made: folders of the runs and of the documentation, workers, and whether quickly."""

    runs: pathlib.Path
    docs: pathlib.Path
    jobs: int
    scheduler: str | None = None
    quick: bool = False

    def make(self, entry: Entry) -> bool:
        """Run the commands of an entry, and return whether all went well."""
        run, printed = self.runs / f"{entry.name}-{entry.digest}", []
        run.mkdir(parents=True, exist_ok=True)
        for number, (command, less) in enumerate(entry.run):
            if self.quick and less is None:
                continue
            done = run / f"{number}.txt"  # what a finished command has printed
            if not done.exists() or "{docs}" in command:
                words = self.words(f"{command} {less}" if self.quick else command, run)
                print(f"  {shlex.join(words)}", file=sys.stderr)
                with (run / "running.txt").open("w+", encoding="utf-8") as file:
                    program = [sys.executable, *(("-m", OWN) if words[0] == "caregiver-mj" else (words[0],))]
                    if subprocess.run([*program, *words[1:]], cwd=ROOT, stdout=file, check=False).returncode:
                        print(f"  failed: {shlex.join(words)}", file=sys.stderr)
                        return False
                (run / "running.txt").replace(done)
            printed.append((command, done.read_text("utf-8")))
        if entry.table:
            write_table(self.docs, entry, printed)
        return True

    def words(self, command: str, run: pathlib.Path) -> list[str]:
        """Return the words of a command."""
        if self.scheduler and command.startswith("caregiver-mj evaluate"):
            command = command.replace("--jobs {jobs}", f"--executor dask --scheduler {self.scheduler}")
        for name, value in {"run": run, "docs": self.docs, "jobs": self.jobs}.items():
            command = command.replace(f"{{{name}}}", str(value))
        return shlex.split(command)


def write_table(docs: pathlib.Path, entry: Entry, printed: Sequence[tuple[str, str]]) -> None:
    """Write what commands have printed: tables and last lines into the page of the entry, all into a file beside."""
    rows = [(_PLACE.sub("", command), text.strip()) for command, text in printed]
    last = [(command, text, text.splitlines()[-1]) for command, text in rows if text]
    shown = [text for _, text, line in last if line.startswith("|")]
    if lines := [f"| `{command}` | {line} |" for command, _, line in last if not line.startswith("|")]:
        shown.append("\n".join(["| command | result |", "|---|---|", *lines]))
    page = docs / entry.table
    text = page.read_text("utf-8")
    place = MARK.search(text, text.index(f"<!-- scripts/reproduce: {entry.name};"))
    assert place is not None
    begin, end = place.end(), text.index(_TABLE_END, place.end())
    page.write_text("\n\n".join([text[:begin].rstrip("\n"), *shown, text[end:]]), "utf-8")
    file = docs / "measured" / f"{entry.name}.txt"
    file.parent.mkdir(exist_ok=True)
    file.write_text("\n".join(f"$ python {command}\n{text}\n" for command, text in rows), "utf-8")


def make_all(maker: Maker, wanted: Sequence[Entry], entries: Mapping[str, Entry]) -> list[str]:
    """Make entries one after the other, and return the names of those that failed."""
    failed, spent, planned = [], 0.0, 0.0  # wall minutes, and core-minutes of the entries made so far
    costs = [10 / len(wanted) if maker.quick else one.minutes for one in wanted]
    for number, entry in enumerate(wanted, 1):
        rate = spent / planned if planned else 1 / maker.jobs
        left = sum(costs[number - 1 :]) * rate
        print(f"[{number}/{len(wanted)}] {entry.name}, {left:.0f} min left", file=sys.stderr)
        if entry.needs and importlib.util.find_spec(entry.needs) is None:
            print(f"  left out: needs {entry.needs}", file=sys.stderr)
            continue
        before, began, cpu = read_marks(maker.docs), time.monotonic(), _cpu_minutes()
        if maker.make(entry):
            mark_all(maker.docs, entries, before, entry)
        else:
            failed.append(entry.name)
        wall = (time.monotonic() - began) / 60
        spent, planned = spent + wall, planned + costs[number - 1]
        said = f"{time.strftime('%H:%M')} {entry.name}: {wall:.1f} min, {_cpu_minutes() - cpu:.1f} core-minutes"
        print(f"  {said}", file=sys.stderr)
        with (maker.runs / "log.txt").open("a", encoding="utf-8") as log:
            print(said, file=log)
    return failed


def _cpu_minutes() -> float:
    """Return the processor time of finished commands with their workers."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (used.ru_utime + used.ru_stime) / 60


def listing(entries: Mapping[str, Entry], docs: pathlib.Path) -> str:
    """Return the manifest, with what is current."""
    lines = []
    for entry in entries.values():
        state = "current" if entry.is_current(docs) else "stale"
        lines.append(f"{entry.name:<15} {entry.world:<6} {entry.minutes:>5g} min  {state:<8} {' '.join(entry.pages)}")
        lines += [f"    {_PLACE.sub('', command)}" for command, _ in entry.run]
    total = sum(entry.minutes for entry in entries.values())
    return "\n".join([*lines, f"{total:g} core-minutes in all, {total / 120:.1f} hours on two cores"])


def main(arguments: Sequence[str] | None = None) -> int:
    """Make what is asked for; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    entries = read_manifest()
    parser.add_argument("--only", nargs="+", choices=entries, metavar="NAME", help="make these, current or not")
    parser.add_argument("--list", action="store_true", help="print the manifest, with what is current")
    parser.add_argument("--mark", action="store_true", help="only say on the pages which are older than the code")
    equal = "after `--quick`: compare with RUNS/quick of the code that made the pages, and keep pages with equal rows"
    parser.add_argument("--equal", type=pathlib.Path, metavar="RUNS", help=equal)
    parser.add_argument("--quick", action="store_true", help="far less of all, into RUNS/quick; no page is touched")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="worker processes (default: %(default)s)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, for evaluations")
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "runs/reproduce", help="default: %(default)s")
    options = parser.parse_args(arguments)
    if options.jobs < 1:
        parser.error(f"--jobs must be at least 1, got {options.jobs}")
    runs, docs = options.runs.resolve(), ROOT / "docs"
    if options.list:
        print(listing(entries, docs))
        return 0
    if options.equal:
        differ = keep_equal(options.equal / "quick", runs / "quick", docs, entries)
        print("rows differ, or are not there:", ", ".join(differ) or "none")
    if options.equal or options.mark:
        print(*mark_all(docs, entries), sep="\n")
        return 0
    if options.quick:
        runs = runs / "quick"
        docs = shutil.copytree(ROOT / "docs", runs / "docs", dirs_exist_ok=True)
        shutil.copy(ROOT / "README.md", runs)
    runs.mkdir(parents=True, exist_ok=True)
    wanted = [
        entry
        for entry in entries.values()
        if (entry.name in options.only if options.only else options.quick or not entry.is_current(docs))
    ]
    maker = Maker(runs, docs, options.jobs, options.scheduler, options.quick)
    for entry in wanted:
        if entry.is_current(docs):  # it is wanted once more: not what its commands have printed before
            shutil.rmtree(runs / f"{entry.name}-{entry.digest}", ignore_errors=True)
    failed = make_all(maker, wanted, entries)
    before = read_marks(docs)
    for command in _LAST:  # from tables of several entries
        words = [sys.executable, *maker.words(command, runs)]
        if subprocess.run(words, cwd=ROOT, stdout=subprocess.DEVNULL, check=False).returncode:
            failed.append(command)
    mark_all(docs, entries, before)
    print(f"failed: {', '.join(failed)}" if failed else f"done: {docs}", file=sys.stderr)
    return int(bool(failed))


if __name__ == "__main__":
    raise SystemExit(main())
