"""Houses for the measurements in this folder: those of the package, and generated ones of any size."""

from __future__ import annotations

import functools
import itertools

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan

_ROOM = 8  # cells from wall to wall
_RING = ((-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1))


@functools.cache
def three_houses() -> tuple[FloorPlan, ...]:
    """Houses to measure the robot's skills in."""
    third = generated(14, 14, candles=4, tables=4)
    return FloorPlan.load("paper"), FloorPlan.load("apartment"), third


def generated(
    rows: int, columns: int, candles: int, tables: int, stairwells: int = 2, bins: int = 3, seed: int = 0
) -> FloorPlan:
    """Makes a house of rooms with two-cell doorways, and furniture that leaves a way everywhere.

    Args:
        rows: Rows of the floor plan, walls included.
        columns: Its columns.
        candles: Tables with a candle.
        tables: Bare tables.
        stairwells: Stairwells.
        bins: Toy bins.
        seed: Seed of where all that stands.

    Raises:
        ValueError: There is no room for so much.
    """
    random = np.random.default_rng(seed)
    grid = np.full((rows, columns), ".")
    for view in (grid, grid.T):
        _build_walls(view)
    wanted = list("S" * stairwells + "B" * bins + "C" * candles + "T" * tables)
    places = random.permutation(np.argwhere(grid == ".")).tolist()
    for kind in wanted:
        place = next((p for p in places if _has_room(grid, *p)), None)
        if place is None:
            raise ValueError(f"no room for {len(wanted)} objects in {rows} x {columns} cells")
        places.remove(place)
        grid[tuple(place)] = kind
    text = "\n".join("".join(row) for row in grid)
    return FloorPlan.parse(text, f"generated {rows}x{columns}")


def _build_walls(view: np.ndarray) -> None:
    """Puts walls across a plan, border included, with a doorway into every room."""
    length, width = view.shape
    across = np.linspace(0, length - 1, max(1, round((length - 1) / _ROOM)) + 1).astype(int)
    rooms = np.linspace(0, width - 1, max(1, round((width - 1) / _ROOM)) + 1).astype(int)
    view[across] = "#"
    for row in across[1:-1]:
        for begin, end in itertools.pairwise(rooms):
            middle = (begin + end) // 2
            view[row, middle : middle + 2] = "."


def _has_room(grid: np.ndarray, row: int, column: int) -> bool:
    """Whether a cell lies in the open or along a straight wall, so that an object there cuts nothing off.

    It is not in a doorway then, nor beside another object.
    """
    ring = [str(grid[row + down, column + right]) for down, right in _RING]
    runs = sum(a != b for a, b in zip(ring, ring[1:] + ring[:1], strict=True)) // 2
    return set(ring) <= {".", "#"} and (ring.count("#"), runs) in ((0, 0), (3, 1))
