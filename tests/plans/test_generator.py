"""Generated houses: valid, as asked for, and such that the robot can work in them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from robot_plans import distances_to_obstacles, points_along
from scipy.sparse import csgraph
from walks import distances, neighbours

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import REACH, SEEDS, Request, design, generate, is_drivable
from caregiver_mj.plans.routes import yielding
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.navigation import Navigator

FIELDS = ("rooms", "stairwells", "candles", "tables", "bins")
SEED = st.integers(0, SEEDS - 1)


@st.composite
def requests(draw):
    """Requests that can be met: some wishes, for no more than there is space for."""
    size = draw(st.tuples(st.integers(10, 22), st.integers(10, 22)))
    area = (size[0] - 2) * (size[1] - 2)
    most = area // 25
    wishes = {field: draw(st.none() | st.integers(0 if field == "candles" else 1, most)) for field in FIELDS}
    return Request(draw(SEED), draw(st.sampled_from([size, None])) if most <= 3 else size, **wishes)


def things(plan):
    return [*plan.stairwells, *plan.tables, *plan.bins]


def counts(plan):
    """What a plan has of each kind of thing, in the order of `FIELDS` after the rooms."""
    candles = len(plan.candle_tables)
    return [len(plan.stairwells), candles, len(plan.tables) - candles, len(plan.bins)]


@settings(max_examples=40, deadline=None)
@given(requests())
def test_a_house_has_what_was_asked_for_and_is_furnished_as_houses_are(request):
    plan, shell = design(request)
    if request.size is not None:
        assert plan.shape == request.size[::-1]
    wishes = [getattr(request, field) for field in FIELDS]
    found = [len(shell.rooms), *counts(plan)]
    assert all(wish in (None, count) for wish, count in zip(wishes, found, strict=True))
    assert counts(plan) == [plan.text.count(kind) for kind in "SCTB"]
    # A child can walk everywhere and reach every thing.
    assert FloorPlan.parse(plan.text, plan.name) == plan
    free = set(plan.free_cells)
    reached = distances(free, plan.free_cells[0])
    assert set(reached) == free
    assert all(reached.keys() & set(neighbours(thing)) for thing in things(plan))
    assert len(plan.hazards) > 0
    assert len(plan.bins) > 0
    # Nothing stands in a doorway or before it, and nothing but stairs in a corridor.
    for gap in shell.doorway_cells:
        assert plan[gap] == "."
        assert all(plan[cell] in "#." for cell in neighbours(gap))
    for room in shell.rooms:
        if room.is_corridor:
            assert set(np.unique(plan.symbols[room.inside])) <= {".", "S"}
    # No thing makes the way from one of its sides to another a long one.
    for row, column in things(plan):
        sides = [cell for cell in neighbours((row, column)) if cell in free]
        block = {(r, c) for r in range(row - 3, row + 4) for c in range(column - 3, column + 4)} & free
        assert set(sides) <= set(distances(block, sides[0]))
    check_rooms(plan, shell)
    assert plan.name == request.name
    assert Request.from_name(plan.name) == request
    again = FloorPlan.load(plan.name, cell_size=0.9)
    assert (again.rows, again.name, again.cell_size) == (plan.rows, plan.name, 0.9)


def check_rooms(plan, shell):
    owner = np.full(plan.shape, -1)
    for i, room in enumerate(shell.rooms):
        assert (owner[room.inside] == -1).all()
        owner[room.inside] = i
    inside = owner >= 0
    for cell in shell.doorway_cells:
        assert not inside[cell]
        inside[cell] = True
    assert ((plan.symbols == "#") == ~inside).all()
    joined = np.eye(len(shell.rooms))
    for doorway in shell.doorways:
        assert len(doorway) in (1, 2)
        one, other = {owner[cell] for gap in doorway for cell in neighbours(gap)} - {-1}
        joined[one, other] = 1
    assert csgraph.connected_components(joined)[0] == 1


@settings(max_examples=40, deadline=None)
@given(requests(), st.sampled_from(FIELDS))
def test_one_wish_does_not_change_what_else_is_drawn(request, field):
    (size, wished), (other_size, free) = request.settled(), dataclasses.replace(request, **{field: None}).settled()
    if field == "tables" and free["candles"] != wished["candles"]:
        assert request.tables == 0
        return
    assert (other_size, free | {field: wished[field]}) == (size, wished)


@pytest.mark.parametrize(
    "name", ["house", "house-", "house-x", "house--1", "house-1-14", "house-1-bins", "house-1-bins2-rooms2", "house-1 "]
)
def test_other_names_are_files(name):
    assert Request.from_name(name) is None
    with pytest.raises(FloorPlanError, match=f"no floor plan '{name}': neither a file nor one of .*house-17"):
        FloorPlan.load(name)


@settings(max_examples=25, deadline=None)
@given(SEED)
def test_a_home_is_a_house_in_which_some_things_are_of_other_kinds(seed):
    home, house = design(Request(seed, home=True))[0], Request(seed).settled()[1]
    assert home.name == f"home-{seed}"
    assert FloorPlan.load(home.name).rows == home.rows
    assert len(home.stairwells) == house["stairwells"]
    assert len(home.candle_tables) == house["candles"]
    assert 1 <= home.text.count("o") <= 3
    assert all(home[cell] == "." for cell in home.mouths.values())


def test_a_home_needs_neither_stairs_nor_candles():
    assert set(FloorPlan.load("home-1-stairwells0-candles0").text) == set("#.oTB\n")


def test_a_house_has_as_many_gates_mugs_and_batteries_as_are_asked_for():
    plan = FloorPlan.load("house-17-14x12-stairwells1-candles1-tables2-gates1-mugs2-batteries3")
    assert [plan.text.count(symbol) for symbol in "SGCMTo"] == [1, 1, 1, 2, 2, 3]
    assert not any(symbol in generate(17).text for symbol in "GMo")


# -- Where the robot can do its work, by hand; and its own navigation agrees ---------------------------------

ROBOT = find_embodiment()
CLEARANCE = 0.05  # metres from the base to all else on a path, as in the tests of navigation


@pytest.mark.parametrize("name", ["paper", "apartment"])
def test_the_houses_of_the_package_are_drivable(name):
    assert is_drivable(FloorPlan.load(name))


@pytest.mark.parametrize(("cell_size", "drivable"), [(0.75, True), (0.60, True), (0.55, False)])
def test_cells_must_be_wide_enough(cell_size, drivable):
    # From the middle of the cell beside the bin to its edge: the cell's size less 0.22 m. 0.34 m are needed.
    assert is_drivable(FloorPlan.parse("#####\n#B..#\n#...#\n#...#\n#####", cell_size=cell_size)) == drivable


def test_a_table_must_be_where_the_child_cannot_shut_the_robot_in():
    # On its way to the bin in the east the child would not let the robot out of the lane at whose end the table is.
    shut = FloorPlan.parse("########\n#..#####\n#......#\n#B.#T#B#\n########")
    assert yielding(shut).traps[shut.cell_index[(2, 4)]]
    assert not is_drivable(shut)
    room = FloorPlan.parse("########\n#......#\n#......#\n#B.#T#B#\n########")
    assert is_drivable(room)


def test_a_house_whose_only_way_is_over_a_landing_is_not_drivable():
    halves = FloorPlan("unchecked", ("#######", "#B.S..#", "#..#.T#", "#######"))  # `parse` would refuse it
    assert not is_drivable(halves)


@settings(max_examples=30, deadline=None)
@given(st.one_of(st.integers(0, 2**32 - 1).map(generate), plan_texts(6, 12).map(FloorPlan.parse)))
def test_the_robot_gets_everywhere_in_a_drivable_house(plan):
    assume(is_drivable(plan))
    check_with_navigator(plan)


def check_with_navigator(plan):
    """Sends the robot from a cell to others, every landing and table, and back, and measures what room it has."""
    navigator = Navigator(plan, ROBOT)
    home = plan.free_cells[0]
    somewhere = {*plan.free_cells[:: len(plan.free_cells) // 8 + 1], *plan.stairwells}
    places = {cell: [tuple(plan.position(cell).tolist())] for cell in plan.caregiver_cells}
    for table in plan.tables:
        stands = []
        for cell in plan.free_neighbours(table):
            middle = plan.position(table)
            stand = tuple((middle + (plan.position(cell) - middle) * REACH / plan.cell_size).tolist())
            if navigator.clearance.can_stand(stand) and navigator.clearance.can_turn(stand):
                stands.append(stand)
                places[cell].append(stand)
        assert stands, (plan.name, table)
    for cell, goals in places.items():
        assert navigator.clearance.can_stand(goals[0])
        for goal in goals if cell in somewhere else goals[1:]:
            for start, end, last in ((places[home][0], goal, cell), (goal, places[home][0], home)):
                path = navigator.path(start, end, last)
                assert path is not None, (plan.name, cell)
                room = distances_to_obstacles(plan, points_along(path)).min()
                assert room > ROBOT.footprint + CLEARANCE, (plan.name, cell)
