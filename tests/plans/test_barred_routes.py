"""Where children bar the caregiver's only way it keeps a free cell between itself and them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import STAY, Routes

# Cells 0 to 7 from west to east, the landing, cell 8, at the eastern end.
HALL = FloorPlan.parse("###########\n#B.......S#\n###########")
LANDING = 7


def test_behind_a_child_in_a_hall_there_is_a_free_cell():
    routes = Routes(HALL, [[LANDING]])
    distance, next_cell = routes.around(4)
    assert distance[0, :4].tolist() == [UNREACHABLE] * 4
    assert next_cell[0, :4].tolist() == [1, 2, 2, 2]  # from 3, beside the child, it goes back
    assert distance[0, 5:].tolist() == [2, 1, 0]
    assert next_cell[0, 5:].tolist() == [6, 7, 7]


def test_one_that_does_not_yield_stays_where_its_way_is_barred():
    routes = Routes(HALL, [[LANDING]])
    child, here = np.full((3, 1), 4), np.array([3, 1, 5])
    assert routes.towards(np.zeros(3, int), child, here, yields=False)[1].tolist() == [3, 1, 6]


def test_who_stays_is_there():
    routes = Routes(HALL, [[LANDING]])
    distance, next_cell = routes.towards(np.array([STAY]), np.array([[4]]), np.array([3]))
    assert (distance.tolist(), next_cell.tolist()) == ([0], [3])


@settings(deadline=None, max_examples=60)
@given(plan_texts(largest=12), st.lists(st.integers(0, 10_000), min_size=1, max_size=3))
def test_no_child_is_denied_a_move_by_a_caregiver_that_comes_into_its_way_while_its_own_is_barred(text, children):
    plan = FloorPlan.parse(text)
    graph, cells = plan.graph, len(plan.caregiver_cells)
    children = [number % len(plan.free_cells) for number in children]
    places = [[plan.cell_index[cell]] for cell in plan.stairwells] + graph.beside(plan.tables)
    routes, near = Routes(plan, places), graph.distances_from([children])[0]
    here = np.delete(np.arange(cells), children)
    for place in range(len(places)):
        distance, after = routes.towards(np.full(len(here), place), np.tile(children, (len(here), 1)), here)
        comes_beside = (near[after] <= 1) & (near[here] > 1)
        assert not (comes_beside & (distance == UNREACHABLE)).any()
