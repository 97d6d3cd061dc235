"""The study of ablations: its table by hand, and that every variant can be made."""

import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import BASES, GROUPS, NONE, RULE, Job, run_job, variant

SMALL = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.T..BS#\n########", "small")


@pytest.mark.parametrize("name", [*BASES, *(f"{group}: {how}" for group in GROUPS for how in GROUPS[group].changed)])
def test_every_variant_can_be_made(name):
    found = variant(name)
    assert (found is None) == (name == NONE)
    if found and "other houses" not in name:  # these walk twenty houses first
        assert found.make(SMALL, **found.options).plan is SMALL


def test_episodes_are_those_of_the_families_in_turn():
    found = run_job(Job("house-1-9x8-rooms1-stairwells1-candles1-tables2-bins2", RULE, ("1", "1,0.25"), 3))
    assert found["family"] == ["1"] * 3 + ["1,0.25"] * 3
    assert found["episode"] == [0, 1, 2, 0, 1, 2]
    assert len(found["damage"]) == 6
    assert sum(found["damage"]) > 0
