"""`caregiver-mj list`: available names with a one-line summary each."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from typing import Any

from caregiver_mj.caregivers.registry import CAREGIVERS, DRIVER, PERSON, POLICIES
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.cli.house import describe
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.plans.rooms import SHAPES
from caregiver_mj.plans.sets import SETS
from caregiver_mj.registry import Registry, summary
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS

_NO_CAREGIVERS = {  # other names that options accept for a caregiver
    "none": "Nobody: the robot is not there.",
    BARE_TABLES: "Nobody, in a house whose only hazards are bare tables. In `evaluate` only.",
    PERSON: "You, by keys that say what to protect from. In `view` only.",
    DRIVER: "You, by keys that drive the base. In `view` only.",
}


def _registered(registry: Registry[Any]) -> dict[str, str]:
    """Return a summary of each entry of a registry, or why it cannot be loaded."""

    def described(name: str) -> str:
        try:
            return registry.describe(name)
        except CaregiverError as error:
            return str(error)

    return {name: described(name) for name in registry}


def _caregivers() -> dict[str, str]:
    return _registered(POLICIES) | _registered(CAREGIVERS) | _NO_CAREGIVERS


def _houses() -> dict[str, str]:
    generated = {
        "house-SEED": "A generated house, such as house-17: rooms, doorways, furniture and stairs.",
        "home-SEED": "A generated house with gates, mugs and batteries, too.",
        **{f"{shape}-SEED": about for shape, about in SHAPES.items()},
    }
    return {name: describe(FloorPlan.load(name)) for name in house_names()} | generated


def _tasks() -> dict[str, str]:
    return {name: summary(task.find_kind()) for name, task in TASKS.items()}


_LISTS: dict[str, Callable[[], dict[str, str]]] = {
    "caregivers": _caregivers,
    "children": lambda: _registered(CHILDREN),
    "houses": _houses,
    "robots": lambda: _registered(EMBODIMENTS),
    "tasks": _tasks,
    "sets": lambda: SETS,
}


def add_list(command: argparse.ArgumentParser) -> None:
    """Add the options of `list`."""
    command.set_defaults(run=_run)
    command.description = "Print the names that other commands take, with a line on each, including other packages'."
    command.add_argument("what", choices=[*_LISTS], help="kind of names")
    command.add_argument("--json", action="store_true", help="print an object from name to line")


def _run(arguments: argparse.Namespace) -> None:
    found = dict(sorted(_LISTS[arguments.what]().items()))
    if arguments.json:
        print(json.dumps(found, indent=1, ensure_ascii=False))
        return
    width = max(map(len, found))
    for name, line in found.items():
        print(f"{name:{width}}  {' '.join(line.split())}")
