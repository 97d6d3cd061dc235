"""`caregiver-mj evaluate` and `paper`: run caregivers with children, and print tables."""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import pathlib
import shlex
import tempfile
from typing import Any

from caregiver_mj.caregivers.registry import RULE, check_acts_alone
from caregiver_mj.caregivers.server import SCHEMES
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.cli import parsing
from caregiver_mj.cli.runs import output, print_rows, print_summary
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import evaluation
from caregiver_mj.experiments.run_folder import RunFolder, StorageError
from caregiver_mj.experiments.settings import EPSILONS, Settings
from caregiver_mj.experiments.spec import BARE_TABLES, WORLDS
from caregiver_mj.experiments.workers import Executor, WorkerError
from caregiver_mj.outside import plain
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import progress_bar

_PAPER_TABLES = {  # by column: title, digits, legend
    "damage_normalised": (
        "Table I: damage",
        3,
        "damage of an episode over the greatest of any, which grows with the number of episodes: compare the share "
        "left, the mean with the caregiver over that without",
    ),
    "timesteps_to_threshold": (
        "Table II: timesteps",
        1,
        f"timesteps until damage is above {DAMAGE_THRESHOLD:g}, at most {EPISODE_TIMESTEPS}",
    ),
}
_PAPER_LEGEND = "epsilon: share of random moves; deviation: here less paper; the paper's are means of 20 episodes"


def add_evaluate(command: argparse.ArgumentParser) -> None:
    """Add the options of `evaluate`."""
    command.set_defaults(run=_run)
    command.description = (
        "Run every caregiver with every child group in every house. Episode i has the same children under all "
        "caregivers."
    )
    command.add_argument(
        "--world", choices=WORLDS, default="house", help="the physical house, or the grid of the paper"
    )
    parsing.add(command.add_mutually_exclusive_group(), "--house", "--houses")
    parsing.add(command, "--damage")
    who, default = f"{BARE_TABLES}, {parsing.caregivers()}", ["none", parsing.CAREGIVER]
    parsing.add(command, "--caregiver", nargs="+", default=default, help=who)
    text = "share of random moves, one value or more; a list such as 1,.25 is for children in the same house"
    parsing.add(command, "--epsilon", nargs="+", default=EPSILONS, help=text)
    parsing.add(command, *parsing.CHILDREN_OPTIONS, "--embodiment", "--sight", *parsing.QUERIES)
    text = "number of episodes for each caregiver and epsilon"
    command.add_argument("--episodes", type=int, default=20, metavar="N", help=text)
    parsing.add(command, "--seed", *parsing.WORKERS)
    command.add_argument("--out", metavar="DIR", help="folder for the episodes and the table")
    command.add_argument("--resume", action="store_true", help="continue the run in DIR")
    parsing.add(command, "--json")


def _run(arguments: argparse.Namespace) -> None:
    with contextlib.ExitStack() as within:
        folder_of_run = arguments.out or within.enter_context(tempfile.TemporaryDirectory())
        settings = _settings(arguments, pathlib.Path(folder_of_run, "exchanges"))
        if settings.world == "house" and set(settings.caregivers) - {"none", BARE_TABLES}:
            for plan in settings.plans:
                parsing.warn_of_no_room(plan)
        executor = within.enter_context(parsing.make_executor(arguments))  # after all other checks
        executor.check(settings.code)
        folder = None
        if arguments.out is not None:
            folder = RunFolder(arguments.out, settings.record(), resume=arguments.resume)
        result = evaluate_visibly(settings, folder, executor, arguments)
        print_summary(result.summary, arguments.json)
        if any(name.startswith(SCHEMES) for name in settings.caregivers):
            from caregiver_mj.caregivers.remote import tally

            output(arguments.json).print(plain(tally(settings.queries.folder)))


