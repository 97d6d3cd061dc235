"""Large plans: memory in proportion to their cells, whatever they are full of, and results where they are expected."""

import tracemalloc

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.yielding import yielding

BYTES_PER_CELL = 1000  # in what is worked out to check a plan; about 400 are needed
SMALL, LARGE = 60, 180  # rows and columns


def empty(side: int) -> np.ndarray:
    """One room with a bin in its corner."""
    grid = np.full((side, side), ".")
    grid[[0, -1], :] = grid[:, [0, -1]] = "#"
    grid[1, 1] = "B"
    return grid


def lane(side: int) -> np.ndarray:
    """One long lane to and fro."""
    grid = empty(side)
    grid[2:-1:2, 1:-1] = "#"
    grid[2:-1:4, -2] = grid[4:-1:4, 1] = "."
    return grid


def full(side: int) -> np.ndarray:
    """Every other row full of tables, candles and stairwells, but for its ends."""
    grid = empty(side)
    grid[2:-2:2, 2:-2] = "T"
    grid[2:-2:2, 2:-2:3] = "C"
    grid[2:-2:2, 3:-2:7] = "S"
    return grid


def scattered(side: int) -> np.ndarray:
    """One object for 20 cells, a quarter of each kind: 500 in 100 x 100 cells."""
    grid = empty(side)
    rows, columns = np.meshgrid(np.arange(3, side - 2, 4), np.arange(3, side - 2, 5), indexing="ij")
    grid[rows, columns] = np.resize(list("SCTB"), rows.shape)
    return grid


def text(grid: np.ndarray) -> str:
    return "\n".join(map("".join, grid.tolist()))


def most_memory(action) -> int:
    """Bytes that are in use at most while something is done."""
    tracemalloc.start()
    try:
        action()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("draw", [empty, lane, full, scattered])
def test_checking_a_plan_takes_memory_in_proportion_to_its_cells(draw):
    FloorPlan.parse(text(draw(SMALL)))  # what is imported and cached on first use does not count
    for side in (SMALL, LARGE):
        plan = text(draw(side))
        assert most_memory(lambda plan=plan: FloorPlan.parse(plan)) < BYTES_PER_CELL * side**2


@pytest.mark.parametrize("draw", [empty, lane, full, scattered])
def test_moves_and_a_walk_take_memory_in_proportion_to_the_cells(draw):
    for side in (SMALL, LARGE):
        graph = FloorPlan.parse(text(draw(side))).graph
        used = most_memory(lambda graph=graph: (graph.moves, graph.neighbours, graph.distances_from([0], 5)))
        assert used < BYTES_PER_CELL * side**2


def test_walks_to_many_objects_take_little_more_memory_than_their_result():
    plan = FloorPlan.parse(text(full(80)))
    goals = plan.graph.beside(plan.tables)
    assert len(goals) > 2000
    result = len(goals) * len(plan.caregiver_cells) * 2  # two bytes a distance
    assert most_memory(lambda: plan.graph.distances_from(goals)) < result + 60e6


@pytest.mark.parametrize("draw", [empty, scattered])
def test_traps_of_large_plans_take_memory_in_proportion_to_cells_and_bins(draw):
    plan = FloorPlan.parse(text(draw(100)))
    _ = plan.graph.bin_distances
    used = most_memory(lambda: yielding(plan).traps)
    assert used < BYTES_PER_CELL * 100**2 + 40 * plan.graph.bin_distances.size


def test_a_plan_of_a_quarter_of_a_million_cells_is_checked():
    plan = FloorPlan.parse(text(scattered(500)), "large")
    assert len(plan.free_cells) > 225_000
    assert sum(map(len, (plan.stairwells, plan.tables, plan.bins))) > 12_000
