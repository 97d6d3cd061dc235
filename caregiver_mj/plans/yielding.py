"""Where a caregiver is in a child's way, and where a child could shut it in: what to know in order to yield."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from caregiver_mj.plans.floor_plan import FloorPlan

_SAMPLES = 32  # cells of a part of the house that are looked at before all of it


@functools.lru_cache(maxsize=16)
def yielding(plan: FloorPlan) -> Yielding:
    """Return what there is to know of a floor plan; made once."""
    return Yielding(plan)


class Yielding:
    """The ways of a child to its toy bins, seen by somebody who could stand in them."""

    def __init__(self, plan: FloorPlan):
        self._plan = plan

    def routes_over(self, child_cell: int) -> np.ndarray:
        """Return how much a caregiver would be in a child's way in each cell.

        Args:
            child_cell: Index of the child's free cell.

        Returns:
            The number of toy bins to which a shortest path of the child leads over the cell, (caregiver cells,).
        """
        routes = np.zeros(len(self._plan.caregiver_cells), int)  # none leads over a landing
        distance = self._plan.graph.child_distances_from([child_cell])[0]
        routes[: len(distance)] = self._on_shortest_path(child_cell, distance).sum(axis=1)
        return routes

    def in_the_way(self, child_cells: Iterable[int]) -> np.ndarray:
        """Return how much each cell is in the way of some children: integers (caregiver cells,).

        What counts first is `routes_over`; among equals, that a child which comes after the caregiver is not `exposed`.
        """
        return 2 * np.asarray(sum(self.routes_over(cell) for cell in child_cells)) + self.exposed

    @functools.cached_property
    def exposed(self) -> np.ndarray:
        """Whether a child that comes to the caregiver can stand beside stairs or a table: bool (caregiver cells,)."""
        graph, free = self._plan.graph, len(self._plan.free_cells)
        beside = (graph.bumps >= 0).sum(axis=1)  # how many of them are beside each free cell
        exposed = np.zeros(len(graph.neighbours), bool)
        for cell, around in enumerate(graph.neighbours):
            own = 1 if cell >= free else 0  # the stairs in whose mouth the caregiver stands
            exposed[cell] = any(beside[near] > own for near in around if near < free)
        return exposed

    @functools.cached_property
    def traps(self) -> np.ndarray:
        """Whether a child can shut the caregiver in where every cell bars its way: bool (caregiver cells,).

        Such as at the end of a passage that leads to a toy bin: neither can then go on.
        """
        plan = self._plan
        traps = np.zeros(len(plan.caregiver_cells), bool)
        refuges: list[int] = []  # the last cells that were found to be one
        parts = [part for part in divisions(plan.graph.neighbours) if part.by < len(plan.free_cells)]
        for part in sorted(parts, key=lambda part: part.size, reverse=True):
            cells = part.cells
            if traps[cells].all():
                continue
            refuge = self._refuge(part.by, cells, refuges)
            if refuge is None:
                traps[cells] = True
            else:
                refuges = [refuge, *refuges][:_SAMPLES]
        return traps

    def _refuge(self, child_cell: int, cells: np.ndarray, guesses: list[int]) -> int | None:
        """One of some cells in which a caregiver does not bar the way of a child that cuts them off, or None.

        Args:
            child_cell: Index of the child's free cell.
            cells: The caregiver cells that it cuts off.
            guesses: Cells to look at first, whether they are among these or not.
        """
        free = len(self._plan.free_cells)
        if cells.max() >= free:
            return int(cells.max())  # a landing is in nobody's way
        # A cell through which not even a straight way would be short enough needs no search.
        guessed = cells[np.isin(cells, guesses)] if guesses else cells[:0]
        samples = np.concatenate([guessed, cells[:: 1 + len(cells) // _SAMPLES]])
        places = self._places
        straight = np.abs(places[samples] - places[child_cell]).sum(axis=1)
        to_bins = self._plan.graph.bin_distances
        aside = (straight[:, None] + to_bins[samples] > to_bins[child_cell]).all(axis=1)
        if aside.any():
            return int(samples[aside.argmax()])
        # A cell bars the way if it is the only one so far away on the shortest paths to some bin.
        far = self._plan.graph.child_distances_from([child_cell])[0]
        on_path = self._on_shortest_path(child_cell, far)
        alternatives = np.zeros((far.max() + 1, len(self._plan.bins)), int)
        np.add.at(alternatives, far, on_path)
        bars = (on_path[cells] & (alternatives[far[cells]] == 1)).any(axis=1)
        return None if bars.all() else int(cells[bars.argmin()])

    def _on_shortest_path(self, child_cell: int, distance: np.ndarray) -> np.ndarray:
        """Whether a free cell is on some shortest path from the child to a toy bin: bool (free cells, bins)."""
        to_bins = self._plan.graph.bin_distances
        return distance[:, None] + to_bins == to_bins[child_cell]

    @functools.cached_property
    def _places(self) -> np.ndarray:
        """Row and column of the free cells, (free cells, 2)."""
        return np.array(self._plan.free_cells)


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
    """Return all parts that single cells of a connected graph cut off from each other, in time linear in its size.

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
