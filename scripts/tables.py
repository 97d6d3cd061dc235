"""Writes what the documentation has from the code: the Python interface, and tables where a page has a place for them.

The place of a table is from `<!-- scripts/tables.py: NAME -->` to `<!-- end -->`; NAME is one of `TABLES`.
"""

from __future__ import annotations

import argparse
import collections
import functools
import inspect
import itertools
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence

import api_pages
import gallery
import gymnasium
import numpy as np

import caregiver_mj
from caregiver_mj.caregivers.target_observation import OBSERVATIONS
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.cli import make_parser
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.record import COLUMNS
from caregiver_mj.robot.embodiment import CommandLayout
from caregiver_mj.robot.embodiments import EMBODIMENTS
from caregiver_mj.tasks import TASKS
from caregiver_mj.tasks.base import OBSERVED

PAGES = sorted((pathlib.Path(__file__).parents[1] / "docs").rglob("*.md"))
_PLACE = re.compile(r"(<!-- scripts/tables\.py: (\w+) -->\n).*?(<!-- end -->)", re.S)
_HOUSE = "paper"
_OTHER = "home-train-4/0"  # has every kind of hazard
_TARGETS = "caregiver_mj/Supervise-Targets-v0"
_OBSERVED_OF_TARGETS = {
    "clock": "elapsed share of the episode",
    "child_position": "row and column of each child's cell, as shares of the house's",
    "child_move": "its last move, north, east, south or west, one-hot; all 0 where it made none",
    "caregiver_position": "row and column of the caregiver's cell, as shares of the house's",
    "hazard_damage": "damage of a collision with each hazard, over the greatest",
    "hazard_nearness_to_child": "1 over the moves until each child would run into each hazard; 0 if it cannot",
    "hazard_nearness_to_caregiver": "1 over one more than the caregiver's moves to its place for each hazard",
    "holding": "the candle in its hand, one-hot",
    "under_way": "the current action, one-hot",
    "action_mask": "which actions do something",
    "map": "the house from above, north up: planes, rows, columns",
    "nodes": "the planes' values in each cell that is not wall, in reading order",
    "node_mask": "which nodes exist",
    "edges": "two nodes each: edge 4 n + a leads from node n by move a, and back",
}


def table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table in Markdown."""
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


@functools.cache
def _environment(name: str, **kwargs: str) -> gymnasium.Env:
    return gymnasium.make(name, **kwargs).unwrapped


def _of_task(task: str) -> gymnasium.Env:
    """Return the Gymnasium environment of a task."""
    return _environment(TASKS[task].id, house=house_for(task))


def house_for(task: str) -> str:
    """Return the house of the tables, or the other one if a task needs a hazard that only that has."""
    needed = TASKS[task].find_kind().needs if task in TASKS else None
    return _HOUSE if needed is None or needed.verb in FloorPlan.load(_HOUSE).hazards.verb else _OTHER


def observation() -> str:
    """Return the observations of the tasks, with shapes in a house, and Gymnasium's bounds there."""
    spaces = {key: box for name in reversed(TASKS) for key, box in _of_task(name).observation_space.items()}
    rows = []
    shown = {key: (name, seen) for name in TASKS for key, seen in TASKS[name].find_kind().observed.items()}
    for key, (name, seen) in sorted(shown.items(), key=lambda one: one[0] not in OBSERVED):
        shape, bounds = "", ""
        if (box := spaces.pop(key, None)) is not None:  # else it is optional
            shape, bounds = box.shape, f"{box.low.min():.4g} to {box.high.max():.4g}"
        of = "" if key in OBSERVED else f" (`{name}` only)"
        rows.append([f"`{key}`", seen.shape, shape, seen.unit, bounds, seen.meaning + of])
    if spaces:
        raise ValueError(f"tasks.base does not say what {', '.join(spaces)} is")
    return table(["key", "shape", f"in `{_HOUSE}`", "unit", "bounds in Gymnasium", "is"], rows)


def action() -> str:
    """Return the components of an action, for each robot."""
    return "\n\n".join(map(_action_of, EMBODIMENTS))


