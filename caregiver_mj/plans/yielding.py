"""Cells in which a caregiver is in a child's way, or could be trapped by a child."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable

import numpy as np

from caregiver_mj.plans.cell_graph import CellGraph
from caregiver_mj.plans.floor_plan import FloorPlan

_SAMPLES = 32  # cells of a part of the house to try before all of it


@functools.lru_cache(maxsize=16)
def yielding(plan: FloorPlan) -> Yielding:
    """Return the cached `Yielding` of a floor plan."""
    return Yielding(plan)


class Yielding:
    """The ways of children to their toy bins, and the cells that bar them."""

    def __init__(self, plan: FloorPlan):
        self._plan = plan

    def routes_over(self, child_cell: int) -> np.ndarray:
        """Return the number of toy bins to which a child's shortest path leads over each cell, (caregiver cells,)."""
        routes = np.zeros(len(self._plan.caregiver_cells), int)  # none leads over a landing
        distance = self._plan.graph.child_distances_from([child_cell])[0]
        routes[: len(distance)] = self._on_shortest_path(child_cell, distance).sum(axis=1)
        return routes

    def in_the_way(self, child_cells: Iterable[int]) -> np.ndarray:
        """Return how much each cell is in the way of some children, integers (caregiver cells,).

        The order is by `routes_over`, then by whether a child that follows the caregiver is `exposed`.
        """
        return 2 * np.asarray(sum(self.routes_over(cell) for cell in child_cells)) + self.exposed

    @functools.cached_property
    def exposed(self) -> np.ndarray:
        """Whether a child that comes to the caregiver can stand beside stairs or a table, bool (caregiver cells,)."""
        graph, free = self._plan.graph, len(self._plan.free_cells)
        beside = (graph.bumps >= 0).sum(axis=1)  # number of them beside each free cell
        exposed = np.zeros(len(graph.neighbours), bool)
        for cell, around in enumerate(graph.neighbours):
            own = 1 if cell >= free else 0  # the stairs in whose mouth the caregiver stands
            exposed[cell] = any(beside[near] > own for near in around if near < free)
        return exposed

    @functools.cached_property
    def dead_ends(self) -> np.ndarray:
        """Whether each cell is a dead end, bool (caregiver cells,)."""
        neighbours = self._plan.graph.neighbours
        ways = [len(around) for around in neighbours]
        ends = [cell for cell, count in enumerate(ways) if count <= 1]
        for cell in ends:  # the list grows: a cell that leads to dead ends only is one itself
            for near in neighbours[cell]:
                ways[near] -= 1
                if ways[near] == 1:
                    ends.append(near)
        return np.isin(np.arange(len(ways)), ends)

    @functools.cached_property
    def traps(self) -> np.ndarray:
        """Whether a child can trap the caregiver in a part where every cell bars its way, bool (caregiver cells,).

        An example is the end of a passage to a toy bin, where neither could move on.
        """
        plan = self._plan
        traps = np.zeros(len(plan.caregiver_cells), bool)
        refuges: list[int] = []  # the latest refuges
        order, parts = divisions(plan.graph)
        for by, ranges in sorted(parts, key=lambda part: sum(each.stop - each.start for each in part[1]), reverse=True):
            cells = np.concatenate([order[each] for each in ranges])
            if by >= len(plan.free_cells) or traps[cells].all():
                continue
            refuge = self._refuge(by, cells, refuges)
            if refuge is None:
                traps[cells] = True
            else:
                refuges = [refuge, *refuges][:_SAMPLES]
        return traps

    def _refuge(self, child_cell: int, cells: np.ndarray, guesses: list[int]) -> int | None:
        """Return a cell cut off by a child in which a caregiver does not bar its way, or None; try guesses first."""
        free = len(self._plan.free_cells)
        if cells.max() >= free:
            return int(cells.max())  # a landing bars no way
        # A cell that is off even a straight way needs no search.
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
        """Return whether each free cell is on a shortest path from the child to a toy bin, bool (free cells, bins)."""
        to_bins = self._plan.graph.bin_distances
        return distance[:, None] + to_bins == to_bins[child_cell]

    @functools.cached_property
    def _places(self) -> np.ndarray:
        """Row and column of the free cells, (free cells, 2)."""
        return np.array(self._plan.free_cells)


def divisions(graph: CellGraph) -> tuple[np.ndarray, list[tuple[int, list[slice]]]]:
    """Return all parts that single cells cut off in a connected house, in time linear in its size.

    These are the cut vertices of Hopcroft and Tarjan (1973): a cell cuts off its subtree in a depth-first search unless
    a cell there has a neighbour above it.

    Returns:
        All cells in the order of the search, and for each part the cell that cuts it off and its slices of that order.
    """
    order, above = graph.depth_first()
    count = len(order)
    place = np.argsort(order).tolist()
    end = [first + 1 for first in place]  # end of each cell's subtree in the order
    # Place of the first neighbour of a cell's subtree.
    highest = [min(place[neighbour] for neighbour in (cell, *graph.neighbours[cell])) for cell in range(count)]
    hanging: list[list[slice]] = [[] for _ in range(count)]  # subtrees that each cell cuts off
    for cell in order[:0:-1].tolist():
        over = above[cell]
        end[over] = max(end[over], end[cell])
        if highest[cell] >= place[over]:
            hanging[over].append(slice(place[cell], end[cell]))
        highest[over] = min(highest[over], highest[cell])
    found: list[tuple[int, list[slice]]] = []
    for cell, parts in enumerate(hanging):
        # The rest is everything between them, except the cell itself.
        gaps = sorted([(place[cell], place[cell] + 1), *((part.start, part.stop) for part in parts)])
        borders = [0, *itertools.chain.from_iterable(gaps), count]
        rest = [slice(*gap) for gap in zip(borders[::2], borders[1::2], strict=True) if gap[0] < gap[1]]
        if len(parts) + bool(rest) > 1:
            found += [(cell, [part]) for part in parts] + ([(cell, rest)] if rest else [])
    return order, found
