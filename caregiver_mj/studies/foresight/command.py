"""The study's command."""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Iterable, Sequence

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.studies import foresight
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.foresight.bars import Bars
from caregiver_mj.studies.foresight.figure import draw
from caregiver_mj.studies.foresight.measure import measure
from caregiver_mj.studies.foresight.page import page
from caregiver_mj.studies.foresight.variants import variants
from caregiver_mj.studies.trials import add_jobs


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=foresight.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--run", nargs="*", type=pathlib.Path, default=[], metavar="DIR", help="finished runs to judge foresight by"
    )
    parser.add_argument(
        "--houses", default="train-10", metavar="SET", help="to take it apart in (default: %(default)s)"
    )
    parser.add_argument(
        "--episodes", type=int, default=50, help="in each house, with each novice; 0 for none (default: %(default)s)"
    )
    parser.add_argument("--out", type=pathlib.Path, metavar="DIR", help="keep the variants' episodes, or take them")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    runs = [read(folder) for folder in options.run]
    rows = pd.DataFrame()
    if options.episodes:
        rows = _measured("apart", options.houses, options.episodes, variants(), options)
    text = page(runs, rows, _command(options, parser))
    print(text, end="")
    if not options.docs:
        return
    if len(rows):
        write_page(options.docs, "foresight", text, draw(rows), ("svg",))
    else:
        (options.docs / "foresight.md").write_text(text, encoding="utf-8")


def read(folder: pathlib.Path) -> Bars:
    """The episodes of a finished run.

    Raises:
        CaregiverError: There are none, or none with foresight and without a caregiver.
    """
    file = folder / "episodes.parquet"
    if not file.is_file():
        raise CaregiverError(f"no finished run in {folder}")
    rows = pd.read_parquet(file)
    for name in ("none", "foresight"):
        if name not in set(rows.caregiver):
            raise CaregiverError(f"no episodes with caregiver '{name}' in {folder}")
    return Bars(folder.name, rows)


def _measured(what: str, houses: str, episodes: int, names: Iterable[str], options: argparse.Namespace) -> pd.DataFrame:
    """Episodes with some variants: those that were kept, if there are any."""
    if not options.out:
        return measure(houses, episodes, options.jobs, names)
    file = options.out / f"{what}-{houses}-{episodes}.parquet"
    if not file.is_file():
        options.out.mkdir(parents=True, exist_ok=True)
        measure(houses, episodes, options.jobs, names).to_parquet(file, index=False)
    return pd.read_parquet(file)


def _command(options: argparse.Namespace, parser: argparse.ArgumentParser) -> str:
    words: Sequence[str] = ["python scripts/foresight.py"]
    if options.run:
        words = [*words, "--run", *(f"runs/{folder.name}" for folder in options.run)]
    for name in ("houses", "episodes"):
        if (value := getattr(options, name)) != parser.get_default(name):
            words = [*words, f"--{name}", str(value)]
    return " ".join([*words, "--docs docs"])