def _action_of(robot: str) -> str:
    env = caregiver_mj.load("supervise", _HOUSE, task_kwargs={"embodiment": robot}, visuals=False)
    spec, layout = env.action_spec(), env.task.embodiment.layout
    rows = []
    for number, name in enumerate(spec.name.split("\t")):
        unit_and_meaning = _value_of(layout, number, name)
        rows.append([number, f"`{name}`", f"{spec.minimum[number]:g}", f"{spec.maximum[number]:g}", *unit_and_meaning])
    head = f"**`{robot}`**, {layout.size} values:"
    return f"{head}\n\n{table(['', 'name', 'least', 'most', 'unit', 'is'], rows)}"


def _value_of(layout: CommandLayout, number: int, name: str) -> tuple[str, str]:
    """Return unit and meaning of a component of an action."""
    if number in range(layout.size)[layout.base]:
        return ("rad/s", "rate of turning") if "yaw" in name else ("m/s", "velocity in the house's axes")
    if number in range(layout.size)[layout.gripper]:
        return "m", "target distance of each finger from the middle"
    return "rad", "target of the joint"


def environments() -> str:
    """A section for each environment: its film, what it asks for, facts and scores."""
    known: dict[str, tuple[set[str], str]] = {}  # observations and action of the sections before, by their titles
    return "\n\n".join(_section(*one, known) for one in gallery.ENTRIES.items())


def _section(name: str, entry: gallery.Entry, known: dict[str, tuple[set[str], str]]) -> str:
    house = house_for(name)
    env, task = _environment(entry.id, house=house, **entry.kwargs), TASKS.get(name)
    kind = task.find_kind() if task else type(env)
    (purpose, *_), units = (inspect.getdoc(kind if task else inspect.getmodule(kind)) or "").splitlines(), {}
    made = ", ".join([f'"{entry.id}"', *(f'{key}="{value}"' for key, value in entry.kwargs.items())])
    makers, ends = [f"gymnasium.make({made})"], f"{EPISODE_TIMESTEPS} actions"
    if task:
        units = {key: f" {seen.unit}".rstrip() for key, seen in kind.observed.items()}
        makers.append(f'caregiver_mj.load("{name}")')
        names, layout = enumerate(env.dm_env.action_spec().name.split("\t")), env.dm_env.task.embodiment.layout
        parts = itertools.groupby(names, lambda one: _value_of(layout, *one)[0])
        action = "; ".join(", ".join(f"`{name}`" for _, name in part) + f" {unit}" for unit, part in parts)
        action = f"{env.action_space.shape}: {action}"
        reward = (inspect.getdoc(kind.get_reward) or "").removeprefix("Return ")
        step, seconds = env.dm_env.control_timestep(), env.dm_env.task.time_limit
        ends = f"{seconds:g} s: {seconds / step:,.0f} actions, each for {step:g} s"
        ends += f" (physics timestep {env.dm_env.physics.timestep():g} s)"
    else:
        hazards = ", ".join(f"{i} {hazard}" for i, hazard in enumerate(env.world.caregiver.plan.hazards, 1))
        action = f"{env.action_space.n} targets, once in a child's move: 0 nothing, {hazards}"
        reward = "minus the damage to the children since the last action."
    if entry.kwargs.get("world") == "grid":
        makers.append(f"gymnasium.make_vec({made}, num_envs=256)")
    title = f"`{name}`" if task else f"Targets in the {entry.kwargs['world']}"
    shown = [f"`{key}` {box.shape}{units.get(key, '')}" for key, box in env.observation_space.items()]
    like = next((other for other, (keys, _) in known.items() if keys <= set(shown)), None)
    seen = [f"as {like}", *(each for each in shown if each not in known[like][0])] if like else shown
    doing = next((f"as {other}" for other, (_, did) in known.items() if did == action), action)
    known[title] = set(shown), action
    facts = [
        ["make", ", ".join(f"`{maker}`" for maker in makers)],
        ["observation", "; ".join(seen)],
        ["action", doing],
        ["reward", reward],
        ["ends", f"truncated after {ends}."],
    ]
    if task and kind.needs:
        facts.append(["needs", f"a {kind.needs.name} in the house"])
    film = f"![The scripted caregiver `{entry.policies[-1]}` at work](../environments/{name}.gif)"
    sentence = purpose.rpartition(": ")[2]
    parts = (f"## {title}", film, sentence[:1].upper() + sentence[1:], table([f"in `{house}`", ""], facts))
    return "\n\n".join([*parts, _scores(name, entry)])


