"""The study's command."""

from __future__ import annotations

import argparse
import functools

from caregiver_mj.studies import relocations
from caregiver_mj.studies.display import make_console
from caregiver_mj.studies.relocations.relocation import Conditions, relocate
from caregiver_mj.studies.relocations.report import report
from caregiver_mj.studies.trials import add_trials, run_all, seeds, write_json


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints its table."""
    parser = argparse.ArgumentParser(
        description=relocations.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_trials(parser, "count", 500)
    parser.add_argument("--noise", type=float, default=0.0, help="of perceived candle positions, one sigma, metres")
    parser.add_argument("--knock", action="store_true", help="have every candle knocked over before the robot comes")
    parser.add_argument("--embodiment", metavar="NAME", help="the robot (default: the task's own)")
    options = parser.parse_args(arguments)
    conditions = Conditions(options.noise, options.knock, options.embodiment)
    found = run_all(functools.partial(relocate, conditions), seeds(options), options.jobs, "relocating")
    report(make_console(), found)
    write_json(options, found)
