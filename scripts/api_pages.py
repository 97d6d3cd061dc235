"""Writes the pages of the Python interface, docs/api, from the package: signatures, first paragraphs, parameters.

They are plain Markdown, to be read on a source host and on the site alike. `scripts/tables.py` calls this.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import importlib
import inspect
import pathlib
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any, ForwardRef

import caregiver_mj

FOLDER = pathlib.Path(__file__).parents[1] / "docs" / "api"
FRONT = ("load", "CaregiverPolicy", "FloorPlan", "house_names", "CaregiverError")
# Pages by the names of their files: title, and modules below `caregiver_mj`.
ROOMS = {
    "danger": ("Safety and danger", "danger.safety danger.chain danger.belief danger.tracker"),
    "caregivers": (
        "Caregivers",
        "caregivers.caregiver caregivers.percept caregivers.registry caregivers.paper caregivers.foresight.foresight",
    ),
    "children": ("Children", "children.behaviour children.child_group children.random_stream"),
    "interventions": ("Interventions", "interventions.verb grid.verbs policy.routines"),
    "plans": ("Floor plans", "plans.floor_plan plans.hazards plans.cell_graph plans.generator plans.sets"),
    "worlds": ("The two worlds", "grid.world tasks.base recording.ledger recording.record"),
    "envs": ("Gymnasium", "envs.house envs.targets envs.target_grid envs.houses_vector"),
    "robot": ("The robot", "robot.embodiment robot.embodiments robot.limits robot.skills.skill robot.status"),
    "experiments": (
        "Experiments",
        "experiments.spec experiments.settings experiments.runner experiments.evaluation experiments.finished "
        "experiments.intervals experiments.statistics",
    ),
}
_MOST = 20  # parameters that a signature shows
_SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Yields|Example|Examples|Note):\n", re.M)
_FIELD = re.compile(r"((?:^    #.*\n)*)^    (\w+): [^#\n]+?(?:  #: (.*))?$", re.M)
_ENTRY = re.compile(r"^    (\*{0,2}\w+)(?: \([^)]*\))?: (.*(?:\n {5,}.*)*)", re.M)


def pages() -> dict[str, str]:
    """The text of every page, by the name of its file."""
    return {"index.md": _index(), **{f"{name}.md": _page(*room) for name, room in ROOMS.items()}}


def _index() -> str:
    rows = (
        f"| [{title}]({name}.md) | {', '.join(f'`{module}`' for module in modules.split())} |"
        for name, (title, modules) in ROOMS.items()
    )
    toctree = "\n".join(("```{toctree}", ":hidden:", "", *ROOMS, "```"))
    parts = [
        "# Python",
        "Rely on what is named here; `scripts/tables.py` writes these pages from the docstrings.",
        "| page | modules of `caregiver_mj` |\n|---|---|\n" + "\n".join(rows),
        "## caregiver_mj",
        "`ALL_TASKS`: names of the tasks, as `load` takes them.",
        *(part for name in FRONT for part in _object(name, getattr(caregiver_mj, name))),
        toctree,
    ]
    return "\n\n".join(parts) + "\n"


def _page(title: str, modules: str) -> str:
    parts = [f"# {title}"]
    for name in modules.split():
        module = importlib.import_module(f"caregiver_mj.{name}")
        parts += [f"## {module.__name__}", inspect.getdoc(module) or ""]
        for found, one in _public(module):
            parts += _object(found, one)
    return "\n\n".join(filter(None, parts)) + "\n"


def _public(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Classes and functions that a module defines, in its order."""
    for name, one in vars(module).items():
        own = inspect.isclass(one) or inspect.isfunction(inspect.unwrap(one) if callable(one) else one)
        if own and not name.startswith("_") and one.__module__ == module.__name__:
            yield name, one


def _object(name: str, one: Any) -> Iterator[str]:
    yield f"### {name}"
    yield f"`{_signature(name, one)}`"
    yield _summary(one)
    if entries := _entries(one):
        yield entries
    if inspect.isclass(one):
        yield "\n".join(_members(one))


