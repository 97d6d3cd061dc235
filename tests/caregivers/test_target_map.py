"""What policies that learn see of a house: planes of a map, and nodes and edges of a graph."""

import dataclasses

import numpy as np
import pytest
from worlds import begun

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.target_observation import Encoder
from caregiver_mj.envs.target_grid import TargetGrid
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.hazards import NOTHING, State

# The stairs behind the gate go down to the north, so that it is entered from the south; to the west it is fenced.
HOUSE = FloorPlan.parse("#######\n#B.C.G#\n#o....#\n#..S.T#\n#######", "all")
SLOTS = (3, 2, 2)


def grid(observation, seed=0, family="1", **options):
    made = TargetGrid(HOUSE, family, observation=observation, slots=SLOTS, **options)
    made.begin([seed, seed + 1])
    return made


def look(made):
    return made.encoder.look(made.percept())[0]


def planes(made):
    """Of the first world, by name, the value in each cell that has one."""
    drawn = look(made)["map"][0]
    cells = [{tuple(cell): plane[tuple(cell)].item() for cell in np.argwhere(plane).tolist()} for plane in drawn]
    return dict(zip(made.encoder.map.planes, cells, strict=True))


def test_everything_is_where_the_plan_has_it():
    made = grid("map", shape=(6, 9))
    assert look(made)["map"].shape == (2, len(made.encoder.map.planes), 6, 9)
    drawn = planes(made)
    assert set(drawn["floor"]) == {(1, 2), (1, 4), (2, 1), (2, 2), (2, 3), (2, 4), (2, 5), (3, 1), (3, 2), (3, 4)}
    assert set(drawn["opening"]) == {(1, 5), (3, 3)}
    assert set(drawn["way_in"]) == {(2, 5)}
    assert set(drawn["table"]) == {(1, 3), (3, 5)}
    assert set(drawn["bin"]) == {(1, 1)}
    damage = {"stairwell": {(3, 3): 1.0}, "gate": {(1, 5): 1.0}, "candle": {(1, 3): 0.8}, "table": {(3, 5): 0.2}}
    for kind, wanted in {**damage, "battery": {(2, 1): 1.0}, "mug": {}}.items():
        assert drawn[f"{kind}_damage"] == pytest.approx(wanted)
    places = [(3, 3), (1, 5), None, (1, 3), None, (2, 1), None]
    assert [list(drawn[f"action_{i}"]) for i in range(1, 8)] == [[place] if place else [] for place in places]
    cells = HOUSE.caregiver_cells
    assert list(drawn["child_1"]) == [cells[made.world.child_cell[0, 0]]]
    assert list(drawn["caregiver"]) == [cells[made.world.caregiver_cell[0]]]


def test_what_is_dangerous_no_more_is_gone_from_the_map():
    made = grid("map")
    world = made.world
    world.state[0, [1, 3]] = State.SHUT, State.GONE
    world.candle_table[0, 0] = 1  # that in (3, 5)
    drawn = planes(made)
    assert (drawn["gate_damage"], drawn["action_2"], drawn["battery_damage"], drawn["action_6"]) == ({}, {}, {}, {})
    assert (1, 5) in drawn["opening"]
    assert (list(drawn["candle_damage"]), list(drawn["action_4"])) == ([(3, 5)], [(3, 5)])
    assert list(drawn["table_damage"]) == [(1, 3)]
    world.candle_table[0, 0], world.holding[0] = NOTHING, 0
    drawn = planes(made)
    assert (drawn["candle_damage"], drawn["action_4"]) == ({}, {})
    assert list(drawn["table_damage"]) == [(1, 3), (3, 5)]
    assert look(made)["holding"][0].tolist() == [0, 0, 0, 1, 0, 0, 0]


def test_a_candle_on_the_floor_is_where_it_lies():
    made = grid("map")
    made.world.candle_table[0, 0] = NOTHING
    floor = HOUSE.cell_index[2, 4]
    percept = dataclasses.replace(made.percept(), candle_cell=np.array([[floor], [NOTHING]]))
    candles = made.encoder.look(percept)[0]["map"][:, made.encoder.map.planes.index("candle_damage")]
    assert np.argwhere(candles).tolist() == [[0, 2, 4], [1, 1, 3]]


def test_the_trace_fades_and_begins_anew_with_an_episode():
    made = grid("map", family="1,.25")
    been = [made.world.previous_cell[0], made.world.child_cell[0]]
    for _ in range(11):
        made.act(np.zeros(2, int))
        been.append(made.world.child_cell[0])
    drawn = planes(made)
    for child in range(2):
        wanted = {HOUSE.free_cells[cells[child]]: 1 - age / 8 for age, cells in reversed([*enumerate(been[-2:-10:-1])])}
        assert drawn[f"trace_{child + 1}"] == wanted
        assert len(wanted) > 1
    made.begin([5, 6])
    assert set(planes(made)["trace_1"].values()) == {1.0}


def test_the_graph_has_the_same_and_where_moves_lead():
    drawn, seen = look(grid("map"))["map"], look(grid("graph"))
    places = [(row, column) for row in range(1, 4) for column in range(1, 6)]  # no wall within
    for number, (row, column) in enumerate(places):
        np.testing.assert_array_equal(seen["nodes"][:, number], drawn[:, :, row, column])
    assert seen["node_mask"].all()
    (begins, ends) = seen["edges"][1]
    assert begins.tolist() == [node for node in range(15) for _ in range(4)]
    north, east, south, west = range(4)
    leads = {(3, east): 3, (3, west): 2, (3, south): 8, (9, north): 4, (4, south): 9, (4, west): 4}
    leads |= {(2, east): 3, (0, south): 5, (0, north): 0, (12, south): 12, (14, west): 13, (14, north): 9}
    assert {key: ends[4 * key[0] + key[1]] for key in leads} == leads


def test_a_larger_graph_has_nodes_that_are_not_there():
    seen = look(grid("graph", shape=(6, 9)))
    assert seen["node_mask"][0].tolist() == [1] * 15 + [0] * 13
    assert not seen["nodes"][:, 15:].any()
    np.testing.assert_array_equal(*seen["edges"][0, :, 60:])
    np.testing.assert_array_equal(seen["edges"][0, :, :60], look(grid("graph"))["edges"][0])


def test_of_a_child_that_is_not_seen_it_has_what_is_believed():
    caregiver = CommandedCaregiver(FloorPlan.load("paper"))
    world = begun(GridWorld(caregiver.plan, "1", caregiver, sight="walls"), 20)
    world.step()
    encoder = Encoder(caregiver, 1, "map")
    child = encoder.look(world.percept())[0]["map"][:, encoder.map.planes.index("child_1")].reshape(20, -1)
    np.testing.assert_allclose(child.sum(axis=1), 1, rtol=1e-5)
    seen = world.eyes.tracker.seen[:, 0]
    assert not seen.all()
    assert child[seen].max(axis=1) == pytest.approx(1)
    assert (child[~seen].max(axis=1) < 0.99).any()
