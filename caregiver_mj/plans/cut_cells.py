"""Cells that divide a house: whoever stands in one cuts others off from each other."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np


@dataclasses.dataclass(frozen=True)
class Division:
    """One of the parts into which a cell divides the others.

    Attributes:
        by: The cell.
        ranges: The part's cells, as ranges of `order`.
        order: All cells, in the order of a depth-first search.
    """

    by: int
    ranges: tuple[tuple[int, int], ...]
    order: np.ndarray

    @property
    def size(self) -> int:
        """How many cells there are in the part."""
        return sum(end - first for first, end in self.ranges)

    @property
    def cells(self) -> np.ndarray:
        """They themselves, (size,)."""
        return np.concatenate([self.order[first:end] for first, end in self.ranges])


def divisions(neighbours: Sequence[Sequence[int]]) -> list[Division]:
    """All parts that single cells of a connected graph cut off from each other, in time linear in its size.

    These are the cut vertices of Hopcroft and Tarjan (1973): what hangs below a cell in a depth-first search is cut off
    by it unless something there has a neighbour above the cell.

    Args:
        neighbours: For every cell those next to it.
    """
    count = len(neighbours)
    place, end = [-1] * count, [0] * count  # in the order of the search: of a cell, and after all that hangs below it
    highest = [0] * count  # place of the first cell next to one that hangs below a cell, or to itself
    order: list[int] = []
    hanging: list[list[int]] = [[] for _ in range(count)]  # below each cell those whose part it cuts off
    stack = [(0, -1)]
    below: list[Iterator[int]] = [iter(next_to) for next_to in neighbours]
    while stack:
        cell, above = stack[-1]
        if place[cell] < 0:
            place[cell] = highest[cell] = len(order)
            order.append(cell)
        for neighbour in below[cell]:
            if place[neighbour] < 0:
                stack.append((neighbour, cell))
                break
            highest[cell] = min(highest[cell], place[neighbour])
        else:
            stack.pop()
            end[cell] = len(order)
            if above >= 0:
                highest[above] = min(highest[above], highest[cell])
                if highest[cell] >= place[above]:
                    hanging[above].append(cell)
    found: list[tuple[int, tuple[tuple[int, int], ...]]] = []
    for cell, heads in enumerate(hanging):
        if not heads or (cell == 0 and len(heads) == 1):
            continue
        parts = [(place[head], end[head]) for head in heads]
        found += [(cell, (part,)) for part in parts]
        # What is left is everything between them, but for the cell itself.
        gaps = sorted([(place[cell], place[cell] + 1), *parts])
        borders = [0, *(border for gap in gaps for border in gap), count]
        rest = [(first, last) for first, last in zip(borders[::2], borders[1::2], strict=True) if first < last]
        if rest:
            found.append((cell, tuple(rest)))
    ordered = np.array(order)
    return [Division(cell, ranges, ordered) for cell, ranges in found]
