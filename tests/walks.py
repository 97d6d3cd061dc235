"""Walks from cell to cell for tests, searched without the package's own graph."""

from collections.abc import Collection

Cell = tuple[int, int]

STEPS: dict[str, Cell] = {"north": (-1, 0), "east": (0, 1), "south": (1, 0), "west": (0, -1)}


def neighbours(cell: Cell) -> list[Cell]:
    return [(cell[0] + down, cell[1] + right) for down, right in STEPS.values()]


def distances(cells: Collection[Cell], *starts: Cell) -> dict[Cell, int]:
    """Moves from the nearest of some cells to all others that can be reached, in a set of walkable cells."""
    moves = dict.fromkeys(starts, 0)
    queue = list(moves)
    for cell in queue:
        for there in neighbours(cell):
            if there in cells and there not in moves:
                moves[there] = moves[cell] + 1
                queue.append(there)
    return moves
