"""`caregiver-mj render`: films an episode in the physical house."""

from __future__ import annotations

import argparse
import math

from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.cli.parsing import (
    HelpFormatter,
    add_children,
    add_embodiment,
    add_house,
    add_seed,
    caregivers,
    read_family,
    read_house,
)
from caregiver_mj.errors import CaregiverError
from caregiver_mj.viz import OVERLAYS


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    command = commands.add_parser(
        "render",
        help="film an episode in the physical house",
        description="Film an episode of the run that `evaluate` does with the same seed, children and caregiver.",
        formatter_class=HelpFormatter,
    )
    command.add_argument("--task", default="supervise", help="name of the task")
    add_house(command)
    command.add_argument(
        "--epsilon",
        default="0.5",
        metavar="E[,E...]",
        help="share of random moves; of several children one each, such as 1,.25",
    )
    add_children(command)
    command.add_argument("--caregiver", default="expected-danger", metavar="NAME", help=caregivers())
    add_embodiment(command)
    add_seed(command, "seed of the run that the episode belongs to")
    command.add_argument("--episode", type=int, default=0, metavar="N", help="number of the episode in that run")
    command.add_argument("--seconds", type=float, default=30.0, help="length of the film at most")
    command.add_argument(
        "--overlay",
        choices=OVERLAYS,
        help="drawn on the floor: where the caregiver predicts the child soon, and what may hurt it",
    )
    command.add_argument("--out", required=True, metavar="FILE.mp4", help="film to write")
    command.add_argument("--still", metavar="FILE.png", help="picture to write of a telling moment")
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    plan, family = read_house(arguments), read_family(arguments.epsilon, arguments)
    find_caregiver(arguments.caregiver)
    if arguments.seed < 0 or arguments.episode < 0:
        raise CaregiverError(f"seed and episode must be at least 0, got {arguments.seed} and {arguments.episode}")
    if not (arguments.seconds > 0 and math.isfinite(arguments.seconds)):
        raise CaregiverError(f"seconds must be a positive number, got {arguments.seconds}")

    from caregiver_mj.viz import film  # here, for it takes seconds to import

    film.render_episode(
        arguments.out,
        task=arguments.task,
        house=plan,
        epsilon=family,
        seed=arguments.seed,
        episode=arguments.episode,
        seconds=arguments.seconds,
        caregiver=arguments.caregiver,
        embodiment=arguments.embodiment,
        overlay=arguments.overlay,
        still=arguments.still,
    )
    print(arguments.out)