def _members(kind: type) -> Iterator[str]:
    """A line for each public method and property of a class's own that has a docstring of its own."""
    for name, one in vars(kind).items():
        function = one.__func__ if isinstance(one, classmethod | staticmethod) else one
        if name.startswith("_") or not function.__doc__:
            continue
        if isinstance(function, property | functools.cached_property):
            yield f"- `{name}`: {_summary(function)}"
        elif inspect.isfunction(inspect.unwrap(function)):
            yield f"- `{_signature(name, function)}`: {_summary(function)}"


def _signature(name: str, one: Any) -> str:
    """Name, parameters with their types and defaults, and what is returned; the same with every Python."""
    if inspect.isclass(one) and issubclass(one, enum.Enum):  # of which each Python has a signature of its own
        return f"{name}: {', '.join(one.__members__)}"
    try:
        made = inspect.signature(one)
    except (TypeError, ValueError):  # of an exception, for one
        return name
    parts, kinds = [], inspect.Parameter
    for each in made.parameters.values():
        if each.name == "self":
            continue
        if each.kind is kinds.KEYWORD_ONLY and "*" not in parts and not any(part.startswith("*") for part in parts):
            parts.append("*")
        part = {kinds.VAR_POSITIONAL: "*", kinds.VAR_KEYWORD: "**"}.get(each.kind, "") + each.name
        part += f": {_annotation(each.annotation)}" * (each.annotation is not each.empty)
        parts.append(part + f" = {_default(each.default)}" * (each.default is not each.empty))
    inside = ", ".join(parts) if len(parts) <= _MOST else "..."
    made_of = made.return_annotation
    returns = "" if inspect.isclass(one) or made_of in (made.empty, None, "None") else f" -> {_annotation(made_of)}"
    return f"{name}({inside}){returns}"


def _annotation(kind: Any) -> str:
    if isinstance(kind, ForwardRef):  # of a named tuple's fields
        return kind.__forward_arg__
    return kind if isinstance(kind, str) else getattr(kind, "__name__", str(kind))


def _default(value: Any) -> str:
    """Its representation, unless that is long or has an address in it."""
    text = f"{value:.6g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 30 and "<" not in text else "..."


def _summary(one: Any) -> str:
    """The first paragraph of a docstring, in a line."""
    first, *_ = (inspect.getdoc(one) or "").split("\n\n")
    if inspect.isclass(one) and first.startswith(f"{one.__name__}("):  # a dataclass without a docstring: its signature
        return ""
    first = _SECTION.split(first)[0]
    return " ".join(first.split()).replace("<", "&lt;") if "`" not in first else " ".join(first.split())


def _entries(one: Any) -> str:
    """The arguments, or the attributes, of a docstring as a list."""
    parts = _SECTION.split(inspect.getdoc(one) or "")
    named = dict(zip(parts[1::2], parts[2::2], strict=True))
    text = named.get("Args", "") + named.get("Attributes", "")
    entries = _ENTRY.findall(text) + (_fields(one) if dataclasses.is_dataclass(one) else [])
    return "\n".join(f"- `{name}`: {' '.join(words.split())}" for name, words in entries)


def _fields(kind: type) -> list[tuple[str, str]]:
    """The fields of a class's own that have a comment `#:`, behind them or before."""
    try:
        found = _FIELD.findall(inspect.getsource(kind))
    except OSError:  # of a class that is made of others' names
        return []
    return [(name, behind or re.sub(r"#:?", "", before)) for before, name, behind in found if before or behind]


def main() -> None:
    """Write them."""
    for file, text in pages().items():
        page = FOLDER / file
        if not page.exists() or page.read_text("utf-8") != text:
            (FOLDER / file).write_text(text, encoding="utf-8")
            print(FOLDER / file)


if __name__ == "__main__":
    main()
