"""`caregiver-mj paper`: the paper's Tables I and II beside ours."""

from __future__ import annotations

import argparse
import json
import pathlib
from typing import Any

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.cli import parsing
from caregiver_mj.cli.evaluate import evaluate_visibly
from caregiver_mj.cli.runs import output, print_rows
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.record import DAMAGE_THRESHOLD

_TABLES = {  # by column: title, digits, legend
    "damage_normalised": (
        "Table I: damage",
        3,
        "damage of an episode over the greatest of any, which is the greater, the more episodes there are: compare "
        "what is left, the mean with the caregiver over that without",
    ),
    "timesteps_to_threshold": (
        "Table II: timesteps",
        1,
        f"timesteps until damage is above {DAMAGE_THRESHOLD:g}, at most {EPISODE_TIMESTEPS}",
    ),
}
_COMMON = "epsilon: share of random moves; deviation: here less paper; the paper's are means of 20 episodes"


def add_paper(command: argparse.ArgumentParser) -> None:
    """Add the options of `paper`."""
    command.set_defaults(run=_run, resume=False)
    command.description = (
        "Run the paper's experiment in the grid of house `paper`, and print its Tables I and II beside the paper's own "
        "numbers, with 95 % intervals, deviations and their known causes."
    )
    command.add_argument("--episodes", type=int, default=1000, metavar="N", help="number of episodes for each cell")
    parsing.add_seed(command)
    parsing.add_executor(command)
    command.add_argument("--json", action="store_true", help="print the tables as JSON only")


def _run(arguments: argparse.Namespace) -> None:
    settings = Settings(
        plans=(FloorPlan.load("paper"),),
        world="grid",
        caregivers=("none", RULE[0]),
        episodes=arguments.episodes,
        seed=arguments.seed,
    )
    settings.check()
    with parsing.make_executor(arguments) as executor:
        executor.check(settings.code)
        result = evaluate_visibly(settings, None, executor, arguments)

    from caregiver_mj.viz.report import Run, published  # takes seconds to import
    from caregiver_mj.viz.report.page import causes

    run = Run(pathlib.Path(), settings.record(), settings, result.episodes, result.maps, result.summary)
    tables = published.deviations(run)
    console = output(arguments.json)
    for column, (title, digits, legend) in _TABLES.items():
        rows = [_cells(row, digits) for row in tables[column]]
        print_rows(
            console,
            f"{title} ({settings.episodes} episodes each, seed {settings.seed})",
            f"{legend}; {_COMMON}",
            rows,
            sections=True,
        )
    console.print()
    for cause in causes():
        console.print(cause, markup=False, highlight=False)
    if arguments.json:
        print(json.dumps(tables, indent=1, allow_nan=False))


def _cells(row: dict[str, Any], digits: int) -> dict[str, str]:
    def number(value: float | None, unbounded: str = "", sign: str = "-") -> str:
        return unbounded if value is None else f"{value:{sign}.{digits}f}"

    interval = f"{number(row['low'], '-inf')} to {number(row['high'], 'inf')}"
    return {
        "epsilon": row["epsilon"],
        "quantity": row["quantity"],
        "here": number(row["here"]),
        "95 % interval": interval,
        "paper": number(row["paper"]),
        "deviation": number(row["deviation"], sign="+"),
    }
