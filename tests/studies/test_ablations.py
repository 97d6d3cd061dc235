"""The study of ablations: its table by hand, and that every variant can be made."""

import pandas as pd
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from studies.ablations import BASES, GROUPS, NONE, RULE, Job, run_job, shown_differences, variant, variants_table

SMALL = FloorPlan.parse("########\n#S.C..B#\n#......#\n#.T..BS#\n########", "small")


def rows(name, house, damage, blocked=1.0):
    """Two episodes with each of two families."""
    each = {"house": house, "variant": name, "toys_reached": 5.0, "moves_blocked_free": blocked, "interventions": 2.0}
    return [each | {"family": f, "episode": e, "damage": damage + e} for f in ("1", "0.5") for e in (0, 1)]


def test_the_table_by_hand():
    made = []
    for house, more in (("a", 0.0), ("b", 1.0)):
        made += rows(NONE, house, 9.5 + more) + rows(RULE, house, 3.5 + more)
        for how in GROUPS["actions in a timestep"].changed:
            made += rows(f"actions in a timestep: {how}", house, 2.5 + more, blocked=3.0)
    head, _, own, *others = variants_table(pd.DataFrame(made), "actions in a timestep").splitlines()
    assert head.startswith("| group | variant | 1 | 0.5 |")
    assert own == "| actions in a timestep | the rule | 0.429 | 0.429 |  | 100.0% | 1.00 | 2.0 | 100% |"  # 4.5 of 10.5
    assert len(others) == len(GROUPS["actions in a timestep"].changed)
    shown = shown_differences(pd.DataFrame(made), "actions in a timestep")
    assert [how for _, how, _ in shown] == [*GROUPS["actions in a timestep"].changed]
    # 3.5 of 10.5; one less with either family, in both houses, whose interval has no width; none of the episodes equal.
    assert (
        others[0] == "| actions in a timestep | 1 | 0.333 | 0.333 | -2.00 (-2.00 to -2.00) | 100.0% | 3.00 | 2.0 | 0% |"
    )


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
