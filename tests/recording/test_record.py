"""The record of an episode: its columns, and the table of them."""

import dataclasses
import inspect

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.recording.ledger import Ledger
from caregiver_mj.recording.record import COLUMNS, MEASURES, EpisodeRecord, markdown, names

# What rows have had ever since, written out once more: none of these may be renamed.
FORMER = ["world", "house", "caregiver", "epsilon", "episode", "seed"]
FORMER += ["damage", "damage_stairwell", "damage_candle", "damage_table", "timesteps_to_threshold", "cells_visited"]
FORMER += ["toys_reached", "moves_blocked", "interventions", "interventions_done", "candles_dropped", "strikes"]
FORMER += ["sim_seconds", "wall_seconds"]


def test_columns_are_the_record():
    assert [column.name for column in COLUMNS] == list(inspect.signature(EpisodeRecord).parameters)
    assert {column.type for column in COLUMNS} == {"str", "int", "float", "list[float]"}
    assert {column.role for column in COLUMNS} == {"setting", "damage", "count", "contact", "child", "time"}
    assert all(column.meaning and column.title for column in COLUMNS)


def test_former_columns_are_all_there_in_their_order():
    assert [column.name for column in COLUMNS if column.name in FORMER] == FORMER
    assert {column.name for column in COLUMNS} - set(FORMER) == {
        "family",
        "children",
        "damage_gate",
        "damage_battery",
        "damage_by_child",
        "toys_by_child",
        "stopped",
        "damage_until_stop",
        "moves_blocked_stairwell",
        "moves_blocked_free",
        "longest_blocked",
        "moves_entered",
        "moves_entered_blocked",
        "moves_held_up",
        *names("contact"),
    }


def test_the_house_counts_all_contacts_there_are_columns_for():
    assert tuple(Contacts().outcome()) == names("contact")
    types = {column.name: column.type for column in COLUMNS}
    assert all(type(value).__name__ == types[name] for name, value in Contacts().outcome().items())


def test_measures_can_be_averaged():
    assert [name for name in MEASURES if name in FORMER] == FORMER[6:]
    assert {"stopped", "damage_until_stop", "longest_blocked"} < set(MEASURES)
    assert names("damage")[:4] == tuple(FORMER[6:10])
    assert names("time", "damage") == (*names("damage"), "sim_seconds", "wall_seconds")


def test_a_ledger_and_two_clocks_fill_a_record():
    plan = FloorPlan.parse("####\n#B.#\n####")
    outcome = Ledger(plan, np.zeros((1, 1), int), 200).outcome()
    settings = dict.fromkeys(names("setting"), "x")
    record = EpisodeRecord(**settings, **outcome, sim_seconds=1.0, wall_seconds=2.0)
    assert list(dataclasses.asdict(record)) == [column.name for column in COLUMNS]


@pytest.mark.parametrize("name", [column.name for column in COLUMNS])
def test_every_column_is_in_the_table(name):
    (row,) = (line for line in markdown().splitlines() if line.startswith(f"| `{name}` |"))
    column = next(column for column in COLUMNS if column.name == name)
    assert row.endswith(" (house only) |") == (column.world == "house")
    assert row.count("|") == 4
