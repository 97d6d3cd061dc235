"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

from caregiver_mj.studies import generalisation
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.generalisation.figure import draw
from caregiver_mj.studies.generalisation.measure import measure
from caregiver_mj.studies.generalisation.page import page
from caregiver_mj.studies.trials import add_jobs


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=generalisation.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--houses", default="test-20", help="the new houses (default: %(default)s)")
    parser.add_argument("--learnt-in", default="train-20", metavar="SET", help="experts' houses (default: %(default)s)")
    parser.add_argument("--alone", type=int, default=50, help="episodes of each novice alone (default: %(default)s)")
    parser.add_argument("--two", type=int, default=40, help="episodes of each two children (default: %(default)s)")
    parser.add_argument("--changing", type=int, default=40, help="of each that changes (default: %(default)s)")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    command = "scripts/generalisation.py"
    for name in ("houses", "learnt_in", "alone", "two", "changing"):
        if getattr(options, name) != parser.get_default(name):
            command += f" --{name.replace('_', '-')} {getattr(options, name)}"
    found = measure(options.houses, options.learnt_in, options.alone, options.two, options.changing, options.jobs)
    text = page(found, options.houses, options.learnt_in, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "generalisation", text, draw(found), ("png",))