def _settings(arguments: argparse.Namespace, exchanges: pathlib.Path) -> Settings:
    """Return the settings, checked before anything is written; `exchanges` is the folder of remote queries."""
    if arguments.houses is None:
        plans: tuple[FloorPlan, ...] = (FloorPlan.load(arguments.house, damage=arguments.damage),)
    else:
        plans = houses_named(arguments.houses, arguments.damage)
    file = "" if arguments.houses or arguments.house == plans[0].name else arguments.house
    settings = Settings(
        plans=plans,
        file=file,
        houses=shlex.join(arguments.houses or ()),
        world=arguments.world,
        caregivers=tuple(dict.fromkeys(arguments.caregiver)),
        families=tuple(dict.fromkeys(parsing.read_family(str(epsilon), arguments) for epsilon in arguments.epsilon)),
        episodes=arguments.episodes,
        seed=arguments.seed,
        embodiment=arguments.embodiment,
        sight=arguments.sight,
        child_speed=arguments.child_speed,
        queries=parsing.read_queries(arguments, exchanges),
    )
    settings.check()
    if arguments.resume and arguments.out is None:
        raise CaregiverError("--resume requires --out DIR, the folder of the run")
    for name in () if arguments.resume else settings.caregivers:  # a run with a human player may be resumed
        check_acts_alone(name)
    evaluation.try_all(settings)
    return settings


def evaluate_visibly(
    settings: Settings, folder: RunFolder | None, executor: Executor, arguments: argparse.Namespace
) -> evaluation.Evaluation:
    """Run an evaluation with a progress bar on standard error; an interrupted run says how to resume it."""
    total = len(settings.plans) * len(settings.caregivers) * len(settings.families) * settings.episodes
    bar = progress_bar()
    task = bar.add_task("episodes", total=total)
    try:
        with bar:
            progress = functools.partial(bar.advance, task)
            return evaluation.evaluate(settings, folder, executor=executor, progress=progress)
    except (KeyboardInterrupt, StorageError, WorkerError) as error:
        if folder is None:
            raise
        raise parsing.broken_off(error, round(bar.tasks[task].completed), total, folder.path, arguments) from None


# -- The paper's Tables I and II -----------------------------------------------------------------------


def add_paper(command: argparse.ArgumentParser) -> None:
    """Add the options of `paper`."""
    command.set_defaults(run=_run_paper, resume=False)
    command.description = (
        "Run the paper's experiment in the grid of house `paper`, and print its Tables I and II beside the paper's own "
        "numbers, with 95 % intervals and deviations."
    )
    command.add_argument("--episodes", type=int, default=1000, metavar="N", help="number of episodes for each epsilon")
    parsing.add(command, "--seed", *parsing.WORKERS)
    parsing.add(command, "--json", help="print the tables as JSON only")


def _run_paper(arguments: argparse.Namespace) -> None:
    plans, caregivers = (FloorPlan.load("paper"),), ("none", RULE[0])
    settings = Settings(plans, "grid", caregivers, episodes=arguments.episodes, seed=arguments.seed)
    settings.check()
    with parsing.make_executor(arguments) as executor:
        executor.check(settings.code)
        result = evaluate_visibly(settings, None, executor, arguments)

    from caregiver_mj.viz.report import causes  # takes seconds to import
    from caregiver_mj.viz.report.run import Run

    run = Run(pathlib.Path(), settings.record(), settings, result.episodes, result.maps, result.summary, RULE[0])
    tables = run.deviations()
    console = output(arguments.json)
    for column, (title, digits, legend) in _PAPER_TABLES.items():
        title = f"{title} ({settings.episodes} episodes each, seed {settings.seed})"
        rows = [_paper_cells(row, digits) for row in tables[column]]
        print_rows(console, title, f"{legend}; {_PAPER_LEGEND}", rows, sections=True)
    console.print()
    for cause in causes():
        console.print(cause, markup=False, highlight=False)
    if arguments.json:
        print(json.dumps(tables, indent=1, allow_nan=False))


def _paper_cells(row: dict[str, Any], digits: int) -> dict[str, str]:
    def number(value: float | None, unbounded: str = "", sign: str = "-") -> str:
        return unbounded if value is None else f"{value:{sign}.{digits}f}"

    return {
        "epsilon": row["epsilon"],
        "quantity": row["quantity"],
        "here": number(row["here"]),
        "95 % interval": f"{number(row['low'], '-inf')} to {number(row['high'], 'inf')}",
        "paper": number(row["paper"]),
        "deviation": number(row["deviation"], sign="+"),
    }
