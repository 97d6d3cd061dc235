"""`caregiver-mj list`: available names with a line on each; `completion`: a script for a shell to complete them."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from caregiver_mj.caregivers.registry import CAREGIVERS, DRIVER, PERSON, POLICIES
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.cli.house import describe
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.plans.rooms import SHAPES
from caregiver_mj.plans.sets import DRAWN, FIRST_SEEDS, SETS
from caregiver_mj.recording.steps import RANDOM, TARGETS
from caregiver_mj.registry import Registry, summary
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS
from caregiver_mj.viz import AUTO, CAMERAS

_OTHERS = {  # names that options accept for a caregiver
    "attentive:SHARE": "The rule, acting only while it looks: a share of the time, such as .4.",
    "attentive:SHARE:NAME": "Another caregiver that acts only while it looks.",
    "none": "Nobody: the robot is not there.",
    BARE_TABLES: "Nobody, in a house whose only hazards are bare tables. In `evaluate` only.",
    PERSON: "You, by keys that say what to protect from. In `view` only.",
    DRIVER: "You, by keys that drive the base. In `view` only.",
}


_GENERATED = {
    "house-SEED": "A generated house, such as house-17: rooms, doorways, furniture and stairs.",
    "home-SEED": "A generated house with gates, mugs and batteries, too.",
    **{f"{shape}-SEED": about for shape, about in SHAPES.items()},
}
_LISTS: dict[str, Callable[[], dict[str, str]]] = {
    "caregivers": lambda: _registered(POLICIES) | _registered(CAREGIVERS) | _OTHERS,
    "children": lambda: _registered(CHILDREN),
    "houses": lambda: {name: describe(FloorPlan.load(name)) for name in house_names()} | _GENERATED,
    "robots": lambda: _registered(EMBODIMENTS),
    "tasks": lambda: {name: summary(task.find_kind()) for name, task in TASKS.items()},
    "sets": lambda: SETS,
}


def _registered(registry: Registry[Any]) -> dict[str, str]:
    """Return a summary of each entry of a registry, or why it cannot be loaded."""
    found = {}
    for name in registry:
        try:
            found[name] = registry.describe(name)
        except CaregiverError as error:
            found[name] = str(error)
    return found


def add_list(command: argparse.ArgumentParser) -> None:
    """Add the options of `list`."""
    command.set_defaults(run=_list)
    command.description = "Print the names that other commands take, with a line on each, including other packages'."
    command.add_argument("what", choices=[*_LISTS], help="kind of names")
    command.add_argument("--json", action="store_true", help="print an object from name to line")


def _list(arguments: argparse.Namespace) -> None:
    found = dict(sorted(_LISTS[arguments.what]().items()))
    if arguments.json:
        print(json.dumps(found, indent=1, ensure_ascii=False))
        return
    width = max(map(len, found))
    for name, line in found.items():
        print(f"{name:{width}}  {' '.join(line.split())}")


# -- Completion ----------------------------------------------------------------------------------------

SHELLS = ("bash", "zsh")
_FILES = ("answers", "first", "folders", "out", "second", "still", "video")  # arguments that name files or folders

# Completion of houses: names and files.
_HOUSE = "_caregiver_mj_houses"
_HOUSE_FUNCTIONS = {
    "bash": _HOUSE + """() {{ compgen -W "{names}" -- "$1"; compgen -f -- "$1"; }}""",
    "zsh": _HOUSE + """() {{ _alternative 'houses:house:({names})' 'files:file:_files' }}""",
}


def add_completion(command: argparse.ArgumentParser) -> None:
    """Add the options of `completion`."""
    command.set_defaults(run=lambda arguments: print(script(arguments.shell)))
    command.description = (
        "Print a completion script for the shell, with the present names of caregivers, children and houses, including "
        "those of other packages."
    )
    command.add_argument("shell", choices=SHELLS, help="for which shell")


def script(shell: str) -> str:
    """Return the completion script of a shell, one of `SHELLS`."""
    import shtab

    from caregiver_mj.cli import make_parser

    parser = make_parser()  # to which choices are added, so that it can parse no more
    names = [*house_names(), *(f"{shape}-17" for shape in SHAPES)]
    caregivers = list(dict.fromkeys([*CAREGIVERS, *POLICIES]))
    words: dict[str, Iterable[str]] = {
        "camera": CAMERAS,
        "caregiver": caregivers,
        "child": CHILDREN,
        "embodiment": EMBODIMENTS,
        "robot": EMBODIMENTS,
        "houses": [*(f"{name}-100" for name in FIRST_SEEDS), f"drawn-{len(DRAWN)}", *names],
        "task": TASKS,
        # Exceptions for single commands.
        "evaluate caregiver": [BARE_TABLES, *caregivers],
        "compare caregiver": [BARE_TABLES, *caregivers],
        "render camera": [AUTO, *CAMERAS],
        "record caregiver": [RANDOM, *(name for name in caregivers if name != "none")],
        "record task": [*TASKS, TARGETS],
    }
    functions = {name: function.format(names=" ".join(names)) for name, function in _HOUSE_FUNCTIONS.items()}
    for command, action in _actions(parser):
        offered = words.get(f"{command} {action.dest}") or words.get(action.dest)
        if offered and not action.choices:
            action.choices = list(offered)
        elif action.dest in _FILES:
            action.complete = shtab.FILE  # type: ignore[attr-defined]  # read by shtab
        elif action.dest == "house":
            action.complete = dict.fromkeys(SHELLS, _HOUSE) | {"preamble": functions}  # type: ignore[attr-defined]
    return shtab.complete(parser, shell)


def _actions(parser: argparse.ArgumentParser, command: str = "") -> Iterator[tuple[str, argparse.Action]]:
    """Yield the arguments of a command and of its subcommands, each with the name of its command."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                yield from _actions(inner, name)
        else:
            yield command, action
