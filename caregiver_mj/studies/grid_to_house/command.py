"""The study's command."""

from __future__ import annotations

import argparse
import pathlib

from caregiver_mj.experiments.settings import EPSILONS, Settings
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.studies import grid_to_house
from caregiver_mj.studies.documents import write_figure, write_page
from caregiver_mj.studies.grid_to_house.document import document, page_name
from caregiver_mj.studies.grid_to_house.figures import draw_houses, draw_steps
from caregiver_mj.studies.grid_to_house.measure import measure
from caregiver_mj.studies.grid_to_house.rows import RULE, Rows, read_rows, run_rows
from caregiver_mj.studies.grid_to_house.time_figure import draw_time
from caregiver_mj.studies.trials import add_jobs

_KINDS = ("png", "svg")


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints, or writes, its page."""
    parser = argparse.ArgumentParser(
        description=grid_to_house.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--run", type=pathlib.Path, metavar="DIR", help="a finished run in the house, to take it from")
    parser.add_argument("--aside", type=pathlib.Path, metavar="DIR", help="another one, of a house that does not count")
    parser.add_argument("--caregiver", default=RULE, help="who protects the children (default: %(default)s)")
    parser.add_argument(
        "--houses", default="test-10", help="set of houses, or one, to run without --run (default: %(default)s)"
    )
    parser.add_argument("--episodes", type=int, default=20, help="episodes in each, likewise (default: %(default)s)")
    parser.add_argument(
        "--watched", type=int, default=2, help="episodes to watch in each house for each epsilon (default: %(default)s)"
    )
    parser.add_argument(
        "--many", type=int, default=500, help="episodes for the breakdown in the grid (default: %(default)s)"
    )
    add_jobs(parser)
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="also write the page and its figures there")
    options = parser.parse_args(arguments)
    if options.run:
        rows = read_rows(options.run, options.caregiver)
    else:
        plans = houses_named([options.houses])
        names = ("none", options.caregiver)
        settings = Settings(plans, "house", names, EPSILONS, options.episodes, houses=options.houses)
        rows = run_rows(settings, options.jobs)
    aside = read_rows(options.aside, options.caregiver) if options.aside else None
    results = measure(rows, aside, options.watched, options.many, options.jobs)
    text = document(results, _commands(options, parser, rows, aside))
    print(text, end="")
    if options.docs:
        name = page_name(results)
        write_page(options.docs, name, text, draw_houses(results), _KINDS)
        write_figure(options.docs, f"{name}_steps", draw_steps(results), _KINDS)
        write_figure(options.docs, f"{name}_time", draw_time(results), _KINDS)


def _commands(
    options: argparse.Namespace, parser: argparse.ArgumentParser, rows: Rows, aside: Rows | None
) -> list[str]:
    """What to type for the same page: with folders by their names only, wherever they are here."""
    commands, command = [], "python scripts/grid_to_house.py"
    for option, found in (("run", rows), ("aside", aside)):
        folder = getattr(options, option)
        if folder and found is not None:
            settings = found.settings
            ran = f"caregiver-mj evaluate --world house --houses {settings.place} --episodes {settings.episodes}"
            if found.caregiver != RULE:
                ran += f" --caregiver none {found.caregiver}"
            if found.epsilons != EPSILONS:
                ran += f" --epsilon {' '.join(f'{e:g}' for e in found.epsilons)}"
            commands.append(f"{ran}{f' --seed {settings.seed}' if settings.seed else ''} --out runs/{folder.name}")
            command += f" --{option} runs/{folder.name}"
    for option in ("caregiver", "houses", "episodes", "watched", "many"):
        if getattr(options, option) != parser.get_default(option):
            command += f" --{option} {getattr(options, option)}"
    return [*commands, f"{command} --docs docs"]
