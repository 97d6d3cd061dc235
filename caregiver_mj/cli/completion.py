"""`caregiver-mj completion`: a script with which a shell completes the command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

from caregiver_mj.caregivers.registry import CAREGIVERS, POLICIES
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.plans.floor_plan import house_names
from caregiver_mj.plans.rooms import SHAPES
from caregiver_mj.plans.sets import DRAWN, FIRST_SEEDS
from caregiver_mj.recording.steps import RANDOM, TARGETS
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS
from caregiver_mj.viz import AUTO, CAMERAS

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
    command.set_defaults(run=_run)
    command.description = (
        "Print a completion script for the shell, with the present names of caregivers, children and houses, including "
        "those of other packages."
    )
    command.add_argument("shell", choices=SHELLS, help="for which shell")


def _run(arguments: argparse.Namespace) -> None:
    from caregiver_mj.cli import make_parser

    print(script(make_parser(), arguments.shell))


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the completion script of a shell, one of `SHELLS`.

    This adds choices to the parser, which cannot parse afterwards.
    """
    import shtab

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
