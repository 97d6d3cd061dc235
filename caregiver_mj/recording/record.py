"""The record of an episode: every column once, with its type, unit and meaning.

The Parquet schema, the table in the documentation, the report's words and what both worlds count come from here.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

from caregiver_mj.plans.hazards import KINDS

# ruff: noqa: RUF009 - `_column` only describes a field
DAMAGE_THRESHOLD = 15.0  # the paper ends an interaction as soon as the damage is above this (section V.E)


@dataclasses.dataclass(frozen=True)
class Column:
    """A column of `episodes.parquet`."""

    name: str  #: its name
    type: str  #: its type: str, int, float, or list[float] (a value for each child)
    unit: str  #: its unit, empty for names and numbers of things
    title: str  #: what it is called in tables for people
    meaning: str  #: what it is
    #: "setting" (what was run), "damage", "count" (of events), "contact" (what the robot and the candle in its hand did
    #: to the children), "child" (a value for each child) or "time"
    role: str
    world: str = ""  #: the world that it is measured in, if it is only one; 0 in the other


def _column(unit: str, title: str, meaning: str, role: str, world: str = "") -> Any:  # a field, whatever its type
    return dataclasses.field(metadata={"unit": unit, "title": title, "meaning": meaning, "role": role, "world": world})


_setting = functools.partial(_column, "", role="setting")
_damage, _count, _child, _time = (
    functools.partial(_column, role=role) for role in ("damage", "count", "child", "time")
)
_contact = functools.partial(_column, role="contact", world="house")  # measured in the house only


@dataclasses.dataclass(frozen=True)
class EpisodeRecord:
    """One episode, as it stands in a row of `episodes.parquet`: an attribute a column, however many there are.

    `COLUMNS` says what each of them is.
    """

    world: str = _setting("world", "`house`, the physical one, or `grid`")
    house: str = _setting("house", "name of the floor plan")
    caregiver: str = _setting("caregiver", "name of the caregiver, or `none`")
    family: str = _setting("children", "epsilon of each child, as `0.5` or `1,0.25`; with its name if it is no novice")
    epsilon: float = _setting("random share", "share of moves that are random; with several children their mean")
    children: int = _setting("number of children", "how many children there are")
    episode: int = _setting("episode", "its number, from 0")
    seed: int = _setting("seed", "seed of its children and of its caregiver")
    sight: str = _setting("sight", "what the caregiver sees: `all`, `walls`, `camera` or `rooms:N`")

    damage: float = _damage("damage", "damage", "all damage in 200 novice timesteps, of all children together")
    for _kind in KINDS:  # damage_stairwell and so on
        __annotations__[f"damage_{_kind.name}"] = "float"
        locals()[f"damage_{_kind.name}"] = _damage(
            "damage", f"at {_kind.at}", f"of that, {_kind.harm} (by default {_kind.damage:g} each)"
        )
    del _kind
    damage_until_stop: float = _damage(
        "damage", "damage until the stop", "all damage until it comes above 15, where the paper ends an interaction"
    )
    damage_by_child: list[float] = _child("damage", "damage of each child", "all damage of each child")

    stopped: int = _count("", "share stopped", "whether the damage came above 15: 1 or 0")
    timesteps_to_threshold: int = _count("timesteps", "timesteps", "until that; 200 if it never did")
    cells_visited: int = _count("cells", "cells visited", "distinct cells that any child visited until then")
    toys_reached: int = _count("bins", "toys reached", "toy bins reached by all children, over all 200 timesteps")
    toys_by_child: list[float] = _child("bins", "toys of each child", "toy bins that each child reached")
    moves_blocked: int = _count(
        "moves", "moves blocked", "children's moves into the caregiver, or a closed gate: how much was in the way"
    )
    moves_blocked_stairwell: int = _count(
        "moves", "stairwells denied", "of those, moves into a stairwell that it stood in, or that was shut"
    )
    moves_blocked_free: int = _count("moves", "free moves denied", "of those, moves to where it stood in the way")
    longest_blocked: int = _count(
        "timesteps", "longest blocked", "most timesteps on end in which it blocked the moves of one child"
    )
    moves_entered: int = _count(
        "moves", "moves cut off", "children's moves into whose cell the caregiver came after they had set out"
    )
    moves_entered_blocked: int = _count("moves", "cut off and blocked", "of those, moves that it blocked")
    moves_held_up: int = _count(
        "moves", "moves held up", "moves in which a child touched the caregiver in its way, and got there"
    )
    interventions: int = _count("", "interventions", "interventions begun")
    interventions_done: int = _count(
        "",
        "interventions done",
        "of those, completed: a stairwell reached, a gate closed, a candle put down, a small thing picked up",
    )
    seen: float = _count("share", "children seen", "share of the timesteps at whose end the caregiver saw a child")
    looking: float = _count(
        "share", "time looking", "share of them that it spent on looking for children", world="grid"
    )
    guarding: float = _count("share", "time guarding", "on blocking stairwells, and on the way there", world="grid")
    handling: float = _count(
        "share", "time handling", "on what it does with its hand, and on the way there", world="grid"
    )
    candles_dropped: int = _count("", "candles dropped", "candles that fell over or down", world="house")
    strikes: int = _count(
        "",
        "strikes",
        "contacts of a child with a part of the robot that moves towards it faster than 0.05 m/s",
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
    contacts_creeping: int = _contact(
        "",
        "contacts, creeping",
        "contacts with the robot (interruptions of up to 0.1 s do not end one) whose contact speed is at most 0.05 m/s",
    )
    contacts_slow: int = _contact("", "contacts, slow", "those with a contact speed from there to 0.25 m/s")
    contacts_fast: int = _contact("", "contacts, fast", "those above")
    contact_energy: float = _contact(
        "J",
        "greatest energy",
        "greatest kinetic energy of a contact: half the reduced mass of robot and child, times its speed squared",
    )
    contact_energy_total: float = _contact("J", "energy in all", "the greatest of each contact, added up")
    pinches: int = _contact(
        "", "pinches", "contacts with the robot and, on the other side, a wall, a table, a bin or a closed gate"
    )
    pinch_seconds: float = _contact("s", "seconds pinched", "how long a child was between them")
    contact_seconds_base: float = _contact("s", "at the base", "seconds in which the robot's base touched a child")
    contact_seconds_arm: float = _contact("s", "at the arm", "in which its arm or hand did, or what it holds")
    contact_seconds_legs: float = _contact("s", "on the legs", "in which any of them did so below 0.24 m")
    contact_seconds_trunk: float = _contact("s", "on the trunk", "from there to 0.54 m")
    contact_seconds_head: float = _contact("s", "on the head", "above")
    contact_seconds_driven: float = _contact(
        "s", "driven", "in which the contact speed was above 0.05 m/s; in the rest the robot stood, crept or was pushed"
    )
    gate_strikes: int = _contact(
        "",
        "gate strikes",
        "contacts of a child with a gate's panel that the robot moves towards it faster than 0.05 m/s",
    )

    sim_seconds: float = _time("s", "simulated time", "how long the episode was in the simulated world")
    wall_seconds: float = _time("s", "computing time", "how long it took to compute")


COLUMNS: tuple[Column, ...] = tuple(
    Column(field.name, str(field.type), **field.metadata) for field in dataclasses.fields(EpisodeRecord)
)


def names(*roles: str) -> tuple[str, ...]:
    """Return the names of the columns that have one of some roles, in their order."""
    return tuple(column.name for column in COLUMNS if column.role in roles)


MEASURES = names("damage", "count", "contact", "time")  # numbers that can be averaged
