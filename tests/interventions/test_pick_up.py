"""What lies on the floor: a child takes it once, a caregiver picks it up, and what foresight makes of that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plans_with_things
from worlds import ran, streams

from caregiver_mj.caregivers.foresight.value_table import Objective, ValueTable
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.grid.world import BareTablesWorld, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import State

HOUSE = FloorPlan.parse("###########\n#G..o....B#\n#.........#\n#C...o...S#\n#...T...o.#\n###########", "things")
CORRIDOR = FloorPlan.parse("##########\n#B..o....#\n##########", "corridor")
SMALL = (
    FloorPlan.parse("########\n#.o...S#\n#......#\n#S...o.#\n#..B...#\n########"),
    FloorPlan.parse("########\n#B.o.#S#\n#......#\n#o..#.o#\n#...C.T#\n########"),
    FloorPlan.parse("#######\n#S...B#\n##.#.##\n#o...o#\n##.#.##\n#B...S#\n#######"),
)


def gone(world):
    return world.plan.hazards.split(world.state)[2] == State.GONE


def test_its_cell_is_free_and_it_comes_last_among_hazards():
    assert [hazard.label for hazard in HOUSE.hazards] == ["S1", "G1", "C1", "o1", "o2", "o3"]
    assert [HOUSE.free_cells[cell] for cell in HOUSE.floor_cells] == [(1, 4), (3, 5), (4, 8)]
    assert set(HOUSE.free_cells) == set(HOUSE.cells_of(".", "o"))
    assert CORRIDOR.graph.floor_distances[:, 0].tolist() == [2, 1, 1, 1, 2, 3, 4]
    assert not set(HOUSE.floor_cells) & set(HOUSE.starts.tolist())


@pytest.mark.parametrize("name", ["random", "wanderer", "nearest-first", "childproof", "expected-danger", "foresight"])
def test_caregivers_pick_up_for_good(name):
    world, alone = ran(name, HOUSE, "0.75"), ran("none", HOUSE, "0.75")
    assert gone(world).mean() > 0.9
    totals = world.ledger.totals()
    assert totals["damage_battery"].sum() < 0.5 * alone.ledger.totals()["damage_battery"].sum()
    assert (totals["damage_battery"] / 5 <= gone(world).sum(axis=1)).all()
    assert (totals["interventions_done"] <= totals["interventions"]).all()


@settings(max_examples=10, deadline=None)
@given(plans_with_things(largest=9), st.sampled_from(["none", "nearest", "foresight", "childproof", "wanderer"]))
def test_in_any_plan_each_is_taken_once_and_none_comes_back(plan_text, name):
    plan = FloorPlan.parse(plan_text)
    world = GridWorld(plan, "1,0.5", None if name == "none" else make_caregiver(name, plan, 0))
    world.reset(streams(4, 60, children=2))
    assert not np.isin(world.child_cell, plan.floor_cells).any()
    assert not np.isin(world.caregiver_cell, plan.floor_cells).any()
    for _ in range(60):
        before, harm = gone(world), world.ledger.totals()["damage_battery"]
        world.step()
        now, more = gone(world), world.ledger.totals()["damage_battery"] - harm
        assert (now >= before).all()
        assert (more / 5 <= (now & ~before).sum(axis=1)).all()
        if name == "none":
            assert (more / 5 == (now & ~before).sum(axis=1)).all()
    bare = BareTablesWorld(plan, "1").run(streams(4, 60)).totals()
    assert (bare["damage"] == bare["damage_table"]).all()


def test_what_comes_of_going_there_by_hand():
    discount = 0.9
    values = ValueTable(CORRIDOR, objective=Objective(discount, price=0.0, random_price=0.0, tolerance=1e-6))
    cell, cells = CORRIDOR.cell_index, len(CORRIDOR.caregiver_cells)
    at_random = 4  # the novice of epsilon 1: moves east and west with 1/4 each, and stays with 1/2
    assert (values.value == 0).all()  # there is nothing else to be hurt by, and nothing is denied for a price

    def going(child, caregiver):
        return values.going[0][0, cell[1, child] * cells + cell[1, caregiver], at_random]

    assert going(3, 6) == pytest.approx(5 / 4)  # it has it before the child's second move
    assert going(2, 6) == 0
    assert going(3, 8) == pytest.approx(5 * (1 / 4 + discount * 1 / 2 * 1 / 4))  # before its third one
    assert going(2, 8) == pytest.approx(5 * discount * 1 / 4 * 1 / 4)
    assert going(3, 4) == 0  # it stands there, and the child cannot
    near, far = (values.taken[cell[1, child], 0, at_random] for child in (3, 2))
    assert far == pytest.approx(discount * (3 * far + near) / 4)
    assert near == pytest.approx(5 / 4 + discount * (2 * near + far) / 4)


def test_it_leaves_less_than_the_rule():
    who = ("none", "expected-danger", "foresight")
    none, rule, foresight = (sum(ran(name, plan, "0.5", 10).ledger.damage.sum() for plan in SMALL) for name in who)
    assert foresight < 0.9 * rule < 0.5 * none
