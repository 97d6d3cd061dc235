"""Where the caregiver is in a child's way, and where it could be shut in: by hand, and against plain searches."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from walks import distances, neighbours

from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import RouteTables, divisions, yielding

PLANS = plan_texts(largest=12).map(FloorPlan.parse)


@st.composite
def mazes(draw):
    """Plans of narrow ways between the cells of a coarser grid, some of them closed, with things at their ends."""
    seed, rows, columns = draw(st.integers(0, 2**32 - 1)), draw(st.integers(2, 5)), draw(st.integers(2, 5))
    random = np.random.default_rng(seed)
    grid = np.full((2 * rows + 1, 2 * columns + 1), "#")
    grid[1::2, 1::2] = "."
    reached, ends = {(0, 0)}, [(0, 0)]
    while ends:
        here = ends[-1]
        new = [c for c in neighbours(here) if 0 <= c[0] < rows and 0 <= c[1] < columns and c not in reached]
        if not new:
            ends.pop()
            continue
        there = new[random.integers(len(new))]
        grid[here[0] + there[0] + 1, here[1] + there[1] + 1] = "."
        reached.add(there)
        ends.append(there)
    walls = [cell for cell in np.argwhere(grid[1:-1, 1:-1] == "#") + 1 if any(grid[n] == "." for n in neighbours(cell))]
    for kind, cell in zip("BBSB.B.TSB"[: random.integers(1, 11)], random.permutation(walls), strict=False):
        grid[tuple(cell)] = kind
    return FloorPlan.parse("\n".join(map("".join, grid)))


@settings(max_examples=25, deadline=None)
@given(PLANS, st.data())
def test_routes_lead_over_the_cells_of_some_shortest_path(plan, data):
    start = data.draw(st.integers(0, len(plan.free_cells) - 1))
    routes = dict.fromkeys(plan.caregiver_cells, 0)
    for goal in plan.bins:
        for cell in on_shortest_paths(plan, plan.free_cells[start], goal):
            routes[cell] += 1
    assert yielding(plan).routes_over(start).tolist() == list(routes.values())


def on_shortest_paths(plan, start, goal):
    """The free cells on some shortest path to a bin, with how many moves they are away from its start."""
    left = distances({*plan.free_cells, goal}, goal)
    found, layer, moves = {}, {start}, 0
    while layer:
        found |= dict.fromkeys(layer, moves)
        layer = {n for cell in layer for n in neighbours(cell) if left.get(n, 10**6) == left[cell] - 1 and n != goal}
        moves += 1
    return found


def parts_without(plan, cell):
    """The parts of a house that stay connected without a cell."""
    rest, parts = set(plan.caregiver_cells) - {cell}, []
    while rest:
        parts.append(set(distances(rest, min(rest))))
        rest -= parts[-1]
    return parts


def plain_traps(plan):
    traps = set()
    for child in plan.free_cells:
        bars = set()  # cells with no alternative as far away on the way to some bin
        for goal in plan.bins:
            on_path = on_shortest_paths(plan, child, goal)
            bars |= {cell for cell, moves in on_path.items() if list(on_path.values()).count(moves) == 1}
        parts = parts_without(plan, child)
        if len(parts) > 1:
            traps |= {cell for part in parts if part <= bars for cell in part}
    return traps


def traps(plan):
    return {cell for cell, is_trap in zip(plan.caregiver_cells, yielding(plan).traps, strict=True) if is_trap}


@settings(max_examples=60, deadline=None)
@given(st.one_of(PLANS, mazes()))
def test_traps_are_those_of_a_plain_search(plan):
    assert traps(plan) == plain_traps(plan)


@settings(max_examples=60, deadline=None)
@given(st.one_of(PLANS, mazes()))
def test_divisions_are_what_remains_connected_without_a_cell(plan):
    cells = plan.caregiver_cells
    found = {cell: [] for cell in cells}
    order, divided = divisions(plan.graph)
    for by, ranges in divided:
        found[cells[by]].append({cells[i] for part in ranges for i in order[part]})
    for cell, parts in found.items():
        expected = parts_without(plan, cell)
        assert sorted(map(sorted, parts)) == (sorted(map(sorted, expected)) if len(expected) > 1 else [])


# Cells 0 to 7 from west to east, the landing, cell 8, at the eastern end.
HALL = FloorPlan.parse("###########\n#B.......S#\n###########")
LANDING = 7


def test_one_that_does_not_yield_stays_where_its_way_is_barred():
    routes = RouteTables(HALL, [[LANDING]])
    child, here = np.full((3, 1), 4), np.array([3, 1, 5])
    assert routes.towards(np.zeros(3, int), child, here, yields=False)[1].tolist() == [3, 1, 6]


@settings(deadline=None, max_examples=60)
@given(plan_texts(largest=12), st.lists(st.integers(0, 10_000), min_size=1, max_size=3))
def test_no_child_is_denied_a_move_by_a_caregiver_that_comes_into_its_way_while_its_own_is_barred(text, children):
    plan = FloorPlan.parse(text)
    graph, cells = plan.graph, len(plan.caregiver_cells)
    children = [number % len(plan.free_cells) for number in children]
    places = [[plan.cell_index[cell]] for cell in plan.stairwells] + graph.beside(plan.tables)
    routes, near = RouteTables(plan, places), graph.distances_from([children])[0]
    here = np.delete(np.arange(cells), children)
    for place in range(len(places)):
        distance, after = routes.towards(np.full(len(here), place), np.tile(children, (len(here), 1)), here)
        comes_beside = (near[after] <= 1) & (near[here] > 1)
        assert not (comes_beside & (distance == UNREACHABLE)).any()
