"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

import pandas as pd

from caregiver_mj.studies import sensitivity
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.sensitivity import house
from caregiver_mj.studies.sensitivity.document import document
from caregiver_mj.studies.sensitivity.figures import draw
from caregiver_mj.studies.sensitivity.measure import measure
from caregiver_mj.studies.sensitivity.places import Place
from caregiver_mj.studies.trials import add_jobs

_COUNTS = ("episodes", "set-episodes", "house-episodes")


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=sensitivity.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    places = ["paper", "apartment", "train-20"]
    parser.add_argument("--place", nargs="+", default=places, help=f"houses, or sets of them (default: {places})")
    parser.add_argument("--episodes", type=int, default=1000, help="in the grid of one house (default: %(default)s)")
    parser.add_argument("--set-episodes", type=int, default=100, help="in each of a set (default: %(default)s)")
    parser.add_argument(
        "--house-episodes", type=int, default=20, help="in the physical house; 0 for none (default: %(default)s)"
    )
    parser.add_argument(
        "--out", type=pathlib.Path, metavar="DIR", help="keep those there, and go on with what is there"
    )
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    command = "python scripts/sensitivity.py"
    if options.place != places:
        command += f" --place {' '.join(options.place)}"
    for name in _COUNTS:
        value = getattr(options, key := name.replace("-", "_"))
        command += f" --{name} {value}" * (value != parser.get_default(key))
    found = [Place.of(name, options.episodes, options.set_episodes) for name in options.place]
    results = measure(found, options.jobs)
    episodes = pd.DataFrame()
    if options.house_episodes:
        episodes = house.measure(options.house_episodes, options.jobs, options.out)
    text = document(results, episodes, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "sensitivity", text, draw(results), ("svg",))
