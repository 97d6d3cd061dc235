"""Writes the tables of the documentation that are made of the code, each where a page has a place for it.

A place is from `<!-- scripts/tables.py: NAME -->` to `<!-- end -->`; NAME is one of `TABLES`.
"""

from __future__ import annotations

import argparse
import functools
import inspect
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence

import gymnasium

import caregiver_mj
from caregiver_mj.caregivers.target_observation import OBSERVATIONS
from caregiver_mj.cli import make_parser
from caregiver_mj.envs.spaces import OBSERVED_OF_TARGETS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording import record
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS
from caregiver_mj.tasks.base import OBSERVED

PAGES = sorted((pathlib.Path(__file__).parents[1] / "docs").rglob("*.md"))
_PLACE = re.compile(r"(<!-- scripts/tables\.py: (\w+) -->\n).*?(<!-- end -->)", re.S)
_HOUSE, _FULL = "paper", "home"  # a house for nearly all; one that has gates and small things, too
_TARGETS = "caregiver_mj/Supervise-Targets-v0"


def table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


@functools.cache
def _environment(name: str) -> gymnasium.Env:
    task = TASKS.get(gymnasium.spec(name).kwargs.get("task"))
    needs = task.find_kind().needs if task else None
    house = _FULL if needs and needs not in FloorPlan.load(_HOUSE).hazards.kinds else _HOUSE
    return gymnasium.make(name, house=house).unwrapped


def _of_task(task: str) -> gymnasium.Env:
    """The environment of a task, which has that of dm_control within."""
    return _environment(TASKS[task].id)


def tasks() -> str:
    """The tasks of the package, in their own words."""
    rows = []
    for name, task in TASKS.items():
        kind = task.find_kind()
        env = _of_task(name).dm_env
        goal = (inspect.getdoc(inspect.getmodule(kind)) or "").splitlines()[0].partition(": ")[2]
        times = (env.task.time_limit, env.control_timestep(), env.physics.timestep())
        reward = (inspect.getdoc(kind.get_reward) or "").removeprefix("Return ")
        rows.append([f"`{name}`", goal, reward, *map("{:g}".format, times), kind.needs or ""])
    lengths = ("episode, s", "control timestep, s", "physics timestep, s")
    return table(["task", "goal", "reward, at every control timestep", *lengths, "needs in the house"], rows)


def observation() -> str:
    """What the tasks show, with the shapes that it has in a house, and the bounds that Gymnasium's have there."""
    spaces = {key: box for name in reversed(TASKS) for key, box in _of_task(name).observation_space.items()}
    rows = []
    shown = {key: (name, seen) for name in TASKS for key, seen in TASKS[name].find_kind().observed.items()}
    for key, (name, seen) in sorted(shown.items(), key=lambda one: one[0] not in OBSERVED):
        shape, bounds = "", ""
        if (box := spaces.pop(key, None)) is not None:  # else it is only there if it is asked for
            shape, bounds = box.shape, f"{box.low.min():.4g} to {box.high.max():.4g}"
        of = "" if key in OBSERVED else f" (`{name}` only)"
        rows.append([f"`{key}`", seen.shape, shape, seen.unit, bounds, seen.meaning + of])
    if spaces:
        raise ValueError(f"tasks.base does not say what {', '.join(spaces)} is")
    return table(["key", "shape", f"in `{_HOUSE}`", "unit", "within, in Gymnasium", "is"], rows)


def action() -> str:
    """What an action is made of, robot by robot."""
    return "\n\n".join(map(_action_of, EMBODIMENTS))


