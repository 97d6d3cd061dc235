"""Random valid floor plans for tests of properties, made without the package's own notion of what is valid.

`caregiver_mj.plans.generator` makes houses that people could live in and the robot can work in. What holds for every
plan must also hold for those that are neither: things in doorways and in lanes one cell wide, walls that end nowhere,
objects heaped up, landings in the only short way.
"""

import numpy as np
from hypothesis import strategies as st
from walks import distances, neighbours

SMALLEST, LARGEST = 5, 20  # rows or columns


def plan_texts(smallest: int = SMALLEST, largest: int = LARGEST) -> st.SearchStrategy[str]:
    """Random plans of so many rows and columns, border included; they shrink towards small ones."""
    size = st.integers(smallest, largest)
    return st.builds(_random_plan, st.integers(0, 2**32 - 1), size, size)


def with_things(text: str, seed: int) -> str:
    """A plan with something on the floor of up to four of its free cells, but not of the last two."""
    random, cells = np.random.default_rng(seed), np.array(list(text))
    free = random.permutation(np.flatnonzero(cells == "."))
    cells[free[2:][: int(random.integers(1, 5))]] = "o"
    return "".join(cells)


def plans_with_things(largest: int) -> st.SearchStrategy[str]:
    """Random plans of at most so many rows and columns, with something on the floor of some."""
    return st.builds(with_things, plan_texts(largest=largest), st.integers(0, 2**32 - 1))


def _random_plan(seed: int, rows: int, columns: int) -> str:
    """Draws a plan with walls here and there, and one or more of each object; of candles maybe none."""
    random = np.random.default_rng(seed)
    most = max(2, rows * columns // 40)
    counts = {kind: int(random.integers(kind != "C", most + 1)) for kind in "SBTC"}
    while True:  # a small plan may leave no place for the last kind; then another one will
        grid = np.full((rows, columns), ".")
        grid[[0, -1], :] = grid[:, [0, -1]] = "#"
        # One object of each kind comes first, so that walls and further objects cannot take its place.
        placed = [_place(random, grid, kind) for kind, count in counts.items() if count]
        if not all(placed):
            continue
        for _ in range(int(random.integers(0, (rows + columns) // 5 + 1))):
            _build_wall(random, grid)
        for kind, count in counts.items():
            for _ in range(count - 1):
                _place(random, grid, kind)
        return "\n".join("".join(row) for row in grid)


def _place(random: np.random.Generator, grid: np.ndarray, kind: str, attempts: int = 20) -> bool:
    """Puts an object on a random free cell, unless no place for it is found."""
    free = np.argwhere(grid == ".")
    for row, column in random.permutation(free)[:attempts]:
        grid[row, column] = kind
        if _is_valid(grid):
            return True
        grid[row, column] = "."
    return False


def _build_wall(random: np.random.Generator, grid: np.ndarray) -> None:
    """Puts a straight wall with one doorway across the plan or a part of it, unless it would cut something off."""
    before = grid.copy()
    view = grid if random.random() < 0.5 else grid.T
    across = int(random.integers(1, len(view) - 1))
    first, last = sorted(int(i) for i in random.integers(1, view.shape[1] - 1, size=2))
    line = view[across, first : last + 1]
    door = int(random.integers(len(line)))
    line[[i for i in range(len(line)) if line[i] == "." and i != door]] = "#"
    if not _is_valid(grid):
        grid[:] = before


def _is_valid(grid: np.ndarray) -> bool:
    """Whether the free cells are connected and every object has one beside it."""
    free = {(int(r), int(c)) for r, c in np.argwhere(grid == ".")}
    if not free:
        return False
    objects = np.argwhere((grid != ".") & (grid != "#"))
    return set(distances(free, min(free))) == free and all(free.intersection(neighbours(thing)) for thing in objects)
