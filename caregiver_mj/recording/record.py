"""The record of an episode: every column once, with its type, unit and meaning.

The Parquet schema, the table in the documentation, the report's words and what both worlds count come from here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

from caregiver_mj.plans.hazards import KINDS

# ruff: noqa: RUF009 - `_column` only describes a field
DAMAGE_THRESHOLD = 15.0  # the paper ends an interaction as soon as the damage is above this (section V.E)


@dataclasses.dataclass(frozen=True)
class Column:
    """A column of `episodes.parquet`.

    Attributes:
        name: Its name.
        type: Its type: str, int, float, or list[float] (a value for each child).
        unit: Its unit, empty for names and numbers of things.
        title: What it is called in tables for people.
        meaning: What it is.
        role: "setting" (what was run), "damage", "count" (of events), "contact" (what the robot and the candle in its
            hand did to the children), "child" (a value for each child) or "time".
        world: The world that it is measured in, if it is only one; 0 in the other.
    """

    name: str
    type: str
    unit: str
    title: str
    meaning: str
    role: str
    world: str = ""


def _column(
    unit: str, title: str, meaning: str, role: str, world: str = ""
) -> Any:  # a dataclass field, whatever its type
    """A field of `EpisodeRecord`."""
    return dataclasses.field(metadata={"unit": unit, "title": title, "meaning": meaning, "role": role, "world": world})


def _contact(unit: str, title: str, meaning: str) -> Any:
    """A field of what the robot did to the children: measured in the house only."""
    return _column(unit, title, meaning, "contact", world="house")


@dataclasses.dataclass(frozen=True)
class EpisodeRecord:
    """One episode, as it stands in a row of `episodes.parquet`: an attribute a column, however many there are.

    `COLUMNS` says what each of them is.
    """

    world: str = _column("", "world", "`house`, the physical one, or `grid`", "setting")
    house: str = _column("", "house", "name of the floor plan", "setting")
    caregiver: str = _column("", "caregiver", "name of the caregiver, or `none`", "setting")
    family: str = _column(
        "", "children", "epsilon of each child, as `0.5` or `1,0.25`; with its name if it is no novice", "setting"
    )
    epsilon: float = _column(
        "", "random share", "share of moves that are random; with several children their mean", "setting"
    )
    children: int = _column("", "number of children", "how many children there are", "setting")
    episode: int = _column("", "episode", "its number, from 0", "setting")
    seed: int = _column("", "seed", "seed of its children and of its caregiver", "setting")

    damage: float = _column(
        "damage", "damage", "all damage in 200 novice timesteps, of all children together", "damage"
    )
    for _kind in KINDS:  # damage_stairwell and so on
        __annotations__[f"damage_{_kind.name}"] = "float"
        locals()[f"damage_{_kind.name}"] = _column(
            "damage", f"at {_kind.at}", f"of that, {_kind.harm} (by default {_kind.damage:g} each)", "damage"
        )
    del _kind
    damage_until_stop: float = _column(
        "damage",
        "damage until the stop",
        "all damage until it comes above 15, where the paper ends an interaction",
        "damage",
    )
    damage_by_child: list[float] = _column("damage", "damage of each child", "all damage of each child", "child")

    stopped: int = _column("", "share stopped", "whether the damage came above 15: 1 or 0", "count")
    timesteps_to_threshold: int = _column("timesteps", "timesteps", "until that; 200 if it never did", "count")
    cells_visited: int = _column("cells", "cells visited", "distinct cells that any child visited until then", "count")
    toys_reached: int = _column(
        "bins", "toys reached", "toy bins reached by all children, over all 200 timesteps", "count"
    )
    toys_by_child: list[float] = _column("bins", "toys of each child", "toy bins that each child reached", "child")
    moves_blocked: int = _column(
        "moves", "moves blocked", "children's moves into the caregiver: how much it was in the way", "count"
    )
    moves_blocked_stairwell: int = _column(
        "moves", "stairwells denied", "of those, moves into a stairwell that it stood in", "count"
    )
    moves_blocked_free: int = _column(
        "moves", "free moves denied", "of those, moves to where it stood in the way", "count"
    )
    longest_blocked: int = _column(
        "timesteps", "longest blocked", "most timesteps on end in which it blocked the moves of one child", "count"
    )
    moves_entered: int = _column(
        "moves", "moves cut off", "children's moves into whose cell the caregiver came after they had set out", "count"
    )
    moves_entered_blocked: int = _column("moves", "cut off and blocked", "of those, moves that it blocked", "count")
    moves_held_up: int = _column(
        "moves", "moves held up", "moves in which a child touched the caregiver in its way, and got there", "count"
    )
    interventions: int = _column("", "interventions", "interventions begun", "count")
    interventions_done: int = _column(
        "", "interventions done", "of those, completed: a stairwell reached, or a candle put down", "count"
    )
    candles_dropped: int = _column("", "candles dropped", "candles that fell over or down", "count", world="house")
    strikes: int = _column(
        "",
        "strikes",
        "contacts of a child with a part of the robot that moves towards it faster than 0.05 m/s",
        "count",
        world="house",
    )

    strikes_surface: int = _contact(
        "",
        "strikes, turning and sliding too",
        "contacts of a child with a part of the robot whose surface comes, or is driven, towards it or along it, "
        "faster than 0.05 m/s",
    )
    contact_speed: float = _contact("m/s", "contact speed", "fastest that its surface moved so, touching a child")
    contact_seconds: float = _contact("s", "seconds in contact", "how long the robot touched a child")
    pressings: int = _contact("", "pressings", "contacts with the robot of half a second or more")
    contact_force: float = _contact(
        "N", "greatest force", "greatest force between robot and child, that of all contacts at a time added up"
    )
    contact_force_legs: float = _contact("N", "on the legs", "of that, lower than 0.24 m above the floor")
    contact_force_trunk: float = _contact("N", "on the trunk", "of that, from there to 0.54 m")
    contact_force_head: float = _contact("N", "on the head", "of that, above")
    contact_impulse: float = _contact("N s", "impulse", "force times time, over all contacts with the robot")
    flame_distance: float = _contact(
        "m", "flame to child", "closest that the flame of a candle in the robot's hand came to a child; at most 1"
    )
    flame_seconds: float = _contact("s", "seconds of the flame near", "how long it was within 0.3 m of one")
    wax_distance: float = _contact(
        "m", "candle to child", "closest that the candle itself came to a child in the robot's hand; at most 1"
    )
    wax_seconds: float = _contact("s", "seconds of the candle near", "how long it was within 0.1 m of one")

    sim_seconds: float = _column("s", "simulated time", "how long the episode was in the simulated world", "time")
    wall_seconds: float = _column("s", "computing time", "how long it took to compute", "time")


COLUMNS: tuple[Column, ...] = tuple(
    Column(field.name, str(field.type), **field.metadata) for field in dataclasses.fields(EpisodeRecord)
)


def names(*roles: str) -> tuple[str, ...]:
    """Return the names of the columns that have one of some roles, in their order."""
    return tuple(column.name for column in COLUMNS if column.role in roles)


MEASURES = names("damage", "count", "contact", "time")  # numbers that can be averaged


def markdown(columns: Iterable[Column] = COLUMNS) -> str:
    """Return the columns as a table in Markdown."""
    rows = ["| column | unit | is |", "|---|---|---|"]
    for one in columns:
        where = f" ({one.world} only)" if one.world else ""
        rows.append(f"| `{one.name}` | {one.unit} | {one.meaning}{where} |")
    return "\n".join(rows)
