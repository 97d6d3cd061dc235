"""Caregivers to compare with: what they choose in a corridor, by hand."""

import dataclasses

import numpy as np
import pytest
from worlds import percept

from caregiver_mj.caregivers import make_caregiver
from caregiver_mj.caregivers.baselines import ChildproofCaregiver, WandererCaregiver, table_exposure
from caregiver_mj.caregivers.paper import CandlesCaregiver, StairsCaregiver
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

# A corridor of cells 0 to 4, the landing is cell 5. Tables: 0 bare, 1 with the candle, 2 bare.
CORRIDOR = FloorPlan.parse("#########\n#S.....B#\n##T#C#T##\n#########")
STAIRWELL, CANDLE = 0, 1
LANDING = 5


def see(child_cell, candle_table=1, caregiver_cell=4, holding=NOTHING):
    return percept(CORRIDOR, child_cell, caregiver_cell, candle_table, holding=[holding])


@pytest.mark.parametrize("cell", range(5))
def test_stairs_and_candles_see_to_nothing_else(cell):
    """The rule itself takes the stairwell from cells 0 and 1, the candle from the others."""
    assert StairsCaregiver(CORRIDOR).choose(see(cell)).tolist() == [STAIRWELL]
    assert CandlesCaregiver(CORRIDOR).choose(see(cell)).tolist() == [CANDLE]
    assert CandlesCaregiver(CORRIDOR).choose(see(cell, NOTHING, holding=0)).tolist() == [NOTHING]


def wandering(hazard):
    """A wanderer that has just drawn a hazard, and its first percept; the child is in cell 2, nearest to the candle."""
    for seed in range(50):
        wanderer = WandererCaregiver(CORRIDOR)
        wanderer.reset(1, [seed])
        if wanderer.choose(see(2)).tolist() == [hazard]:
            return wanderer
    raise AssertionError("it never draws it")


@pytest.mark.parametrize("hazard", [STAIRWELL, CANDLE])
def test_the_wanderer_keeps_to_what_it_has_drawn(hazard):
    wanderer = wandering(hazard)
    for caregiver_cell in (3, 2, 1, 0, 1, 2, 3, 4) * 5:
        wanderer.watch(see(2))
        assert wanderer.choose(see(2, caregiver_cell=caregiver_cell)).tolist() == [hazard]


def choices_after(wanderer, percept, timesteps=60):
    """What it chooses over some timesteps in which it goes on seeing the same."""
    found = []
    for _ in range(timesteps):
        wanderer.watch(percept)
        found += wanderer.choose(percept).tolist()
    return found


def test_the_wanderer_draws_again_once_it_has_done_or_cannot_do_what_it_drew():
    choices = choices_after(wandering(STAIRWELL), see(2, caregiver_cell=LANDING))
    # On the landing every stairwell drawn is done with at once; a candle is kept.
    first = choices.index(CANDLE)
    assert set(choices[:first]) <= {STAIRWELL}
    assert set(choices[first:]) == {CANDLE}
    # The wanderer finishes with a candle when it stands on another table.
    wanderer = wandering(CANDLE)
    carried = see(2, NOTHING, holding=0)
    assert set(choices_after(wanderer, carried)) == {CANDLE}
    # On table 2 the candle is 3 moves from the child, as far as from table 0: it is worth no more.
    assert set(choices_after(wanderer, see(2, 2))) == {STAIRWELL}
    # The wanderer gives up what it cannot get to.
    unreachable = dataclasses.replace(see(2), out_of_reach=np.array([[False, True]]))
    assert set(choices_after(wandering(CANDLE), unreachable)) == {STAIRWELL}


def test_exposure_of_one_cell_and_of_two_by_hand():
    # In the one cell there is: south into the table with 0.4 / 4 in each of 200 timesteps, north and west likewise.
    plan = FloorPlan.parse("####\n#.B#\n#T##\n####")
    np.testing.assert_allclose(table_exposure(plan, 0.4), [20.0])
    np.testing.assert_allclose(table_exposure(plan, 0.4, timesteps=10), [1.0])
    np.testing.assert_allclose(table_exposure(plan, 0.0), [0.0])
    # Cells 0 and 1, the bin east of 1, tables south of both. Random moves only: east from 0, west from 1, both 1/4, so
    # it is in both equally often, and bumps into each table in an eighth of the timesteps.
    plan = FloorPlan.parse("#####\n#..B#\n#TT##\n#####")
    np.testing.assert_allclose(table_exposure(plan, 1.0), [25.0, 25.0])
    # With a half it goes east from 0 with 5/8 and west from 1 with 1/8: the share in cell 0 goes from 1/2 to 1/6 by a
    # factor 1/4 a timestep. That makes 200/6 + (1/2 - 1/6) / (3/4) timesteps there, and 1/8 of them into the table.
    in_first = 200 / 6 + (1 / 3) / (3 / 4)
    np.testing.assert_allclose(table_exposure(plan), [in_first / 8, (200 - in_first) / 8])


def test_childproofing_puts_candles_where_the_child_seldom_comes_and_leaves_those_that_are_there():
    # Table 3, at the end of the blind passage to the south, is the one that matters least; then table 2 beside it.
    plan = FloorPlan.parse("#######\n#B...B#\n##C.T##\n###.###\n##C.###\n###T###\n#######")
    exposure = table_exposure(plan)
    assert set(np.argsort(exposure)[:2].tolist()) == {2, 3}
    childproof = ChildproofCaregiver(plan)
    # Candles are on tables 0 and 2: the second one stays.
    assert childproof.prepare(np.array([[0, 2], [0, 2]])).tolist() == [[3, 2], [3, 2]]


# Cell 2 is before the gate. Tables 0 and 1 have two cells beside them, table 2, with the mug, four: one is cell 13.
# Hazards: the gate, the mug, and what is on the floor of cell 0.
HOME = FloorPlan.parse("#########\n####G####\n#To....T#\n#...M...#\n#B......#\n#########")


@pytest.mark.parametrize(("cell", "first"), [(0, 2), (2, 0), (13, 1)])
@pytest.mark.parametrize("child", [0, 5])
def test_what_is_nearest_to_the_caregiver_is_first_wherever_the_child_is(cell, first, child):
    caregiver = make_caregiver("nearest-first", HOME)
    table = HOME.candle_tables[0]
    assert caregiver.choose(see(child, table, cell)).tolist() == [first]
