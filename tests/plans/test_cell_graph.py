"""Moves and walking distances: worked out by hand, and against searches that know nothing of the package."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts
from walks import STEPS, distances

from caregiver_mj.plans.cell_graph import ACTIONS, UNREACHABLE, Target
from caregiver_mj.plans.floor_plan import FloorPlan

PLANS = plan_texts().map(FloorPlan.parse)


@settings(max_examples=40, deadline=None)
@given(PLANS)
def test_moves_are_what_the_plan_shows(plan):
    kinds = {".": Target.FREE, "#": Target.WALL, "S": Target.STAIRWELL, "C": Target.TABLE, "T": Target.TABLE,
             "B": Target.BIN}  # fmt: skip
    objects = {Target.STAIRWELL: plan.stairwells, Target.TABLE: plan.tables, Target.BIN: plan.bins}
    next_cell, target, index = plan.graph.moves
    assert tuple(STEPS.values()) == ACTIONS
    for i, (row, column) in enumerate(plan.free_cells):
        for action, (down, right) in enumerate(STEPS.values()):
            there = row + down, column + right
            kind = kinds[plan[there]]
            assert target[i, action] == kind
            assert plan.free_cells[next_cell[i, action]] == (there if kind == Target.FREE else (row, column))
            assert index[i, action] == (objects[kind].index(there) if kind in objects else -1)


@settings(max_examples=40, deadline=None)
@given(PLANS)
def test_neighbours_are_mutual_and_one_step_away(plan):
    for cell, around in enumerate(plan.graph.neighbours):
        row, column = plan.caregiver_cells[cell]
        wanted = [(row + down, column + right) for down, right in STEPS.values()]
        assert [plan.caregiver_cells[other] for other in around] == [c for c in wanted if plan[c] in ".S"]
        assert all(cell in plan.graph.neighbours[other] for other in around)


def test_beside_an_object_are_free_cells_in_the_order_of_the_actions():
    plan = FloorPlan.parse("#####\n#.C.#\n#...#\n#TB.#\n#####")
    cells = [[plan.free_cells[cell] for cell in around] for around in plan.graph.beside([*plan.tables, *plan.bins])]
    # Of C at (1, 2): east, south, west. Of T at (3, 1): north. Of B at (3, 2): north, east.
    assert cells == [[(1, 3), (2, 2), (1, 1)], [(2, 1)], [(2, 2), (3, 3)]]


@settings(max_examples=25, deadline=None)
@given(PLANS)
def test_walking_distances_are_those_of_a_search_symmetric_and_obey_the_triangle(plan):
    cells = plan.caregiver_cells
    distance = plan.graph.distances_from(range(len(cells)))
    assert (distance == distance.T).all()
    for i in range(0, len(cells), 7):
        moves = distances(set(cells), cells[i])
        assert distance[i].tolist() == [moves[cell] for cell in cells]
        through = distance[:, i, None].astype(int) + distance[i]
        assert (distance <= through).all()


@settings(max_examples=25, deadline=None)
@given(PLANS, st.data())
def test_distances_round_closed_cells_and_to_the_nearest_of_a_group(plan, data):
    cells = plan.caregiver_cells
    indices = st.integers(0, len(cells) - 1)
    closed = data.draw(st.lists(indices, max_size=4, unique=True))
    group = data.draw(st.lists(indices, min_size=1, max_size=4))
    distance = plan.graph.distances_from([group], closed)[0]
    open_cells = set(cells) - {cells[i] for i in closed}
    searches = [distances(open_cells, cells[goal]) for goal in group if goal not in closed]
    for i, cell in enumerate(cells):
        expected = min((moves.get(cell, UNREACHABLE) for moves in searches), default=UNREACHABLE)
        assert distance[i] == (UNREACHABLE if i in closed else expected)

    part = plan.graph.parts(closed)
    for start in sorted(set(range(len(cells))) - set(closed))[:3]:
        together = distances(open_cells, cells[start])
        assert {cells[i] for i in np.flatnonzero(part == part[start])} == set(together)


@settings(max_examples=30, deadline=None)
@given(PLANS)
def test_bump_distances_and_a_childs_are_those_of_a_search_that_enters_no_landing(plan):
    objects = (*plan.stairwells, *plan.tables, *plan.bins)
    distance = plan.graph.bump_distances(objects)
    assert distance.shape == (len(plan.free_cells), len(objects))
    for j, goal in enumerate(objects):
        moves = distances({*plan.free_cells, goal}, goal)  # the last move is into the object
        assert distance[:, j].tolist() == [moves[cell] for cell in plan.free_cells]
    assert (plan.graph.bin_distances == plan.graph.bump_distances(plan.bins)).all()
    some = range(0, len(plan.free_cells), 5)
    for start, distance in zip(some, plan.graph.child_distances_from(some), strict=True):
        moves = distances(set(plan.free_cells), plan.free_cells[start])
        assert distance.tolist() == [moves[cell] for cell in plan.free_cells]


def test_many_goals_are_worked_out_in_parts_with_the_same_result():
    plan = FloorPlan.load("house-0-60x60")
    goals = range(0, len(plan.caregiver_cells), 3)
    together = plan.graph.distances_from(goals)
    assert len(goals) * len(plan.caregiver_cells) > 2**21  # so that it is in parts
    for row in (0, len(goals) // 2, len(goals) - 1):
        assert (together[row] == plan.graph.distances_from([goals[row]])[0]).all()


@settings(max_examples=25, deadline=None)
@given(PLANS, st.data())
def test_a_search_finds_shortest_ways_nearest_cells_first(plan, data):
    cells = plan.caregiver_cells
    start = data.draw(st.integers(0, len(cells) - 1))
    closed = set(data.draw(st.lists(st.integers(0, len(cells) - 1), max_size=4)))
    before = plan.graph.breadth_first(start, closed)
    moves = distances(set(cells) - {cells[i] for i in closed} | {cells[start]}, cells[start])
    assert {cells[i] for i in before} == set(moves)
    order = [moves[cells[i]] for i in before]
    assert order == sorted(order)
    for cell, previous in before.items():
        assert moves[cells[cell]] == moves[cells[previous]] + (cell != start)


def test_downhill_leads_to_the_lowest_neighbour_or_stays():
    plan = FloorPlan.parse("#####\n#B..#\n#..T#\n#####")
    height = np.array([3, 1, 5, 3])  # cells (1, 2), (1, 3), (2, 1), (2, 2)
    assert plan.graph.downhill(height).tolist() == [1, 1, 3, 3]
    assert plan.graph.downhill(np.stack([height, -height])).tolist() == [[1, 1, 3, 3], [0, 0, 2, 2]]
