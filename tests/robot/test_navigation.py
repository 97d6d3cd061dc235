"""The robot's routes beside searches of these tests' own, and its paths beside the exact shapes in the way."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_plans import centre, distances_to_obstacles, journeys, points_along
from walks import distances, neighbours

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.navigation import Navigator, Routes

ROBOT = find_embodiment()
BASE_RADIUS, CHILD_RADIUS = 0.27, 0.12  # metres
CLEARANCE = 0.05  # metres from the base to all else on a path; the plan is for 0.07, on a raster of 0.025
CHILD_CLEARANCE = 0.20 - 0.02
TOUCHING = BASE_RADIUS + CHILD_RADIUS

#: The landing lies in the corner of the way from the bin to the table.
BEND = FloorPlan.parse("######\n#B...#\n#..S.#\n#....#\n##.T##\n######", "bend")
#: A bin beside the landing.
BESIDE_STAIRS = FloorPlan.parse("########\n#......#\n#....BS#\n#.T....#\n########", "beside_stairs")


def cells_of(plan: FloorPlan, points: np.ndarray) -> set[tuple[int, int]]:
    return {plan.cell_at(point) for point in points}


def path_between(navigator: Navigator, start, goal, children=(), closed=()):
    plan = navigator.plan
    return navigator.path(centre(plan, start), centre(plan, goal), goal, children, closed)


@settings(max_examples=40, deadline=None)
@given(journey=journeys(landings=False), jitter=st.tuples(*[st.floats(-0.08, 0.08)] * 2))
def test_paths_end_where_asked_and_keep_clear_of_everything(journey, jitter):
    plan, start_cell, goal_cell = journey
    x, y = centre(plan, start_cell)
    start, goal = (x + jitter[0], y + jitter[1]), centre(plan, goal_cell)
    path = Navigator(plan, ROBOT).path(start, goal, goal_cell)
    if path is None:  # only if landings are in the way
        assert goal_cell not in distances(set(plan.free_cells), start_cell)
        return
    assert path[0] == start
    assert path[-1] == goal
    distance = distances_to_obstacles(plan, points_along(path))
    assert distance.min() > min(BASE_RADIUS + CLEARANCE, distance[0] - 0.03)


@settings(max_examples=40, deadline=None)
@given(journey=journeys(), data=st.data())
def test_paths_give_every_child_a_wide_berth(journey, data):
    plan, start, goal = journey
    others = [cell for cell in plan.free_cells if cell not in (start, goal)]
    if not others:
        return
    cells = data.draw(st.lists(st.sampled_from(others), min_size=1, max_size=4, unique=True))
    children = [centre(plan, cell) for cell in cells]
    navigator = Navigator(plan, ROBOT)
    path = path_between(navigator, start, goal, children, set(cells))
    assert path == path_between(navigator, start, goal, children[::-1], set(cells))
    if path is None:
        return
    points = points_along(path)
    assert not set(cells) & cells_of(plan, points)
    for child in children:
        assert np.hypot(*(points - child).T).min() > BASE_RADIUS + CHILD_RADIUS + CHILD_CLEARANCE


WEDGED = FloorPlan.parse("#######\n#.....#\n#..TB.#\n#.....#\n#######", "wedged")


def test_a_way_out_is_found_between_child_and_table():
    navigator = Navigator(WEDGED, ROBOT)
    x, y = WEDGED.position((2, 2))
    start = (x + 0.06, y)
    child = (start[0] - TOUCHING, y)
    goal = centre(WEDGED, (1, 3))
    # The cell's centre, by which all ways lead round the table, is nearer to the child than the base is now.
    path = navigator.path(start, goal, (1, 3), [child], {(2, 2)})
    assert path is not None
    assert path[0] == start
    assert path[-1] == goal
    distances = [
        math.dist(np.array(a) + share * (np.array(b) - a), child)
        for a, b in itertools.pairwise(path)
        for share in np.linspace(0, 1, 20)
    ]
    assert min(distances) >= TOUCHING - 1e-6
    assert distances[19] > TOUCHING + 0.05


#: A passage with a landing beside it, and a toy bin at either end. The landing is in nobody's way.
NICHE = FloorPlan.parse("###########\n#B.......B#\n####S######\n###########", "niche")


def test_with_a_candle_it_makes_room_on_no_landing():
    empty = Navigator(NICHE, ROBOT)
    children = [(1, 2)]
    assert empty.refuge((1, 5), children, set(children)) == NICHE.stairwells[0]
    refuge = empty.loaded.refuge((1, 5), children, set(children))
    assert refuge in NICHE.free_cells
    assert empty.loaded.clearance is empty.clearance


@pytest.mark.parametrize("plan", [NICHE, BEND, BESIDE_STAIRS])
def test_with_a_candle_its_paths_cross_no_landing_and_leave_one_by_the_shortest_way(plan):
    navigator = Navigator(plan, ROBOT)
    landing = plan.stairwells[0]
    for start, goal in itertools.permutations(plan.free_cells, 2):
        path = path_between(navigator.loaded, start, goal)
        assert path is None or landing not in cells_of(plan, points_along(path))
    x, y = centre(plan, landing)
    for aside in (0.1, -0.1):
        start = (x + aside, y)
        for goal in plan.free_cells:
            path = navigator.loaded.path(start, centre(plan, goal), goal)
            inside = [plan.cell_at(point) == landing for point in points_along(path)]
            assert inside == sorted(inside, reverse=True)  # out of it, and not into it again


@settings(max_examples=40, deadline=None)
@given(journey=journeys(), data=st.data())
def test_routes_avoid_closed_cells_and_landings(journey, data):
    plan, start, goal = journey
    closed = set(data.draw(st.lists(st.sampled_from(plan.caregiver_cells), max_size=6))) - {start}
    route = Routes(plan).route(start, goal, closed)
    forbidden = (closed | set(plan.stairwells)) - {start, goal} | (closed & {goal})
    moves = distances(set(plan.caregiver_cells) - forbidden | {start}, start)
    assert (route is not None) == (goal in moves)
    if route is None:
        return
    assert (route[0], route[-1]) == (start, goal)
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in itertools.pairwise(route))
    assert not forbidden & set(route)
    assert set(route) <= set(plan.caregiver_cells)
    assert len(route) == moves[goal] + 1


def in_the_way(plan: FloorPlan, child, cell) -> int:
    """To how many toy bins a shortest way of a child leads over a cell."""
    free = set(plan.free_cells)
    moves = distances(free, child)
    if cell not in moves:
        return 0
    count = 0
    for toys in plan.bins:
        to_bin = {end: steps for end in free & set(neighbours(toys)) for steps in [distances(free, end)]}
        shortest = min(moves[end] for end in to_bin)
        count += any(moves[cell] + steps[cell] == shortest for steps in to_bin.values())
    return count


def exposed(plan, cell):
    """Whether a child that has come up to somebody in a cell can stand beside stairs or a table."""
    dangers = set(plan.stairwells) | set(plan.tables)
    beside = [free for free in neighbours(cell) if free in plan.free_cells]
    return any(set(neighbours(free)) & dangers - {cell} for free in beside)


@settings(max_examples=40, deadline=None)
@given(journey=journeys(), data=st.data())
def test_a_refuge_is_the_nearest_cell_least_in_all_childrens_way_and_away_from_hazards(journey, data):
    plan, start, _ = journey
    children = data.draw(st.lists(st.sampled_from(plan.free_cells), min_size=1, max_size=3))
    closed = set(children)
    refuge = Routes(plan).refuge(start, children, closed)
    moves = distances(set(plan.caregiver_cells) - closed | {start}, start)
    cost = {
        cell: (sum(in_the_way(plan, child, cell) for child in children), exposed(plan, cell), moves[cell])
        for cell in moves
    }
    assert cost[refuge] == min(cost.values())


def test_who_is_followed_does_not_go_where_it_is_shut_in():
    plan = FloorPlan.parse("########\n#.....##\n#.#.####\n#...####\n#B######\n########", "ring")
    routes, child = Routes(plan), (1, 2)
    assert routes.refuge((1, 3), [child], {child}) == (1, 3)
    assert routes.refuge((1, 3), [child], {child}, in_vain=[(1, 3)]) == (1, 4)  # chance, perhaps
    assert routes.refuge((1, 3), [child], {child}, in_vain=[(1, 3), (1, 2)]) == (2, 3)
    assert routes.refuge((1, 4), [child], {child}, in_vain=[(1, 4), (1, 2)]) == (1, 3)  # and not (1, 5)
