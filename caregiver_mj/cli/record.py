"""`caregiver-mj record`: run episodes and write them, step by step, as a data set for learning."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import functools
import pathlib
import re
from typing import TYPE_CHECKING

from caregiver_mj.caregivers.registry import PLAYERS, find_caregiver
from caregiver_mj.cli import parsing
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.experiments.provenance import origins, source_digest, versions
from caregiver_mj.experiments.run_folder import RunFolder, StorageError
from caregiver_mj.experiments.workers import LocalExecutor, WorkerError
from caregiver_mj.plans import sets
from caregiver_mj.plans.floor_plan import house_names
from caregiver_mj.recording.steps import RANDOM, TARGETS, Store
from caregiver_mj.tasks import TASKS
from caregiver_mj.viz import CAMERAS, progress_bar

if TYPE_CHECKING:
    from caregiver_mj.envs.recipe import Recording
    from caregiver_mj.experiments.spec import EpisodeSpec


FORMATS = ("minari", "lerobot")
_MOST_EPISODES = 1_000_000  # episodes of a data set
_MOST_SECONDS = 3600  # s; longest episode, which has to fit into memory


def add_record(command: argparse.ArgumentParser) -> None:
    """Add the options of `record`."""
    command.set_defaults(run=_run)
    command.description = (
        "Run episodes, and write observations, actions, reward, cost, interventions and camera images of every step as "
        "a Minari or a LeRobot data set. Episode i is that of `evaluate` with the same seed, house, children and "
        "caregiver; with targets only as long as those do not change within a novice timestep."
    )
    command.add_argument("--format", choices=FORMATS, required=True, help="format of the data set")
    command.add_argument("--task", default="supervise", help=f"{', '.join(TASKS)}, or {TARGETS}: interventions only")
    command.add_argument("--world", choices=("house", "grid"), default="house", help="the grid has targets only")
    parsing.add(command, *parsing.WHERE)
    parsing.add(command, "--caregiver", help=f"{RANDOM}, or {parsing.ONE_CAREGIVER}")
    parsing.add(command, "--embodiment", "--seed", *parsing.QUERIES)
    command.add_argument("--episodes", type=int, default=10, metavar="N", help="number of episodes")
    longest = "greatest length of an episode (default: the task's)"
    command.add_argument("--seconds", type=float, metavar="S", help=longest)
    cameras = f"cameras to record: {', '.join(CAMERAS)}"
    command.add_argument("--camera", nargs="+", default=[], metavar="NAME", help=cameras)
    command.add_argument("--size", default="128x96", metavar="WxH", help="size of their images, in pixels")
    parsing.add(command, "--jobs", default=1, help="number of worker processes")
    folder = "folder of the LeRobot data set, or of all Minari data sets"
    command.add_argument("--out", required=True, metavar="DIR", help=folder)
    command.add_argument("--name", help="name of a Minari data set, as GROUP/NAME-v0 (default: from the settings)")
    command.add_argument("--resume", action="store_true", help="continue an interrupted recording")
    parsing.add(command, "--answers", help="run in the house, to record what --caregiver did in it")
    parsing.add(command, "--trust")


def _run(arguments: argparse.Namespace) -> None:
    check_integer("episodes", arguments.episodes, 1, _MOST_EPISODES)
    if arguments.seconds is not None and not 0 < arguments.seconds <= _MOST_SECONDS:
        raise CaregiverError(f"seconds must be a positive number of at most {_MOST_SECONDS}, got {arguments.seconds}")
    if not arguments.out:
        raise CaregiverError("--out must be a folder, got an empty name")
    limit = {} if arguments.seconds is None else {"time_limit": arguments.seconds}
    world = arguments.world if arguments.answers is None else "house"
    spec, answers = parsing.read_episode(arguments, world=world, task_kwargs=limit)
    answers = answers[: arguments.episodes]
    if answers:
        if spec.sight != "all":
            raise CaregiverError(f"--answers must be a run with sight all, got {spec.sight}")
        arguments.episodes = len(answers)
    from caregiver_mj.envs.recipe import Recording  # needs an extra, and imports MuJoCo

    if spec.caregiver != RANDOM and find_caregiver(spec.caregiver, queries=spec.queries) is None:
        raise CaregiverError(f"caregiver must be one that acts, got '{spec.caregiver}'")
    if spec.caregiver in PLAYERS and not answers:
        raise CaregiverError(
            f"caregiver '{spec.caregiver}' requires --answers DIR, a run that `caregiver-mj view` has kept"
        )
    name = arguments.name or _name(spec)
    target = pathlib.Path(arguments.out, name) if arguments.format == "minari" else pathlib.Path(arguments.out)
    unfinished = target.parent / f".{target.name}.episodes"
    spec = dataclasses.replace(spec, queries=parsing.read_queries(arguments, unfinished / "exchanges"))
    recording = Recording(spec, tuple(arguments.camera), parsing.read_size(arguments.size, "--size", "128x96"), answers)
    recording.check()
    check(arguments, recording, name, target)
    robot = spec.embodiment if spec.world == "house" else None
    code = origins([] if spec.caregiver == RANDOM else [spec.caregiver], [spec.family], robot)
    asked = {
        "format": arguments.format,
        "spec": spec.digest(),
        **{key: value for key, value in spec.record().items() if key != "file"},
        "cameras": list(recording.cameras),
        "size": list(recording.size),
        "versions": versions(),
        "source": source_digest(spec.world, ("caregiver_mj.envs.recipe",)),
        **({"code": code} if code else {}),
        **({"answers": arguments.answers} if answers else {}),
    }
    executor = LocalExecutor(arguments.jobs)
    folder = RunFolder(unfinished, asked, resume=arguments.resume)
    store = Store(folder.path)
    store.check_none_beyond(arguments.episodes)
    _collect_all(arguments, recording, store, executor)
    write(arguments, recording, store, name, target)
    store.remove()
    print(target)


def _name(spec: EpisodeSpec) -> str:
    world = "grid-" if spec.world == "grid" else ""
    what = f"{world}{spec.task}-{spec.plan.name}-{spec.caregiver}-{spec.family}"
    return f"caregiver_mj/{re.sub(r'[^-_0-9a-zA-Z]', '_', what)}-v0"


def check(arguments: argparse.Namespace, recording: Recording, name: str, target: pathlib.Path) -> None:
    """Raise CaregiverError, before running anything, if the data set cannot be made or written."""
    try:
        if target.exists():
            raise CaregiverError(f"the data set must be new, got '{target}', which exists")
    except OSError as error:
        raise CaregiverError(f"'{target}' cannot be written: {error.strerror}") from None
    if arguments.format == "minari":
        from caregiver_mj.recording.minari_dataset import check_name

        check_name(name)
    else:
        from caregiver_mj.recording.lerobot_dataset import check_rate

        if arguments.name is not None:
            raise CaregiverError("--name must be left out with --format lerobot, whose name is that of --out")
        if recording.spec.task == TARGETS:
            raise CaregiverError(f"--format must be minari with --task {TARGETS}, whose actions are numbers")
        check_rate(recording.about().rate)
    recording.spaces()  # makes the house and the caregiver


def _collect_all(arguments: argparse.Namespace, recording: Recording, store: Store, executor: LocalExecutor) -> None:
    """Run the missing episodes with a progress bar; an interrupted recording says how to resume it."""
    from caregiver_mj.envs.recipe import collect

    jobs = [i for i in range(arguments.episodes) if i not in store]
    work = functools.partial(collect, recording, store.path)
    found = arguments.episodes - len(jobs)
    try:
        with progress_bar() as bar, contextlib.closing(executor.run(work, jobs)) as running:
            task = bar.add_task("episodes", total=arguments.episodes, completed=found)
            for _ in running:
                found += 1
                bar.advance(task)
    except BaseException as error:
        is_empty = not store.numbers()
        if is_empty:
            store.remove()  # there is nothing to resume
        if not isinstance(error, KeyboardInterrupt | OSError | WorkerError):
            raise
        if is_empty:
            raise StorageError(f"{str(error) or 'interrupted'}; there is no episode yet") from None
        raise parsing.broken_off(error, found, arguments.episodes, store.path, arguments) from None


def write(arguments: argparse.Namespace, recording: Recording, store: Store, name: str, target: pathlib.Path) -> None:
    """Write the data set."""
    episodes = (store.load(i) for i in range(arguments.episodes))
    try:
        if arguments.format == "minari":
            from caregiver_mj.recording.minari_dataset import write_minari

            # Other machines read the data set, so it must not name a local file.
            is_named = arguments.house in house_names() or sets.house(arguments.house) is not None
            spec = recording.env_spec(arguments.house if is_named and not recording.answers else None)
            write_minari(pathlib.Path(arguments.out), name, episodes, recording.about(), recording.spaces(), spec)
        else:
            from caregiver_mj.recording.lerobot_dataset import write_lerobot

            write_lerobot(target, episodes, recording.about())
    except OSError as error:
        raise StorageError(f"'{target}' cannot be written: {error}; the episodes are kept: --resume") from None
