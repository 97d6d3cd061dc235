"""Interventions in batches, and the verbs by name."""

import pytest

from caregiver_mj import FloorPlan
from caregiver_mj.interventions.verb import (
    BLOCK,
    PICK_UP,
    RELOCATE,
    VERBS,
    Intervention,
    Interventions,
    verb_of,
)

PLAN = FloorPlan.parse("########\n#S..o.B#\n##T#CT##\n########")


def test_another_destination_is_no_other_intervention():
    before = Interventions.of([Intervention(RELOCATE, 1, 2), Intervention(RELOCATE, 1, 2), Intervention(BLOCK, 0)])
    now = Interventions.of([Intervention(RELOCATE, 1, 0), Intervention(BLOCK, 0), Intervention(BLOCK, 1)])
    assert now.begins_after(before).tolist() == [False, True, True]


@pytest.mark.parametrize("name", list(VERBS))
def test_every_verb_says_what_it_is_called_and_drawn_as(name):
    verb = verb_of(name)
    intervention = Intervention(name, {BLOCK: 0, RELOCATE: 1, PICK_UP: 2}.get(name, -1))
    marks = {BLOCK: ("cell", (1, 1)), RELOCATE: ("candle", 0), PICK_UP: ("cell", (1, 4))}
    assert verb.name == name
    assert verb.describe(PLAN, intervention)
    assert verb.mark(PLAN, intervention) == marks.get(name)
