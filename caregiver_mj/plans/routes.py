"""Routes of a caregiver round the children, and its behaviour where they bar its only way.

The rule: *where children bar its only way, the caregiver waits as near as it can without being beside a child, and goes
back when one comes.* Between them a free cell remains, in which the child can turn round; a waiting caregiver denies no
child a move unless it is cornered. `Yielding` has the cells in which it would be in a child's way, or trapped.
"""

from __future__ import annotations

import functools
import itertools
import math
import threading
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import UNREACHABLE, CellGraph
from caregiver_mj.plans.floor_plan import FloorPlan

Places = tuple[tuple[int, ...], ...]  # groups of caregiver cells

ASIDE = -1  # place in which the caregiver is least in the children's way
STAY = -2  # present place

LARGEST = 6e9  # bytes; greatest size of the tables of one child; generated houses of 60 x 60 cells need about 3e9
_TABLES = 2  # of distances and of next cells
_SAMPLES = 32  # cells of a part of the house tried before all of it


@functools.lru_cache(maxsize=4)
def routes(plan: FloorPlan, places: Places) -> RouteTables:
    """Return the routes to some places, cached: all caregivers and children share their tables."""
    return RouteTables(plan, places)


class RouteTables:
    """Shortest routes to places round the children, computed once for every set of children's cells.

    A place is a group of cells, any of which will do. Two more are `ASIDE`, out of the children's way (on the fewest
    shortest paths from a child to a toy bin, and away from hazards), and `STAY`.
    """

    def __init__(self, plan: FloorPlan, places: Sequence[Sequence[int]]):
        """Prepare the tables; raise CaregiverError if the house is too large."""
        # Of each table: cells of one child, places and ASIDE, caregiver cells.
        shape = len(plan.free_cells), len(places) + 1, len(plan.caregiver_cells)
        needed = _TABLES * math.prod(shape) * np.dtype(np.int16).itemsize
        if needed > LARGEST:
            raise CaregiverError(
                f"floor plan '{plan.name}' is too large for a caregiver in the grid: with {len(plan.free_cells)} free "
                f"cells, {len(plan.tables)} tables and {len(plan.stairwells)} stairwells the paths round a child would "
                f"take {needed / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f}"
            )
        self._plan, self._yielding = plan, yielding(plan)
        self._stand = [list(place) for place in places]
        # Prefer cells in which a child cannot trap the caregiver.
        traps = self._yielding.traps
        self._safe_stand = [[cell for cell in stand if not traps[cell]] for stand in self._stand]
        self.open_distance = plan.graph.distances_from(self._stand)  # without children, (places, cells)
        self._learning = threading.Lock()
        self._row_of: dict[tuple[int, ...], int] = {}  # row of the tables, by the children's cells
        # Only written rows use memory. The last place of a row is ASIDE.
        self._distance, self._next_cell = (np.zeros(shape, np.int16) for _ in range(_TABLES))

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle by `routes`, because the tables are large and shared."""
        return routes, (self._plan, tuple(map(tuple, self._stand)))

    def towards(
        self, place: np.ndarray, child_cell: np.ndarray, caregiver_cell: np.ndarray, yields: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the moves to a place, `UNREACHABLE` without a path, and the next cell, (B,) each.

        Places (B,) are numbers, `ASIDE` or `STAY`; cells are the children's (B, K) and the caregiver's (B,). A
        caregiver that yields keeps its distance from children that bar its way; another stays.
        """
        row = self._rows(child_cell)
        stays = place == STAY
        place = np.where(stays, ASIDE, place)
        distance = self._distance[row, place, caregiver_cell]
        waits = stays if yields else stays | (distance == UNREACHABLE)
        next_cell = np.where(waits, caregiver_cell, self._next_cell[row, place, caregiver_cell])
        return np.where(stays, 0, distance), next_cell

    def around(self, child: int) -> tuple[np.ndarray, np.ndarray]:
        """Return `towards` from every cell to every place and `ASIDE` with one child, (places + 1, cells) each."""
        row = self._rows(np.array([[child]]))[0]
        return self._distance[row], self._next_cell[row]

    def _rows(self, child_cell: np.ndarray) -> np.ndarray:
        """Return the rows of the tables for the children's cells (B, K), computing new ones, (B,)."""
        if child_cell.shape[1] == 1:  # a faster special case
            groups, inverse = np.unique(child_cell, return_inverse=True)
            groups = groups[:, None]
        else:
            groups, inverse = np.unique(np.sort(child_cell, axis=1), axis=0, return_inverse=True)
        rows = []
        for group in map(tuple, groups.tolist()):
            if group not in self._row_of:
                with self._learning:
                    if group not in self._row_of:  # recheck: another thread may have computed it
                        self._row_of[group] = self._learn(sorted(set(group)))
            rows.append(self._row_of[group])
        return np.array(rows)[inverse.ravel()]

    def _learn(self, closed: list[int]) -> int:
        """Compute the row of one set of children's cells; return its number."""
        row = len(self._row_of)
        if row == len(self._distance):
            for name in ("_distance", "_next_cell"):
                table = getattr(self, name)
                larger = np.zeros((2 * len(table), *table.shape[1:]), table.dtype)
                larger[: len(table)] = table
                setattr(self, name, larger)
        graph = self._plan.graph
        clear = _lowest(self._yielding.in_the_way(closed), graph.parts(closed))
        way, *far = graph.distances_from([clear, *self._safe_stand, *self._stand], closed)
        self._distance[row, ASIDE] = UNREACHABLE
        self._next_cell[row, ASIDE] = graph.downhill(way)
        if self._stand:
            safe, any_stand = np.split(np.array(far), 2)
            self._distance[row, :ASIDE] = distance = np.where(safe < UNREACHABLE, safe, any_stand)
            height = distance.astype(int)
            if np.delete(distance == UNREACHABLE, closed, axis=1).any():
                height = np.where(distance == UNREACHABLE, self._waiting(closed), height)
            self._next_cell[row, :ASIDE] = graph.downhill(height)
        return row

    def _waiting(self, closed: list[int]) -> np.ndarray:
        """Return the distance from each cell to a waiting cell for an unreachable place, (places, cells)."""
        graph = self._plan.graph
        beside = graph.distances_from([closed])[0] <= 1  # in a child's cell, or next to one
        shut = np.flatnonzero(beside).tolist()
        part = graph.parts(shut)
        nearest = [_lowest(np.where(beside, UNREACHABLE, far), part) for far in self.open_distance.astype(int)]
        nearest = [cells[~beside[cells]] for cells in nearest]
        # A caregiver beside a child moves away from it; none walks past one.
        away, out = (graph.distances_from(nearest, closed).astype(int) for closed in (shut, closed))
        return np.where(beside, UNREACHABLE + out, away)


