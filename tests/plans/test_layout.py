"""Where walls, stairs and furniture lie: shapes worked out by hand, and what must hold in any house."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from random_plans import plan_texts
from scipy import ndimage

from caregiver_mj.plans.cell_graph import WALL
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.layout import Layout

PAPER = FloorPlan.load("paper")
RASTER = 0.05  # metres; finer than any wall


def rows(rectangles: np.ndarray) -> list[list[float]]:
    """Rectangles in an order of their own, to compare with those worked out by hand."""
    return sorted(rectangles.round(9).tolist())


def overlap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Common area of every rectangle in a (n, 4) with every one in b (m, 4), as (n, m)."""
    low = np.maximum((a[:, :2] - a[:, 2:])[:, None], b[:, :2] - b[:, 2:])
    high = np.minimum((a[:, :2] + a[:, 2:])[:, None], b[:, :2] + b[:, 2:])
    return (high - low).clip(0).prod(axis=2)


def area(rectangles: np.ndarray) -> float:
    return 4 * rectangles[:, 2:].prod(axis=1).sum()


def cells(plan: FloorPlan, wall: bool) -> np.ndarray:
    """All cells that are wall, or all that are not, as rectangles (n, 4)."""
    height, width = plan.shape
    wanted = [c for c in itertools.product(range(height), range(width)) if (plan[c] == WALL) == wall]
    return np.array([[*plan.position(c), plan.cell_size / 2, plan.cell_size / 2] for c in wanted])


def test_walls_of_a_small_room_worked_by_hand():
    plan = FloorPlan.parse("####\n#BT#\n#..#\n####", cell_size=1.0)
    # The border's cells are centred at +-1.5 m; walls are 0.25 m thick and meet at the corners.
    north_south = [[0, 1.5, 1.625, 0.125], [0, -1.5, 1.625, 0.125]]
    east_west = [[1.5, 0, 0.125, 1.375], [-1.5, 0, 0.125, 1.375]]
    assert rows(Layout(plan).walls) == sorted(north_south + east_west)
    assert rows(Layout(plan).tables) == [[0.5, 0.5, 0.27, 0.27]]
    assert rows(Layout(plan).bins) == [[-0.5, 0.5, 0.22, 0.22]]
    assert rows(Layout(plan).floor) == [[0, 0, 1.625, 1.625]]


def test_inner_walls_worked_by_hand():
    plan = FloorPlan.parse("######\n#BT..#\n#.#..#\n#...##\n######", cell_size=1.0)
    walls = Layout(plan).walls
    assert [-0.5, 0, 0.125, 0.125] in rows(walls)  # a pillar
    # The wall cell in the corner joins the walls to its east and south, and fills what lies between them.
    assert overlap(walls, np.array([[2.0, -1.5, 0.625, 0.625]])).sum() == pytest.approx(1.25**2)
    assert overlap(walls, np.array([[1.5, -1.0, 0.5, 0.5]])).sum() == pytest.approx(0.625**2)


def test_stairs_open_the_wall_worked_by_hand():
    plan = FloorPlan.parse("#####\n#B.T#\n#...#\n#.S.#\n#####", cell_size=1.0)
    assert plan.stair_directions == ((1, 0),)  # opposite to the free cell in the north
    assert rows(Layout(plan).stairs) == [[0, -2, 0.5, 0.5]]
    south = [r for r in rows(Layout(plan).walls) if r[1] == -2]
    assert south == [[-1.3125, -2, 0.8125, 0.125], [1.3125, -2, 0.8125, 0.125]]
    # The floor reaches to the outer faces of the walls, 2.125 m out, and the stairs begin at 1.5 m.
    assert area(Layout(plan).floor) == pytest.approx(4.25**2 - 1.0 * 0.625)