def _scores(name: str, entry: gallery.Entry) -> str:
    """Return the scores of policies in an environment: means, least and greatest; intervals need more episodes."""
    titles = {"return": "return", "cost": "cost", "strikes": "of which strikes"}
    titles |= {"reached": "goal reached"} if entry.policies == gallery.GOAL else {"score": "score"}
    found = [row for row in gallery.read_scores() if row["environment"] == name]
    rows = []
    for policy in entry.policies:
        own = [row for row in found if row["policy"] == policy]
        each = [[float(row[key]) for row in own] for key in titles]
        if own:
            digits = [2 if key == "score" else 0 for key in titles]
            ends = [f" ({min(of):.{n}f} to {max(of):.{n}f})" for of, n in zip(each, digits, strict=True)]
            shown = (f"{np.mean(of):.2f}" + end * (min(of) < max(of)) for of, end in zip(each, ends, strict=True))
            rows.append([f"`{policy}`", len(own), *shown])
    return table(["policy", "episodes", *titles.values()], rows) if rows else "Not scored yet."


def targets() -> str:
    """Return the observations of the environments of targets."""
    spaces = {
        kind: gymnasium.make(_TARGETS, house=_HOUSE, observation=kind).observation_space
        for kind in OBSERVATIONS
        if kind != "flat"
    }
    rows = []
    for key, meaning in _OBSERVED_OF_TARGETS.items():
        kinds = [kind for kind, keys in spaces.items() if key in keys.spaces]
        rows.append([f"`{key}`", spaces[kinds[0]][key].shape, ", ".join(kinds), meaning])
    return table(["key", f"shape in `{_HOUSE}`", "in", "is"], rows)


def columns() -> str:
    """Return the columns of `episodes.parquet`."""
    rows = [(f"`{one.name}`", one.unit, one.meaning + f" ({one.world} only)" * bool(one.world)) for one in COLUMNS]
    return table(["column", "unit", "is"], rows)


def options() -> str:
    """Every option of every command: those that several have once, then each command's own."""
    commands = [*_commands(make_parser())]
    counts = collections.Counter(row for command in commands for row in _rows(command))
    most = {row[0]: row for row, _ in reversed(counts.most_common())}  # of those that two commands explain differently
    shared = [row for row in counts if counts[row] > 1 and most[row[0]] == row]
    titles = ["option", "default", "is"]
    parts = ["## Options that several commands have", table(titles, shared)]
    for command in commands:
        about = (command.description or "").rstrip(".")
        parts += [f"## {command.prog}", f"{about[:1].upper()}{about[1:]}."]
        rows = [*_rows(command)]
        if also := [f"`{row[0].strip('`').split()[0].strip('`,')}`" for row in rows if row in shared]:
            parts.append(f"Also {', '.join(also)}.")
        if own := [row for row in rows if row not in shared]:
            parts.append(table(titles, own))
    return "\n\n".join(parts)


def _commands(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield the parsers of all commands, in order."""
    below = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    if not below:
        yield parser
    for one in below:
        for command in one.choices.values():
            yield from _commands(command)


def _rows(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str, str]]:
    """The options of a command, with their defaults and what they are."""
    for one in parser._actions:
        if not isinstance(one, argparse._HelpAction):
            said = " ".join(filter(None, ["`, `".join(one.option_strings), _value(one)]))
            yield f"`{said}`", _default(one), one.help or ""


def _value(one: argparse.Action) -> str:
    """Return the placeholder of an option's value, or of an argument."""
    if one.nargs == 0:
        return ""
    return (one.metavar or "|".join(map(str, one.choices or [one.dest.upper()]))) + (" ..." if one.nargs else "")


def _default(one: argparse.Action) -> str:
    if one.required:
        return "must be given"
    if one.default is None or one.default is False:
        return ""
    values = one.default if isinstance(one.default, list | tuple) else [one.default]
    return " ".join(f"`{value:.3g}`" if isinstance(value, float) else f"`{value}`" for value in values)


TABLES: dict[str, Callable[[], str]] = {
    made.__name__: made for made in (observation, action, environments, targets, columns, options)
}


def filled(text: str) -> str:
    """Return a page with current tables."""
    return _PLACE.sub(lambda place: f"{place[1]}\n{TABLES[place[2]]()}\n\n{place[3]}", text)


def main() -> None:
    """Write them all."""
    api_pages.main()
    for page in PAGES:
        text = page.read_text("utf-8")
        if (made := filled(text)) != text:
            page.write_text(made, "utf-8")
            print(page)


if __name__ == "__main__":
    main()
