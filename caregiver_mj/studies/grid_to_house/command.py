"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

from caregiver_mj.studies import grid_to_house
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.grid_to_house.document import document
from caregiver_mj.studies.grid_to_house.figures import draw
from caregiver_mj.studies.grid_to_house.measure import measure
from caregiver_mj.studies.trials import add_jobs


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=grid_to_house.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--episodes", type=int, default=20, help="episodes for each epsilon (default: 20)")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="also write the page and its figures there")
    options = parser.parse_args(arguments)
    results = measure("paper", options.episodes, options.jobs)
    asked = f" --episodes {options.episodes}" if options.episodes != parser.get_default("episodes") else ""
    text = document(results, f"python scripts/grid_to_house.py{asked} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "grid_to_house", text, draw(results), ("png", "svg"))
