"""Where the robot can do its work, by hand; and that the robot's own navigation agrees, on many generated houses."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from robot_plans import distances_to_obstacles, points_along

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.generator import REACH, generate, is_drivable
from caregiver_mj.plans.routes import yielding
from caregiver_mj.plans.sets import house_set
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.navigation import Navigator

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


def test_the_robot_gets_everywhere_in_the_houses_of_a_set():
    for plan in house_set("test-20"):
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
