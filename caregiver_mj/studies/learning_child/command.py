"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

from caregiver_mj.studies import learning_child
from caregiver_mj.studies.documents import write_page
from caregiver_mj.studies.learning_child.figure import draw
from caregiver_mj.studies.learning_child.measure import GUARDS, jobs_of, measure
from caregiver_mj.studies.learning_child.page import page
from caregiver_mj.studies.learning_child.words import FIRST
from caregiver_mj.studies.trials import add_jobs

_COUNTS = {
    "learners": (8, "children of each kind in each house with each caregiver"),
    "childhood": (30, "episodes with the caregiver"),
    "after": (15, "episodes alone after it has left"),
    "seed": (0, "seed of all chance"),
}


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=learning_child.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--houses", default="test-8", metavar="SET", help="default: %(default)s")
    parser.add_argument("--caregivers", nargs="+", default=list(GUARDS), metavar="NAME", help="default: %(default)s")
    for name, (default, is_what) in _COUNTS.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"{is_what} (default: %(default)s)")
    parser.add_argument("--epsilon", type=float, default=0.25, help="share of random moves (default: %(default)s)")
    parser.add_argument(
        "--exams", type=int, nargs="*", default=[0, 5, 10, 20, 30], metavar="AGE", help="default: %(default)s"
    )
    parser.add_argument("--out", type=pathlib.Path, metavar="DIR", help="keep the lives, or take those that are there")
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args(arguments)
    if options.childhood < FIRST or options.after <= FIRST:
        parser.error(f"childhood has at least {FIRST} episodes, and at least {FIRST + 1} come after it")
    counts = {name: getattr(options, name) for name in (*_COUNTS, "epsilon")}
    work = jobs_of(options.houses, options.caregivers, counts, options.exams)
    grown = measure(work, options.jobs, options.out)
    command = "scripts/learning_child.py"
    for name in ("houses", "caregivers", *_COUNTS, "epsilon", "exams"):
        if (value := getattr(options, name)) != parser.get_default(name):
            command += f" --{name} {' '.join(map(str, value)) if isinstance(value, list) else value}"
    text = page(grown, options.houses, options.epsilon, f"{command} --docs docs")
    print(text, end="")
    if options.docs:
        write_page(options.docs, "learning_child", text, draw(grown), ("png",))