@pytest.mark.parametrize(
    ("text", "directions"),
    [
        pytest.param("######\n#B.TS#\n#....#\n######", [(-1, 0)], id="opposite to a free cell, not to a table"),
        pytest.param("#######\n#.....#\n#.###.#\n#.BS..#\n#######", [(1, 0)], id="the outer wall"),
        pytest.param("#######\n#B....#\n#.###.#\n#..S..#\n#.....#\n#######", [None], id="not a thin inner wall"),
        pytest.param(
            "#######\n#B....#\n#.###.#\n#.###.#\n#..S..#\n#.....#\n#######", [(-1, 0)], id="a thick inner wall"
        ),
        pytest.param("#######\n#B....#\n#..#..#\n#..S..#\n#.....#\n#######", [None], id="no wall beside a pillar"),
    ],
)
def test_where_stairs_go_down(text: str, directions: list):
    assert list(FloorPlan.parse(text).stair_directions) == directions


def test_doorways_and_rooms_of_the_paper_house_and_a_corridor():
    assert Layout(PAPER).doorways == (((3, 4), (0, 1)), ((5, 2), (1, 0)), ((7, 7), (0, 1)))
    assert sorted(int(room.sum()) for room in Layout(PAPER).rooms) == [12, 12, 18, 29]
    # Corridor is no doorway.
    corridor = FloorPlan.parse("########\n#B.##..#\n#......#\n#..##..#\n########")
    assert (Layout(corridor).doorways, len(Layout(corridor).rooms)) == ((), 1)


PLANS = plan_texts().map(FloorPlan.parse)


@settings(max_examples=60, deadline=None)
@given(plan=PLANS)
def test_walls_stay_in_wall_cells_and_floor_and_ground_fill_the_rest(plan: FloorPlan):
    walls, stairs = Layout(plan).walls, Layout(plan).stairs
    floor, ground = Layout(plan).floor, Layout(plan).ground(margin=2.0)
    rooms = cells(plan, wall=False)
    assert overlap(rooms, np.concatenate([walls, stairs])).max() < 1e-9
    assert overlap(rooms, floor).sum() == pytest.approx(area(rooms))
    assert overlap(walls, floor).sum() == pytest.approx(area(walls))
    everything = np.concatenate([stairs, floor, ground])
    assert np.triu(overlap(everything, everything), k=1).max() < 1e-9
    height, width = np.array(plan.shape) * plan.cell_size + 4.0
    assert area(everything) == pytest.approx(height * width)


@settings(max_examples=40, deadline=None)
@given(plan=PLANS)
def test_no_point_gets_out_of_the_house(plan: FloorPlan):
    closed = np.concatenate([Layout(plan).walls, Layout(plan).stairs])
    half = np.array(plan.shape[::-1]) * plan.cell_size / 2 + RASTER
    x, y = (np.arange(-h, h + RASTER, RASTER) for h in half)
    blocked = np.zeros((len(x), len(y)), bool)
    for centre_x, centre_y, half_x, half_y in closed:
        blocked |= np.outer(np.abs(x - centre_x) <= half_x, np.abs(y - centre_y) <= half_y)
    parts, _ = ndimage.label(~blocked)

    def part_at(point: np.ndarray) -> int:
        return parts[np.abs(x - point[0]).argmin(), np.abs(y - point[1]).argmin()]

    inside = {part_at(plan.position(cell)) for cell in plan.caregiver_cells}
    assert len(inside) == 1
    assert inside.isdisjoint({0, parts[0, 0]})


@settings(max_examples=60, deadline=None)
@given(plan=PLANS)
def test_stairs_go_down_in_walls_of_their_own(plan: FloorPlan):
    directions = plan.stair_directions
    steps = [(cell, step) for cell, step in zip(plan.stairwells, directions, strict=True) if step is not None]
    alcoves = [(row + down, column + right) for (row, column), (down, right) in steps]
    assert len(set(alcoves)) == len(alcoves)
    for alcove, (_, (down, right)) in zip(alcoves, steps, strict=True):
        for side in (-1, 0, 1):
            assert plan[alcove[0] + side * right, alcove[1] + side * down] == WALL
    stairs = Layout(plan).stairs
    assert rows(stairs[:, :2]) == rows(np.array([plan.position(cell) for cell in alcoves]).reshape(-1, 2))
