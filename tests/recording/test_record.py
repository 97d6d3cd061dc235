"""The record of an episode: its columns, and the table of them."""

import dataclasses
import inspect

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.recording.ledger import Ledger
from caregiver_mj.recording.record import COLUMNS, MEASURES, EpisodeRecord, names

# What rows have had ever since, written out once more: none of these may be renamed.
FORMER = ["world", "house", "caregiver", "epsilon", "episode", "seed"]
FORMER += ["damage", "damage_stairwell", "damage_candle", "damage_table", "timesteps_to_threshold", "cells_visited"]
FORMER += ["toys_reached", "moves_blocked", "interventions", "interventions_done", "candles_dropped", "strikes"]
FORMER += ["sim_seconds", "wall_seconds"]


def test_columns_are_the_record_and_a_ledger_and_two_clocks_fill_it():
    assert [column.name for column in COLUMNS] == list(inspect.signature(EpisodeRecord).parameters)
    assert {column.type for column in COLUMNS} == {"str", "int", "float", "list[float]"}
    assert {column.role for column in COLUMNS} == {"setting", "damage", "count", "contact", "child", "time"}
    assert all(column.meaning and column.title for column in COLUMNS)
    # A ledger and two clocks fill a record.
    plan = FloorPlan.parse("####\n#B.#\n####")
    outcome = Ledger(plan, np.zeros((1, 1), int), 200).outcome()
    settings = dict.fromkeys(names("setting"), "x")
    record = EpisodeRecord(**settings, **outcome, sim_seconds=1.0, wall_seconds=2.0)
    assert list(dataclasses.asdict(record)) == [column.name for column in COLUMNS]


def test_former_columns_are_all_there_in_their_order():
    assert [column.name for column in COLUMNS if column.name in FORMER] == FORMER
    assert [name for name in MEASURES if name in FORMER] == FORMER[6:]  # what can be averaged
    assert names("damage")[:4] == tuple(FORMER[6:10])
    assert {column.name for column in COLUMNS} - set(FORMER) == {
        "family",
        "children",
        "damage_gate",
        "damage_mug",
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
