"""What the robot does to the child by touch, and with the candle in its hand: in whole episodes of several houses.

Beside each other: strikes as ever, by the robot's speed towards the child, and by that of its surface, turning and
sliding too; pressings; forces, with what adults bear; and how close flame and wax come. The episodes are those of a
finished run in the house, or run here.
"""

from __future__ import annotations

import argparse
import pathlib

import pandas as pd

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.studies.grid_to_house.rows import run_rows
from caregiver_mj.studies.trials import add_jobs
from caregiver_mj.viz.report.contacts import counts_table, limits_table
from caregiver_mj.viz.report.words import family_name

CHILDREN = ("0.5", "adversary:0")


def read_episodes(run: pathlib.Path, caregiver: str) -> pd.DataFrame:
    """Episodes with one caregiver of a finished run in the house.

    Raises:
        CaregiverError: It is none, or one of a version that did not count contacts.
    """
    try:
        table = pd.read_parquet(run / "episodes.parquet")
    except (OSError, ValueError) as error:
        raise CaregiverError(f"'{run}' holds no finished run: {error}") from error
    table = table[(table.caregiver == caregiver) & (table.world == "house")]
    if table.empty or not set(Contacts().outcome()) <= set(table):
        raise CaregiverError(f"the run in '{run}' has no contacts of `{caregiver}` with children in the house")
    return table


def page(episodes: pd.DataFrame) -> str:
    """The tables, in Markdown."""
    groups = {family_name(family): group for family, group in episodes.groupby("family", sort=False)}
    if len(groups) > 1:
        groups["all"] = episodes
    return f"{counts_table(groups).markdown()}\n{limits_table(episodes).markdown()}"


def add_run(parser: argparse.ArgumentParser) -> None:
    """Adds the options that say which episodes."""
    parser.add_argument(
        "--run", type=pathlib.Path, metavar="DIR", help="a finished run in the house, to take them from"
    )
    parser.add_argument("--caregiver", default="paper", help="who protects the children (default: %(default)s)")
    parser.add_argument(
        "--houses", nargs="+", default=["train-5"], help="houses to run without --run (default: train-5)"
    )
    parser.add_argument("--epsilon", nargs="+", default=CHILDREN, help="children, likewise (default: .5 adversary:0)")
    parser.add_argument(
        "--episodes", type=int, default=2, help="episodes for each in each house (default: %(default)s)"
    )
    add_jobs(parser)


def episodes_of(options: argparse.Namespace) -> pd.DataFrame:
    """The episodes that the options say, read or run."""
    if options.run:
        return read_episodes(options.run, options.caregiver)
    plans = houses_named(options.houses)
    settings = Settings(plans, "house", (options.caregiver,), tuple(options.epsilon), options.episodes)
    return run_rows(settings, options.jobs).table


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints its tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_run(parser)
    print(page(episodes_of(parser.parse_args(arguments))))
