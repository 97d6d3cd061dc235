"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

from caregiver_mj.studies import several_children
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.several_children.document import document
from caregiver_mj.studies.several_children.figures import draw
from caregiver_mj.studies.several_children.measure import rows, run
from caregiver_mj.studies.trials import add_jobs

EPISODES = {"grid": 2000, "house": 20}


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=several_children.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--house", nargs="+", default=["paper", "apartment"], help="(default: paper apartment)")
    parser.add_argument("--world", nargs="+", default=["grid", "house"], choices=["grid", "house"])
    parser.add_argument("--episodes", type=int, help="in each world (default: 2000 in the grid, 20 in the house)")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    episodes = {world: options.episodes or count for world, count in EPISODES.items()}
    found = rows(run(options.house, options.world, episodes, options.jobs))
    asked = f" --episodes {options.episodes}" if options.episodes else ""
    text = document(found, f"scripts/several_children.py{asked} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "several_children", text, draw(found), ("svg",))
