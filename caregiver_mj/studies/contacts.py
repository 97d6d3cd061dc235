"""What the robot does to the child by touch, and with the candle in its hand: in whole episodes of several houses.

Beside each other: strikes as ever, by the robot's speed towards the child, and by that of its surface, turning and
sliding too; pressings; forces, with what adults bear; and how close flame and wax come. The episodes are those of a
finished run in the house, or run here.
"""

from __future__ import annotations

import argparse
import functools
import pathlib
import time
from typing import Any

import pandas as pd

from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.seeds import episode_random, episode_seed
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.studies.trials import add_jobs, run_all
from caregiver_mj.tasks import load
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


def page(episodes: pd.DataFrame, compliant: bool = False) -> str:
    """The tables, in Markdown."""
    groups = {family_name(family): group for family, group in episodes.groupby("family", sort=False)}
    if len(groups) > 1:
        groups["all"] = episodes
    return f"{counts_table(groups).markdown()}\n{limits_table(episodes, compliant=compliant).markdown()}"


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
    parser.add_argument("--out", type=pathlib.Path, metavar="FILE", help="also write their rows there, as JSON")
    parser.add_argument("--embodiment", metavar="NAME", help="the robot, without --run (default: the task's own)")
    parser.add_argument("--compliant", action="store_true", help="children that give way to a push, without --run")
    add_jobs(parser)


def run(caregiver: str, compliant: bool, embodiment: str | None, job: tuple[str, str, int]) -> dict[str, Any]:
    """Runs one episode, that of `evaluate`, by its house, family and number; returns its row."""
    house, family, episode = job
    (plan,) = houses_named([house])
    kwargs = {"compliant_children": compliant, "embodiment": embodiment}
    env = load("supervise", plan, Family.parse(family), episode_random(0), task_kwargs=kwargs, visuals=False)
    policy, seed = CaregiverPolicy(env, caregiver), episode_seed(0, episode)
    env.task.reseed(episode_random(seed))
    start, timestep = time.process_time(), env.reset()
    while not timestep.last():
        timestep = env.step(policy(timestep))
    took = {"cpu_seconds": time.process_time() - start, "sim_seconds": env.physics.time()}
    return {"house": house, "family": family, "episode": episode, "seed": seed} | env.task.outcome() | took


def episodes_of(options: argparse.Namespace) -> pd.DataFrame:
    """The episodes that the options say, read or run."""
    if options.run:
        return read_episodes(options.run, options.caregiver)
    houses = [plan.name for plan in houses_named(options.houses)]
    families = [str(Family.parse(family)) for family in options.epsilon]
    jobs = [(house, family, i) for house in houses for family in families for i in range(options.episodes)]
    work = functools.partial(run, options.caregiver, options.compliant, options.embodiment)
    table = pd.DataFrame(run_all(work, jobs, options.jobs, "in the house"))
    if options.out:
        table.to_json(options.out, orient="records", indent=1)
    return table


def main(arguments: list[str] | None = None) -> None:
    """Runs the study and prints its tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_run(parser)
    options = parser.parse_args(arguments)
    print(page(episodes_of(options), options.compliant))
