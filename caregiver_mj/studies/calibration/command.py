"""The study's command."""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Sequence

import pandas as pd

from caregiver_mj.caregivers.foresight.foresight import CHANGE
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.studies import calibration
from caregiver_mj.studies.calibration.figures import FEWEST, draw_collisions, draw_harmless
from caregiver_mj.studies.calibration.page import page
from caregiver_mj.studies.calibration.tally import House, tally_house
from caregiver_mj.studies.documents import write_figure, write_page
from caregiver_mj.studies.trials import add_jobs, run_all

_HOUSES = ["test-20"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=calibration.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--houses", nargs="+", default=_HOUSES, help="houses, or sets of them (default: test-20)")
    parser.add_argument("--episodes", type=int, default=100, help="of each child in each (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the run to which they belong (default: %(default)s)")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figures there")
    options = parser.parse_args(arguments)
    command = "scripts/calibration.py"
    if options.houses != _HOUSES:
        command += f" --houses {' '.join(options.houses)}"
    for name in ("episodes", "seed"):
        if (value := getattr(options, name)) != parser.get_default(name):
            command += f" --{name} {value}"
    jobs = [House(plan, options.episodes, options.seed) for plan in houses_named(options.houses)]
    rows = pd.concat(run_all(tally_house, jobs, options.jobs, "houses"), ignore_index=True)
    text = page(rows, " ".join(options.houses), options.episodes, CHANGE, FEWEST, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "calibration", text, draw_collisions(rows), ("png",))
        write_figure(options.docs, "calibration_safe", draw_harmless(rows), ("png",))
