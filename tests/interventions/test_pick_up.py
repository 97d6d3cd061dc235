"""What lies on the floor: a child takes it once, a caregiver picks it up, and what foresight makes of that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plans_with_things
from test_close import streams

from caregiver_mj.caregivers import Caregiver
from caregiver_mj.caregivers.foresight import value_table
from caregiver_mj.caregivers.foresight.value_table import Objective, ValueTable
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.caregivers.target_map import Slots
from caregiver_mj.caregivers.target_observation import Encoder
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.errors import CaregiverError, FloorPlanError
from caregiver_mj.grid.world import BareTablesWorld, GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import State
from caregiver_mj.viz.hud.display import draw_plan
from caregiver_mj.viz.moment import grid_state

HOUSE = FloorPlan.parse("###########\n#G..o....B#\n#.........#\n#C...o...S#\n#...T...o.#\n###########", "things")
CORRIDOR = FloorPlan.parse("##########\n#B..o....#\n##########", "corridor")
SMALL = [
    FloorPlan.parse(text)
    for text in (
        "########\n#.o...S#\n#......#\n#S...o.#\n#..B...#\n########",
        "########\n#B.o.#S#\n#......#\n#o..#.o#\n#...C.T#\n########",
        "#######\n#S...B#\n##.#.##\n#o...o#\n##.#.##\n#B...S#\n#######",
    )
]
EAST, WEST = 1, 3


def ran(name, plan=HOUSE, epsilon="0.75", episodes=30):
    world = GridWorld(plan, epsilon, None if name == "none" else make_caregiver(name, plan, 0))
    world.run(streams(episodes))
    return world


def gone(world):
    return world.plan.hazards.split(world.state)[2] == State.GONE


# -- The plan ------------------------------------------------------------------------------------


def test_its_cell_is_free_and_it_comes_last_among_hazards():
    assert [hazard.label for hazard in HOUSE.hazards] == ["S1", "G1", "C1", "o1", "o2", "o3"]
    assert [HOUSE.free_cells[cell] for cell in HOUSE.floor_cells] == [(1, 4), (3, 5), (4, 8)]
    assert set(HOUSE.free_cells) == set(HOUSE.cells_of(".", "o"))
    assert CORRIDOR.graph.floor_distances[:, 0].tolist() == [2, 1, 1, 1, 2, 3, 4]
    assert not set(HOUSE.floor_cells) & set(HOUSE.starts.tolist())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("####\n#oB#\n####", "the plan has no free cell"),
        ("#####\n#.B##\n###o#\n#####", r"line 3, column 4: this free cell is not connected"),
    ],
)
def test_a_plan_is_refused_where_there_is_no_other_cell_or_no_way(text, words):
    with pytest.raises(FloorPlanError, match=words):
        FloorPlan.parse(text)


# -- The grid ------------------------------------------------------------------------------------


def walk(moves, caregiver=None, caregiver_cell=None):
    """What a child that makes some moves in the corridor has come to, and whether the battery is gone, after each."""
    steps = np.array([[0.0, (move + 0.5) / 4, 0.0] for move in moves])
    world = GridWorld(CORRIDOR, 1.0, caregiver)
    world.reset([[RandomStream(np.zeros(3), steps)]])
    world.child_cell[:] = CORRIDOR.cell_index[1, 3]
    if caregiver_cell:
        world.caregiver_cell[:] = CORRIDOR.cell_index[caregiver_cell]
    found = []
    for _ in moves:
        world.step()
        found.append((world.ledger.totals()["damage_battery"].item(), gone(world).item()))
    assert world.ledger.totals()["damage"] == world.ledger.totals()["damage_battery"]
    return found


def test_a_child_takes_it_once_by_hand():
    assert walk([WEST, EAST, EAST, WEST, EAST]) == [(0, False), (0, False), (5, True), (5, True), (5, True)]


def test_a_caregiver_that_stands_there_keeps_it_and_needs_an_action_more_to_have_it():
    class Waits(Caregiver):
        def choose(self, percept):
            return np.full(len(percept.child_cell), -1)

        idle_verb = "nothing"

    class Fetches(Waits):
        def choose(self, percept):
            return np.zeros(len(percept.child_cell), int)

    assert walk([EAST, EAST], Waits(CORRIDOR), (1, 4)) == [(0, False), (0, False)]
    assert walk([WEST], Fetches(CORRIDOR), (1, 6)) == [(0, True)]  # two moves, and an action
    assert walk([WEST, WEST], Fetches(CORRIDOR), (1, 7)) == [(0, False), (0, True)]
    assert walk([EAST, WEST], Fetches(CORRIDOR), (1, 8)) == [(5, True), (5, True)]


@pytest.mark.parametrize("name", ["random", "wanderer", "nearest", "childproof", "expected-danger", "foresight"])
def test_caregivers_pick_up_for_good(name):
    world, alone = ran(name), ran("none")
    assert gone(world).mean() > 0.9
    totals = world.ledger.totals()
    assert totals["damage_battery"].sum() < 0.5 * alone.ledger.totals()["damage_battery"].sum()
    assert (totals["damage_battery"] / 5 <= gone(world).sum(axis=1)).all()
    assert (totals["interventions_done"] <= totals["interventions"]).all()


def test_childproof_closes_gates_and_picks_up_all_there_is():
    world = GridWorld(HOUSE, "0.05", make_caregiver("childproof", HOUSE))
    world.reset(streams(20))
    for _ in range(60):
        world.step()
    assert gone(world).all()
    assert (world.state[:, 1] == State.SHUT).all()


@settings(max_examples=10, deadline=None)
@given(plans_with_things(largest=9), st.sampled_from(["none", "nearest", "foresight", "childproof", "wanderer"]))
def test_in_any_plan_each_is_taken_once_and_none_comes_back(plan_text, name):
    plan = FloorPlan.parse(plan_text)
    world = GridWorld(plan, "1,0.5", None if name == "none" else make_caregiver(name, plan, 0))
    world.reset([RandomStream.draw_group(np.random.RandomState(seed), 2, 60) for seed in range(4)])
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


# -- Foresight -----------------------------------------------------------------------------------


@pytest.mark.parametrize("plan", SMALL)
def test_what_has_settled_is_not_swept_again_and_what_has_not_is(plan, monkeypatch):
    found = ValueTable(plan)
    monkeypatch.setattr(value_table, "_STILL", -1.0)  # nothing counts as settled
    for going, whole in zip(found.going, ValueTable(plan).going, strict=True):
        assert np.abs(going - whole).max() < 0.005


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
    sums = {
        name: sum(ran(name, plan, "0.5", 60).ledger.damage.sum() for plan in SMALL)
        for name in ("none", "expected-danger", "foresight")
    }
    assert sums["foresight"] < 0.9 * sums["expected-danger"] < 0.5 * sums["none"]


# -- Whoever looks on, and learners --------------------------------------------------------------


def test_it_is_drawn_until_it_is_gone():
    world = GridWorld(HOUSE, "1", None)
    world.reset(streams(1))
    colour = HOUSE.hazards[5].kind.colour

    def drawn():
        return (draw_plan(grid_state(world, "1"), 400, 300).reshape(-1, 3) == colour).all(axis=1).sum()

    all_three = drawn()
    world.state[0, 3] = State.GONE
    assert 0 < drawn() < all_three
    world.state[0, 3:] = State.GONE
    assert drawn() == 0


def test_targets_have_places_for_it():
    with pytest.raises(CaregiverError, match=r"slots must be at least \(2, 1, 3\) for house 'things', got \(4, 6\)"):
        Slots(HOUSE, (4, 6))
    caregiver = CommandedCaregiver(HOUSE)
    world = GridWorld(HOUSE, "1", caregiver)
    world.reset(streams(1))
    encoder = Encoder(caregiver, 1, slots=(3, 2, 4))
    world.state[0, 4] = State.GONE
    percept = world.percept()
    mask = encoder.mask(percept)
    assert mask.tolist() == [[1, 1, 1, 0, mask[0, 4], 0, 1, 0, 1, 0]]
    nearness = encoder.look(percept)[0]["hazard_nearness_to_child"][0, 0]
    assert nearness[5] > 0
    assert nearness[6] == 0
    assert encoder.slots.targets([8], 1).tolist() == [5]
