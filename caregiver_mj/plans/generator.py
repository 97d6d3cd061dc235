"""Generated houses: rooms, corridors and doorways, furnished as people do.

The same request gives the same house on every machine. Every house has a hazard that a caregiver can do something
about, and the robot can drive to all places that it needs.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np

from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.cell_graph import BIN, CANDLE, FREE, STAIRWELL, TABLE, WALL, Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import BATTERY, GATE, MUG
from caregiver_mj.plans.layout import Layout
from caregiver_mj.plans.rooms import MAKERS, SHAPES, Shell, build_shell, draw, pick
from caregiver_mj.plans.routes import yielding

_TRIES = (3, 60)  # least and greatest number of tries; larger houses get fewer
_SHAPE_TRIES = 60
_TRIED_CELLS = 30_000  # within outer walls, in all tries together
_ROOM_SIDES = (3, 2, 1)  # cells; least length of a room's shorter side, in earlier and later tries
DRIVING = 0.34  # m; clearance of the base's centre while driving: radius 0.27 and 0.07
STANDING = 0.32  # m; clearance while standing
TURNING = 0.52  # m; clearance from walls and stairs while turning with a candle in the hand
REACH = 0.70  # m; from the base's centre to a candle on a table
# Neighbours of a cell, clockwise from north.
_RING: tuple[Cell, ...] = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
_NEAR_DOORWAY = 3  # cells; distance from a doorway that is on the way to it
_SPACIOUS = 4  # cells; least length of a room's shorter side for a table in its middle

# -- Requests ------------------------------------------------------------------------------------------

SMALLEST, LARGEST = 5, 100  # rows or columns, outer walls included
SEEDS = 2**32
# Default contents: least and greatest numbers in a small and a large house, with areas within the outer walls of
# `_AREAS` cells. Other areas are interpolated.
_SIDES = (10, 18)  # rows or columns
_AREAS = (8 * 8, 16 * 16)
_USUAL = {
    "rooms": ((2, 4), (4, 6)),
    "stairwells": ((1, 2), (1, 4)),
    "candles": ((2, 3), (2, 6)),
    "tables": ((2, 3), (2, 6)),
    "bins": ((2, 3), (2, 5)),
}
_ROOMY, _THINGS = 16, 12  # cells; least area of a house for each room, and for each thing of a kind
_ADDED = ("gates", "mugs", "batteries")  # by default in homes only
_LEAST = {"rooms": 1, "stairwells": 0, "candles": 0, "tables": 0, "bins": 1} | dict.fromkeys(_ADDED, 0)
_FIELDS = (*_USUAL, *_ADDED)
_MOST_BATTERIES = 3  # in a home, which has at least one


@dataclasses.dataclass(frozen=True)
class Request:
    """A request for a house. Fields that are None are drawn from the seed."""

    seed: int  # from 0, below `SEEDS`
    size: tuple[int, int] | None = None  # columns and rows, outer walls included
    rooms: int | None = None  # number of rooms, including a corridor
    stairwells: int | None = None
    candles: int | None = None
    tables: int | None = None
    bins: int | None = None
    gates: int | None = None
    mugs: int | None = None
    batteries: int | None = None
    home: bool = False  # whether gates, mugs and batteries are drawn if None; else there are none

    @property
    def name(self) -> str:
        """Name by which the house can be loaded: `house-17`, `home-17`, or `house-17-14x12-rooms3`."""
        words = [f"{'home' if self.home else 'house'}-{self.seed}"]
        if self.size is not None:
            words.append("x".join(map(str, self.size)) if isinstance(self.size, Sequence) else str(self.size))
        words += [f"{field}{count}" for field in _FIELDS if (count := getattr(self, field)) is not None]
        return "-".join(words)

    @classmethod
    def from_name(cls, name: str) -> Request | None:
        """Parse the name of a generated house; return None for another name."""
        counts = "".join(rf"(?:-{field}(?P<{field}>\d{{1,9}}))?" for field in _FIELDS)
        size = r"(?:-(?P<width>\d{1,9})x(?P<height>\d{1,9}))?"
        found = re.fullmatch(rf"(house|home)-(?P<seed>\d{{1,20}}){size}{counts}", name, re.ASCII)
        if found is None:
            return None
        sides = None if found["width"] is None else (int(found["width"]), int(found["height"]))
        wishes = {field: None if found[field] is None else int(found[field]) for field in _FIELDS}
        return cls(int(found["seed"]), sides, **wishes, home=found[1] == "home")

    def check(self) -> None:
        """Raise FloorPlanError if the request is impossible."""
        if not isinstance(self.seed, Integral) or not 0 <= self.seed < SEEDS:
            raise self.error(f"the seed must be an integer from 0 to {SEEDS - 1}, got {self.seed!r}")
        if self.size is not None and not (isinstance(self.size, Sequence) and len(self.size) == 2):
            raise self.error(f"size must be columns and rows, such as (14, 12), got {self.size!r}")
        for side in self.size or ():
            if not isinstance(side, Integral) or not SMALLEST <= side <= LARGEST:
                raise self.error(f"rows and columns must be {SMALLEST} to {LARGEST}, got {side}")
        for field, least in _LEAST.items():
            count = getattr(self, field)
            if count is not None and (not isinstance(count, Integral) or count < least):
                raise self.error(f"{field} must be at least {least}, got {count}")
        for field, thing in (("candles", "candle"), ("mugs", "mug")):
            if getattr(self, field) and self.tables == 0:
                raise self.error(f"tables must be at least 1 with a {thing}, got none: there is nowhere to take it")
        batteries = self.home and self.batteries is None  # at least one
        added = batteries or any(getattr(self, field) for field in _ADDED)
        if not added and self.stairwells == 0 and 0 in (self.candles, self.tables):
            raise self.error(
                "stairwells and candles, which need a bare table, must be at least 1 together, got none: there is "
                "nothing to protect a child from"
            )

    def error(self, problem: str) -> FloorPlanError:
        """Return an error about this request."""
        return FloorPlanError(f"floor plan '{self.name}' cannot be made: {problem}")

    def settled(self) -> tuple[tuple[int, int], dict[str, int]]:
        """Return the size and the numbers of all things, with open ones drawn.

        In a home each stairwell has an open gate, and each thing on a table is a mug, with probability 1/2. Of the
        unshut stairs in the homes of healthy children 45 % have an open gate, by the odds ratios and attributable
        fractions in Kendrick et al., Arch Dis Child 2016. No such share is known for mugs and batteries.
        """
        random = np.random.RandomState(self.seed)
        drawn = [_SIDES[0] + draw(random, _SIDES[1] - _SIDES[0] + 1) for _ in range(2)]
        size = self.size or (drawn[0], drawn[1])
        area = (size[0] - 2) * (size[1] - 2)
        counts: dict[str, int] = {}
        for field, (small, large) in _USUAL.items():
            chance = draw(random, 2**32)  # always drawn, so that a given field does not change others
            most = max(1, area // (_ROOMY if field == "rooms" else _THINGS))
            low, high = (min(most, _between(area, *ends)) for ends in zip(small, large, strict=True))
            counts[field] = low + chance * (high - low + 1) // 2**32
        added = dict.fromkeys(_ADDED, 0)
        if self.home:
            for field, among in (("gates", "stairwells"), ("mugs", "candles")):
                added[field] = (draw(random, 2**32) & ((1 << counts[among]) - 1)).bit_count()
                counts[among] -= added[field]
            added["batteries"] = 1 + draw(random, _MOST_BATTERIES)
        counts |= added
        if self.tables == 0:
            counts["candles"] = counts["mugs"] = 0  # they need a bare table
        counts |= {field: count for field in counts if (count := getattr(self, field)) is not None}
        return size, counts


def _between(area: int, small: int, large: int) -> int:
    """Return the linear inter- or extrapolation between a small and a large area, at least 1."""
    return max(1, small + round((large - small) * (area - _AREAS[0]) / (_AREAS[1] - _AREAS[0])))


# -- Houses --------------------------------------------------------------------------------------------


def generate(seed: int, size: tuple[int, int] | None = None, **wishes: Any) -> FloorPlan:
    """Generate a house, which `FloorPlan.load` reproduces by its name.

    Args:
        seed: Seed of everything that is not given.
        size: Columns and rows, outer walls included.
        wishes: Further fields of `Request`, such as `rooms=3`.

    Raises:
        FloorPlanError: The request is impossible, or no house was found.
    """
    return design(Request(seed, size, **wishes))[0]


def design(request: Request) -> tuple[FloorPlan, Shell]:
    """Generate a house, like `generate`; return its floor plan and its shell.

    Raises:
        FloorPlanError: The request is impossible, or no house was found.
    """
    request.check()
    (width, height), counts = request.settled()
    area = (width - 2) * (height - 2)
    tries = 0 if sum(counts.values()) > area else int(np.clip(_TRIED_CELLS // area, *_TRIES))
    rooms, *things = counts.values()
    for attempt in range(tries):
        random = np.random.RandomState([request.seed, attempt])
        smallest = _ROOM_SIDES[attempt * len(_ROOM_SIDES) // tries]
        shell = build_shell(random, (height, width), rooms, smallest)
        if shell is not None and (plan := furnished(random, shell, things, request.name)):
            return plan, shell
    *some, last = (f"{field} {count}" for field, count in counts.items())
    raise request.error(f"no way was found to fit {', '.join(some)} and {last} into {width} x {height} cells")


def generate_shape(shape: str, seed: int) -> FloorPlan:
    """Return the house of a shape and a seed, valid and drivable.

    Raises:
        FloorPlanError: The shape or the seed is invalid, or no valid house was found.
    """
    if shape not in SHAPES:
        raise FloorPlanError(f"the shape must be one of {', '.join(SHAPES)}, got '{shape}'")
    if not 0 <= seed < SEEDS:
        raise FloorPlanError(
            f"floor plan '{shape}-{seed}' cannot be made: the seed must be an integer from 0 to {SEEDS - 1}, got {seed}"
        )
    for attempt in range(_SHAPE_TRIES):
        random = np.random.RandomState([[*SHAPES].index(shape), seed, attempt])
        shell, counts = MAKERS[shape](random)
        if plan := furnished(random, shell, counts, f"{shape}-{seed}"):
            return plan
    raise FloorPlanError(f"floor plan '{shape}-{seed}' cannot be made: no way was found")


def furnished(random: np.random.RandomState, shell: Shell, counts: Sequence[int], name: str) -> FloorPlan | None:
    """Furnish a house; return its plan, or None unless it is valid and drivable.

    Nothing divides a room, and each thing keeps a free cell beside it. The counts are of stairwells, candles, bare
    tables and bins, and optionally of gates, mugs and batteries.
    """
    stairwells, candles, tables, bins, gates, mugs, batteries = (*counts, 0, 0, 0)[:7]
    on_tables = random.permutation(list(CANDLE * candles + MUG.symbol * mugs + TABLE * tables)).tolist()
    house = _Furnished(shell)
    symbols = house.grid
    for kind in [*STAIRWELL * (stairwells + gates), *BIN * bins, *on_tables, *BATTERY.symbol * batteries]:
        if (cell := house.find(random, kind)) is None:
            return None
        symbols[cell] = kind
    try:
        plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), name)
        if gates:
            for cell in _gated(random, plan, gates):
                symbols[cell] = GATE.symbol
            plan = FloorPlan.parse("\n".join(map("".join, symbols.tolist())), name)
    except FloorPlanError:
        return None
    if len(plan.mouths) < gates:
        return None
    return plan if is_drivable(plan) else None


def _gated(random: np.random.RandomState, plan: FloorPlan, gates: int) -> list[Cell]:
    """Draw stairwells with room for a gate: an empty free cell opposite to their stairs."""
    ways = zip(plan.stairwells, plan.stair_directions, strict=True)
    possible = [(row, column) for (row, column), step in ways if step and plan[row - step[0], column - step[1]] == FREE]
    return [possible[i] for i in random.permutation(len(possible))[:gates].tolist()]


def is_drivable(plan: FloorPlan) -> bool:
    """Return whether the robot can drive to every free cell, landing and table, and back.

    Computed from the shapes in `layout`, with the clearances of the robot's navigation.
    """
    from scipy.sparse import coo_array, csgraph  # imported here because it is slow

    layout, free = Layout(plan), len(plan.free_cells)
    legs = _legs(plan, layout.obstacles)
    on_floor = legs[(legs < free).all(axis=1)]  # landings are dead ends
    graph = coo_array((np.ones(len(on_floor)), on_floor.T), shape=(free, free))
    if csgraph.connected_components(graph, directed=False)[0] > 1:
        return False
    to_landings = legs[(legs < free).any(axis=1)].max(axis=1, initial=0)
    if not np.isin(np.arange(free, len(plan.caregiver_cells)), to_landings).all():
        return False
    return set(_tables_within_reach(layout)) == set(range(len(plan.tables)))


def _tables_within_reach(layout: Layout) -> list[int]:
    """Return the tables at which the robot can work from a free cell beside them, and turn with a candle."""
    plan = layout.plan
    beside = plan.graph.beside(plan.tables)
    stands = [(table, cell) for table, cells in enumerate(beside) for cell in cells if not yielding(plan).traps[cell]]
    if not stands:
        return []
    middles = np.array([plan.position(plan.tables[table]) for table, _ in stands])
    cells = np.array([plan.position(plan.caregiver_cells[cell]) for _, cell in stands])
    bases = middles + (cells - middles) * REACH / plan.cell_size
    fits = _clearance(bases, np.zeros(2), layout.obstacles) >= STANDING
    fits &= _clearance(bases, np.zeros(2), layout.high) >= TURNING
    return [table for (table, _), fit in zip(stands, fits, strict=True) if fit]


def _legs(plan: FloorPlan, obstacles: np.ndarray) -> np.ndarray:
    """Return the moves between neighbouring caregiver cells that the base has room for, (moves, 2)."""
    neighbours = enumerate(plan.graph.neighbours)
    pairs = [(cell, neighbour) for cell, around in neighbours for neighbour in around if cell < neighbour]
    legs = np.array(pairs, int).reshape(-1, 2)
    ends = np.array([plan.position(cell) for cell in plan.caregiver_cells])[legs]  # (moves, 2 ends, 2)
    halves = np.abs(ends[:, 1] - ends[:, 0]) / 2
    return legs[_clearance(ends.mean(axis=1), halves, obstacles) >= DRIVING]


def _clearance(centres: np.ndarray, halves: np.ndarray, obstacles: np.ndarray) -> np.ndarray:
    """Return the distance of axis-parallel ways, by centre and half extent (n, 2), from obstacles, (n,), m."""
    nearest = np.full(len(centres), np.inf)
    for x, y, half_x, half_y in obstacles:
        gap = np.maximum(np.abs(centres - [x, y]) - halves - [half_x, half_y], 0)
        np.minimum(nearest, np.hypot(gap[:, 0], gap[:, 1]), out=nearest)
    return nearest


# -- Furniture and stairwells ---------------------------------------------------------------------------


# Usual places of things, %, in order of preference if the drawn one is taken. A way leads to a doorway, but is not
# before it.
_HABITS = {
    STAIRWELL: {"wall": 48, "corner": 30, "way": 17, "open": 5},
    BIN: {"corner": 65, "wall": 35, "open": 0},
    TABLE: {"wall": 60, "open": 25, "corner": 15},
}


class _Furnished:
    def __init__(self, shell: Shell):
        self.grid = shell.symbols()
        self._rooms = shell.rooms
        wall = np.pad(self.grid == WALL, 1)
        north, _, east, _, south, _, west, _ = _ring(wall)
        self._walls = north.astype(int) + east + south + west
        self._is_corner = (north | south) & (east | west)
        self._outer = np.zeros(shell.shape, bool)  # beside outer walls, which stairs need
        self._outer[[1, -2], :] = self._outer[:, [1, -2]] = True
        self._corridor, self._spacious = np.zeros((2, *shell.shape), bool)
        for room in shell.rooms:
            self._corridor[room.inside] = room.is_corridor
            self._spacious[room.inside] = min(room.sides) >= _SPACIOUS
        doorway = np.zeros(shell.shape, bool)
        for cell in shell.doorway_cells:
            doorway[cell] = True
        self._no_place = _spread(doorway)  # doorways and the cells before them
        self._near_doorway = doorway
        for _ in range(_NEAR_DOORWAY):
            self._near_doorway = _spread(self._near_doorway) & (self.grid != WALL)

    def find(self, random: np.random.RandomState, kind: str) -> Cell | None:
        """Draw a cell for a thing; None if there is none."""
        possible = self._possible(kind)
        habits = _HABITS.get(kind, _HABITS[TABLE])
        first = pick(random, list(habits), list(habits.values()))
        spaced = ~_spread(~np.isin(self.grid, (FREE, WALL)), corners=True)
        for free in (possible & spaced, possible):
            for place in (first, *habits):
                if (cells := free & self._where(place, kind)).any():
                    return self._draw_cell(random, cells)
        return None

    def _possible(self, kind: str) -> np.ndarray:
        """Return the cells where a thing blocks no way and isolates no other thing, bool (rows, columns)."""
        free = self.grid == FREE
        ring = _ring(np.pad(free, 1))
        sides, corners = ring[0::2], ring[1::2]
        links = sum(sides[i] & corners[i] & sides[(i + 1) % 4] for i in range(4))
        # The free cells on its sides must be connected round its corners.
        possible = free & ((sum(sides) - links == 1) | (links == 4)) & ~self._no_place
        thing = ~free & (self.grid != WALL)
        lonely = thing & (sum(sides) == 1)
        for beside in _ring(np.pad(lonely, 1))[0::2]:
            possible &= ~beside
        return possible & (~self._corridor if kind != STAIRWELL else True)

    def _where(self, place: str, kind: str) -> np.ndarray:
        """Return all cells of a kind of place, free or not, bool (rows, columns)."""
        if place == "corner":
            return self._is_corner & (self._outer if kind == STAIRWELL else True)
        if place == "wall":
            return (self._walls == 1) & (self._outer if kind == STAIRWELL else True)
        if place == "open":
            around = _ring(np.pad(self.grid == FREE, 1))
            return self._spacious & np.logical_and.reduce(around)
        return self._near_doorway

    def _draw_cell(self, random: np.random.RandomState, cells: np.ndarray) -> Cell:
        """Draw a room, preferring empty ones, and one of its cells."""
        rooms = [room for room in self._rooms if cells[room.inside].any()]
        things = [int((self.grid[room.inside] != FREE).sum()) for room in rooms]
        weights = [1 + 1000 * room.area // (1 + count) ** 2 for room, count in zip(rooms, things, strict=True)]
        room = pick(random, rooms, weights)
        found = np.argwhere(cells[room.inside])
        row, column = found[draw(random, len(found))].tolist()
        return room.top + row, room.left + column


def _ring(padded: np.ndarray) -> list[np.ndarray]:
    """Return the neighbours of each cell, clockwise from north: eight arrays (rows, columns), from one padded by 1."""
    height, width = padded.shape[0] - 2, padded.shape[1] - 2
    return [padded[1 + down : 1 + down + height, 1 + right : 1 + right + width] for down, right in _RING]


def _spread(mask: np.ndarray, corners: bool = False) -> np.ndarray:
    """Return a mask with the neighbours of its true cells added, with `corners` also the diagonal ones."""
    return np.logical_or.reduce([mask, *_ring(np.pad(mask, 1))[:: 1 if corners else 2]])