def _lowest(height: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Return the lowest cells of every part of a divided house, given height and part of each cell, (cells,)."""
    least = np.full(part.max() + 1, np.iinfo(int).max)
    np.minimum.at(least, part, height)
    return np.flatnonzero(height == least[part])


# -- Cells that bar a child's way, or where a child can trap the caregiver ------------------------------


@functools.lru_cache(maxsize=16)
def yielding(plan: FloorPlan) -> Yielding:
    """Return the cached `Yielding` of a floor plan."""
    return Yielding(plan)


class Yielding:
    """Children's shortest paths to toy bins, and the cells that bar them."""

    def __init__(self, plan: FloorPlan):
        self._plan = plan

    def routes_over(self, child_cell: int) -> np.ndarray:
        """Return the number of toy bins to which a child's shortest paths lead over each cell, (caregiver cells,)."""
        routes = np.zeros(len(self._plan.caregiver_cells), int)  # no path crosses landings
        distance = self._plan.graph.child_distances_from([child_cell])[0]
        routes[: len(distance)] = self._on_shortest_path(child_cell, distance).sum(axis=1)
        return routes

    def in_the_way(self, child_cells: Iterable[int]) -> np.ndarray:
        """Return how much each cell is in the children's way, (caregiver cells,): by `routes_over`, then `exposed`."""
        return 2 * np.asarray(sum(self.routes_over(cell) for cell in child_cells)) + self.exposed

    @functools.cached_property
    def exposed(self) -> np.ndarray:
        """Whether a child that comes to the caregiver can stand beside stairs or a table, bool (caregiver cells,)."""
        graph, free = self._plan.graph, len(self._plan.free_cells)
        beside = (graph.bumps >= 0).sum(axis=1)  # number beside each free cell
        exposed = np.zeros(len(graph.neighbours), bool)
        for cell, around in enumerate(graph.neighbours):
            own = 1 if cell >= free else 0  # the caregiver blocks these stairs
            exposed[cell] = any(beside[near] > own for near in around if near < free)
        return exposed

    @functools.cached_property
    def dead_ends(self) -> np.ndarray:
        """Whether each cell is a dead end, bool (caregiver cells,)."""
        neighbours = self._plan.graph.neighbours
        ways = [len(around) for around in neighbours]
        ends = [cell for cell, count in enumerate(ways) if count <= 1]
        for cell in ends:  # the list grows: a cell that leads only to dead ends is one
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
        # A cell off even the straight way needs no search.
        guessed = cells[np.isin(cells, guesses)] if guesses else cells[:0]
        samples = np.concatenate([guessed, cells[:: 1 + len(cells) // _SAMPLES]])
        places = self._places
        straight = np.abs(places[samples] - places[child_cell]).sum(axis=1)
        to_bins = self._plan.graph.bin_distances
        aside = (straight[:, None] + to_bins[samples] > to_bins[child_cell]).all(axis=1)
        if aside.any():
            return int(samples[aside.argmax()])
        # A cell bars the way if it is the only one at its distance on the shortest paths to some bin.
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
    """Return all parts that single cells cut off in a connected house, in linear time.

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
