"""Routes from cell to cell, and where the robot is in nobody's way, beside searches of these tests' own."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st
from robot_plans import journeys
from walks import distances, neighbours

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.navigation import Routes


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


def test_a_landing_is_no_thoroughfare_but_can_be_a_goal_and_a_start():
    routes = Routes(FloorPlan.parse("#######\n#BT.S.#\n#.....#\n#######"))
    assert routes.route((1, 3), (1, 5)) == [(1, 3), (2, 3), (2, 4), (2, 5), (1, 5)]
    assert routes.route((1, 3), (1, 4)) == [(1, 3), (1, 4)]
    assert routes.route((1, 4), (1, 5)) == [(1, 4), (1, 5)]


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
