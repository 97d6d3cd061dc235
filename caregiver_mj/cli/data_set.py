"""What `record` does: it looks whether a data set can be made, runs the episodes, and makes it of them."""

from __future__ import annotations

import argparse
import contextlib
import functools
import pathlib
import shlex
from typing import TYPE_CHECKING

import rich.console
import rich.progress

from caregiver_mj.cli import PROGRAM
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.experiments.settings import episode_seed
from caregiver_mj.experiments.workers import LocalExecutor, WorkerError
from caregiver_mj.plans import sets
from caregiver_mj.plans.floor_plan import house_names
from caregiver_mj.recording.steps import Store

if TYPE_CHECKING:  # they need an extra, and MuJoCo
    from caregiver_mj.envs.recipe import Recipe


def check(arguments: argparse.Namespace, recipe: Recipe, name: str, target: pathlib.Path) -> None:
    """Raises CaregiverError, before anything is run, where the data set could not be written or not be made."""
    if arguments.format == "minari":
        from caregiver_mj.recording.minari_dataset import check_name

        check_name(name)
    elif arguments.name is not None:
        raise CaregiverError("--name is of a Minari data set; that of a LeRobot one is its folder, --out")
    try:
        if target.exists():
            raise CaregiverError(f"'{target}' is there already: a data set is not written over")
    except OSError as error:
        raise CaregiverError(f"'{target}' cannot be written: {error.strerror}") from None
    if arguments.format == "lerobot":
        from caregiver_mj.recording.lerobot.dataset import check_rate

        check_rate(recipe.about().rate)
    recipe.spaces()  # makes the house, and the caregiver


def collect_all(arguments: argparse.Namespace, recipe: Recipe, store: Store, executor: LocalExecutor) -> None:
    """Runs the episodes that are not there yet, with a progress bar; a recording that breaks off says how to go on."""
    from caregiver_mj.envs.recipe import collect

    jobs = [(i, episode_seed(recipe.seed, i)) for i in range(arguments.episodes) if i not in store]
    columns = (
        rich.progress.TextColumn("{task.description}"),
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeElapsedColumn(),
        rich.progress.TimeRemainingColumn(),
    )
    work = functools.partial(collect, recipe, store.path)
    found = arguments.episodes - len(jobs)
    try:
        with (
            rich.progress.Progress(*columns, console=rich.console.Console(stderr=True)) as bar,
            contextlib.closing(executor.run(work, jobs)) as running,
        ):
            task = bar.add_task("episodes", total=arguments.episodes, completed=found)
            for _ in running:
                found += 1
                bar.advance(task)
    except (KeyboardInterrupt, OSError, WorkerError) as error:
        what = str(error) or "interrupted"
        if not store.numbers():
            raise StorageError(f"{what}; there is no episode yet") from None
        again = arguments.argv if arguments.resume else [*arguments.argv, "--resume"]
        raise StorageError(
            f"{what}; {found} of {arguments.episodes} episodes are kept in '{store.path}', "
            f"go on with: {PROGRAM} {shlex.join(again)}"
        ) from None


def write(arguments: argparse.Namespace, recipe: Recipe, store: Store, name: str, target: pathlib.Path) -> None:
    """Makes the data set of the episodes."""
    episodes = (store.load(i) for i in range(arguments.episodes))
    try:
        if arguments.format == "minari":
            from caregiver_mj.recording.minari_dataset import write_minari

            spec = recipe.spec(_known_name(arguments.house))
            write_minari(pathlib.Path(arguments.out), name, episodes, recipe.about(), recipe.spaces(), spec)
        else:
            from caregiver_mj.recording.lerobot.dataset import write_lerobot

            write_lerobot(target, episodes, recipe.about())
    except OSError as error:
        raise StorageError(f"'{target}' cannot be written: {error}; the episodes are kept: --resume") from None


def _known_name(house: str) -> str | None:
    """The name of a house; None of one that was read from a file, for a data set is read on any machine."""
    named = house in house_names() or sets.house(house) is not None
    return house if named else None
