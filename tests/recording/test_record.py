"""The record of an episode: its columns, and the table of them."""

import dataclasses

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.recording.ledger import Contacts, Ledger
from caregiver_mj.recording.record import COLUMNS, EpisodeRecord, names


def test_a_ledger_and_two_clocks_fill_a_record():
    plan = FloorPlan.parse("####\n#B.#\n####")
    outcome = Ledger(plan, np.zeros((1, 1), int), 200).outcome()
    settings = dict.fromkeys(names("setting"), "x")
    record = EpisodeRecord(**settings, **outcome, sim_seconds=1.0, wall_seconds=2.0)
    assert list(dataclasses.asdict(record)) == [column.name for column in COLUMNS]


def test_the_house_counts_all_contacts_there_are_columns_for():
    assert tuple(Contacts().outcome()) == ("strikes", *names("contact"))
    types = {column.name: column.type for column in COLUMNS}
    assert all(type(value).__name__ == types[name] for name, value in Contacts().outcome().items())