def _action_of(robot: str) -> str:
    env = caregiver_mj.load("supervise", _HOUSE, task_kwargs={"embodiment": robot}, visuals=False)
    spec, layout = env.action_spec(), env.task.embodiment.layout
    rows = []
    for number, name in enumerate(spec.name.split("\t")):
        unit, meaning = "rad", "where the joint shall go"
        if number in range(layout.size)[layout.base]:
            unit, meaning = ("rad/s", "rate of turning") if "yaw" in name else ("m/s", "velocity in the house's axes")
        elif number in range(layout.size)[layout.gripper]:
            unit, meaning = "m", "how far each finger shall stand off the middle"
        rows.append([number, f"`{name}`", f"{spec.minimum[number]:g}", f"{spec.maximum[number]:g}", unit, meaning])
    head = f"**`{robot}`**, {layout.size} values:"
    return f"{head}\n\n{table(['', 'name', 'least', 'most', 'unit', 'is'], rows)}"


def environments() -> str:
    """The Gymnasium environments, as they are registered."""
    rows = []
    for name, spec in gymnasium.registry.items():
        if spec.namespace == caregiver_mj.__name__:
            env = _environment(name)
            discrete = isinstance(env.action_space, gymnasium.spaces.Discrete)
            actions = f"{env.action_space.n} targets" if discrete else f"{env.action_space.shape[0]} values"
            vector = f"`{spec.vector_entry_point.rpartition(':')[2]}`" if spec.vector_entry_point else ""
            keys = ", ".join(f"`{key}`" for key in env.observation_space)
            rows.append([f"`{name}`", actions, keys, vector])
    return table(["environment", f"an action in `{_HOUSE}`", "observation", "vector of its own"], rows)


def targets() -> str:
    """What the environments of targets show."""
    spaces = {
        kind: gymnasium.make(_TARGETS, house=_HOUSE, observation=kind).observation_space
        for kind in OBSERVATIONS
        if kind != "flat"  # which is the numbers
    }
    rows = []
    for key, meaning in OBSERVED_OF_TARGETS.items():
        kinds = [kind for kind, keys in spaces.items() if key in keys.spaces]
        rows.append([f"`{key}`", spaces[kinds[0]][key].shape, ", ".join(kinds), meaning])
    return table(["key", f"shape in `{_HOUSE}`", "in", "is"], rows)


def columns() -> str:
    """The columns of `episodes.parquet`."""
    return record.markdown()


def options() -> str:
    """Every option of every command."""
    return "\n\n".join(map(_options_of, _commands(make_parser())))


def _commands(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """The parsers of the commands that can be given, in their order."""
    below = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    if not below:
        yield parser
    for one in below:
        for command in one.choices.values():
            yield from _commands(command)


def _options_of(parser: argparse.ArgumentParser) -> str:
    rows = []
    for one in parser._actions:
        if not isinstance(one, argparse._HelpAction):
            said = " ".join(filter(None, ["`, `".join(one.option_strings), _value(one)]))
            rows.append([f"`{said}`", _default(one), one.help or ""])
    return f"## {parser.prog}\n\n{parser.description}\n\n{table(['option', 'default', 'is'], rows)}"


def _value(one: argparse.Action) -> str:
    """What follows an option, or stands for an argument."""
    if one.nargs == 0:
        return ""
    return (one.metavar or "|".join(map(str, one.choices or [one.dest.upper()]))) + (" ..." if one.nargs else "")


def _default(one: argparse.Action) -> str:
    if one.required:
        return "must be given"
    if one.default is None or one.default is False:
        return ""
    values = one.default if isinstance(one.default, list | tuple) else [one.default]
    return " ".join(f"`{value}`" for value in values)


TABLES: dict[str, Callable[[], str]] = {
    made.__name__: made for made in (tasks, observation, action, environments, targets, columns, options)
}


def filled(text: str) -> str:
    """A page with its tables as they are now."""
    return _PLACE.sub(lambda place: f"{place[1]}\n{TABLES[place[2]]()}\n\n{place[3]}", text)


def main() -> None:
    """Write them all."""
    for page in PAGES:
        text = page.read_text("utf-8")
        if (made := filled(text)) != text:
            page.write_text(made, "utf-8")
            print(page)


if __name__ == "__main__":
    main()
