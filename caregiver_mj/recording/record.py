"""The record of an episode: its columns, with types, units and meanings.

They define the Parquet schema, the table in the documentation and the report's words.
"""

from __future__ import annotations

import dataclasses
import functools

from caregiver_mj.plans.hazards import KINDS

DAMAGE_THRESHOLD = 15.0  # damage above which the paper ends an interaction (section V.E)


@dataclasses.dataclass(frozen=True)
class Column:
    """A column of `episodes.parquet`; its numbers are finite and at least 0."""

    name: str  #: name in the file
    type: str  #: str, int, float, or list[float] (a value for each child)
    unit: str  #: unit, empty for names and counts
    title: str  #: name in tables for people
    meaning: str  #: meaning, for the documentation
    #: "setting", "damage", "count" (of events), "contact" (of robot or held candle with children), "child" (a value for
    #: each child) or "time"
    role: str
    world: str = ""  #: the only world that measures it, if not both; 0 in the other


_setting, _damage, _count, _child, _time = (
    functools.partial(Column, role=role) for role in ("setting", "damage", "count", "child", "time")
)
_contact = functools.partial(Column, role="contact", world="house")  # measured in the house only
COLUMNS: tuple[Column, ...] = (
    _setting("world", "str", "", "world", "`house`, the physical one, or `grid`"),
    _setting("house", "str", "", "house", "name of the floor plan"),
    _setting("caregiver", "str", "", "caregiver", "name of the caregiver, or `none`"),
    _setting("family", "str", "", "children",
        "epsilon of each child, as `0.5` or `1,0.25`; with its name if it is no novice"),
    _setting("epsilon", "float", "", "random share",
        "share of moves that are random; with several children their mean"),
    _setting("children", "int", "", "number of children", "number of children"),
    _setting("episode", "int", "", "episode", "number of the episode, from 0"),
    _setting("seed", "int", "", "seed", "seed of its children and of its caregiver"),
    _setting("sight", "str", "", "sight", "the caregiver's sight: `all`, `walls`, `camera` or `rooms:N`"),
    _damage("damage", "float", "damage", "damage", "damage to all children in 200 novice timesteps"),
    *(_damage(f"damage_{kind.name}", "float", "damage", f"at {kind.at}",
              f"of that, {kind.harm} (by default {kind.damage:g} each)") for kind in KINDS),
    _damage("damage_until_stop", "float", "damage", "damage until the stop",
        "damage until it exceeds 15, where the paper ends an interaction"),
    _child("damage_by_child", "list[float]", "damage", "damage of each child", "damage to each child"),
    _count("stopped", "int", "", "share stopped", "whether the damage exceeded 15: 1 or 0"),
    _count("timesteps_to_threshold", "int", "timesteps", "timesteps", "until that; 200 if it never did"),
    _count("cells_visited", "int", "cells", "cells visited", "distinct cells that any child visited until then"),
    _count("toys_reached", "int", "bins", "toys reached", "toy bins reached by all children, over all 200 timesteps"),
    _child("toys_by_child", "list[float]", "bins", "toys of each child", "toy bins that each child reached"),
    _count("moves_blocked", "int", "moves", "moves blocked",
        "children's moves into the caregiver or a closed gate"),
    _count("moves_blocked_stairwell", "int", "moves", "stairwells denied",
        "of those, moves into a stairwell in which it stood, or that was shut"),
    _count("moves_blocked_free", "int", "moves", "free moves denied", "of those, moves into a free cell"),
    _count("longest_blocked", "int", "timesteps", "longest blocked",
        "most consecutive timesteps in which the moves of one child were blocked"),
    _count("moves_entered", "int", "moves", "moves cut off",
        "children's moves into a cell that the caregiver entered after they had set out"),
    _count("moves_entered_blocked", "int", "moves", "cut off and blocked", "of those, moves that it blocked"),
    _count("moves_held_up", "int", "moves", "moves held up",
        "moves in which a child touched the caregiver in its way, but got there"),
    _count("interventions", "int", "", "interventions", "interventions begun"),
    _count("interventions_done", "int", "", "interventions done",
        "of those, completed: a stairwell reached, a gate closed, a candle put down, a small thing picked up"),
    _count("seen", "float", "share", "children seen", "share of the timesteps at whose end the caregiver saw a child"),
    _count("looking", "float", "share", "time looking",
        "share of the timesteps that it spent looking for children", world="grid"),
    _count("guarding", "float", "share", "time guarding", "on blocking stairwells, and on the way there", world="grid"),
    _count("handling", "float", "share", "time handling",
        "on actions with its hand, and on the way there", world="grid"),
    _count("candles_dropped", "int", "", "candles dropped", "candles that fell over or down", world="house"),
    _count("strikes", "int", "", "strikes",
        "contacts of a child with a part of the robot that moves towards it faster than 0.05 m/s", world="house"),
    _contact("strikes_surface", "int", "", "strikes, turning and sliding too",
        "contacts of a child with a part of the robot whose surface comes, or is driven, towards it or along it, "
        "faster than 0.05 m/s"),
    _contact("contact_speed", "float", "m/s", "contact speed", "greatest such speed of its surface at a contact"),
    _contact("contact_seconds", "float", "s", "seconds in contact", "time for which the robot touched a child"),
    _contact("pressings", "int", "", "pressings", "contacts with the robot of half a second or more"),
    _contact("contact_force", "float", "N", "greatest force",
        "greatest force between robot and child, summed over simultaneous contacts"),
    _contact("contact_force_legs", "float", "N", "on the legs", "of that, lower than 0.24 m above the floor"),
    _contact("contact_force_trunk", "float", "N", "on the trunk", "of that, from there to 0.54 m"),
    _contact("contact_force_head", "float", "N", "on the head", "of that, above"),
    _contact("contact_impulse", "float", "N s", "impulse", "force times time, over all contacts with the robot"),
    _contact("flame_distance", "float", "m", "flame to child",
        "least distance of a child from the flame of a candle in the robot's hand; at most 1"),
    _contact("flame_seconds", "float", "s", "seconds of the flame near", "time for which it was within 0.3 m of one"),
    _contact("wax_distance", "float", "m", "candle to child",
        "least distance of a child from a candle in the robot's hand; at most 1"),
    _contact("wax_seconds", "float", "s", "seconds of the candle near", "time for which it was within 0.1 m of one"),
    _contact("contacts_creeping", "int", "", "contacts, creeping",
        "contacts with the robot (interruptions of up to 0.1 s do not end one) whose contact speed is at most 0.05 "
        "m/s"),
    _contact("contacts_slow", "int", "", "contacts, slow", "those with a contact speed from there to 0.25 m/s"),
    _contact("contacts_fast", "int", "", "contacts, fast", "those above"),
    _contact("contact_energy", "float", "J", "greatest energy",
        "greatest kinetic energy of a contact: half the reduced mass of robot and child, times its speed squared"),
    _contact("contact_energy_total", "float", "J", "energy in all", "sum of the greatest energy of each contact"),
    _contact("pinches", "int", "", "pinches",
        "contacts with the robot and, on the other side, a wall, a table, a bin or a closed gate"),
    _contact("pinch_seconds", "float", "s", "seconds pinched", "time for which a child was between them"),
    _contact("contact_seconds_base", "float", "s", "at the base", "time for which the robot's base touched a child"),
    _contact("contact_seconds_arm", "float", "s", "at the arm", "the same of its arm, hand or held thing"),
    _contact("contact_seconds_legs", "float", "s", "on the legs", "the same of any of them, below 0.24 m"),
    _contact("contact_seconds_trunk", "float", "s", "on the trunk", "the same, from there to 0.54 m"),
    _contact("contact_seconds_head", "float", "s", "on the head", "the same, above"),
    _contact("contact_seconds_driven", "float", "s", "driven",
        "time with a contact speed above 0.05 m/s; in the rest the robot stood, crept or was pushed"),
    _contact("gate_strikes", "int", "", "gate strikes",
        "contacts of a child with a gate's panel that the robot moves towards it faster than 0.05 m/s"),
    _time("sim_seconds", "float", "s", "simulated time", "simulated length of the episode"),
    _time("wall_seconds", "float", "s", "computing time", "time to compute the episode"),
)  # fmt: skip
#: A row of `episodes.parquet`: a data class with an attribute for each column, all of them required.
EpisodeRecord = dataclasses.make_dataclass("EpisodeRecord", [column.name for column in COLUMNS], frozen=True)
EpisodeRecord.__module__ = __name__  # for pickling; Python 3.11 sets `types`


def names(*roles: str) -> tuple[str, ...]:
    """Return the names of the columns with one of these roles, in order."""
    return tuple(column.name for column in COLUMNS if column.role in roles)


MEASURES = names("damage", "count", "contact", "time")  # numbers that can be averaged
