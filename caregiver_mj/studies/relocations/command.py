"""The study's command."""

from __future__ import annotations

import argparse
import dataclasses
import functools

from caregiver_mj.studies import relocations
from caregiver_mj.studies.display import make_console
from caregiver_mj.studies.houses import HOUSES
from caregiver_mj.studies.relocations.conditions import EACH, Conditions
from caregiver_mj.studies.relocations.relocation import Relocation, relocate
from caregiver_mj.studies.relocations.report import report, report_each
from caregiver_mj.studies.trials import add_trials, run_all, seeds, write_json

# What a condition is called on the command line, and what it is.
_NUMBERS = {
    "noise": "lasting error of perceived candle positions, one sigma, metres",
    "white": "white error of them at every control timestep, one sigma, metres",
    "white-base": "white error of the base's position, likewise",
    "white-child": "white error of the child's position, likewise",
    "dropout": "probability that each of these is not seen in a control timestep",
    "delay": "how old it is what the robot sees, seconds",
    "friction": "of everything, as a multiple of the models'",
    "mass": "of candles, likewise",
    "gain": "of the robot's servos, likewise",
}


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints its table."""
    parser = argparse.ArgumentParser(
        description=relocations.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_trials(parser, "count", 500)
    parser.add_argument(
        "--house",
        nargs="+",
        default=HOUSES,
        metavar="NAME",
        help=f"names or files of floor plans, which take turns (default: {' '.join(HOUSES)})",
    )
    plain = Conditions()
    for name, meaning in _NUMBERS.items():
        default = getattr(plain, name.replace("-", "_"))
        parser.add_argument(
            f"--{name}", type=float, metavar="X", default=default, help=f"{meaning} (default: %(default)s)"
        )
    parser.add_argument(
        "--table-height",
        type=float,
        nargs="+",
        default=[],
        metavar="METRES",
        help="of all tables, or lowest and highest",
    )
    parser.add_argument("--knock", action="store_true", help="have every candle knocked over before the robot comes")
    parser.add_argument("--embodiment", metavar="NAME", help="the robot (default: the task's own)")
    parser.add_argument(
        "--each", action="store_true", help="instead, so many under each condition that is held against the robot"
    )
    options = parser.parse_args(arguments)
    fields = [field.name for field in dataclasses.fields(Conditions)]
    asked = Conditions(
        **{name: getattr(options, name) for name in fields} | {"table_height": tuple(options.table_height)}
    )
    if options.each:
        each = {name: dataclasses.replace(conditions, embodiment=asked.embodiment) for name, conditions in EACH.items()}
        found = {name: _run(conditions, options, name) for name, conditions in each.items()}
        report_each(make_console(), found)
        write_json(options, [row for rows in found.values() for row in rows])
        return
    rows = _run(asked, options, "relocating")
    report(make_console(), rows)
    write_json(options, rows)


def _run(conditions: Conditions, options: argparse.Namespace, doing: str) -> list[Relocation]:
    function = functools.partial(relocate, conditions, houses=tuple(options.house))
    return run_all(function, seeds(options), options.jobs, doing)
