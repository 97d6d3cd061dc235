"""Visibility in the grid: walls are opaque, and everything else is lower than a child.

A *sight* determines which children a caregiver sees:

- `all`: everything, always, as in the paper;
- `walls`: in all directions, up to the walls;
- `camera`: 90 degrees in the direction of its base, up to 5 m;
- `rooms:N`: that camera, and N on the ceiling that see in all directions up to the walls. Each hangs over the cell from
  which it adds most to the view of those before.
"""

from __future__ import annotations

import dataclasses
import functools
import re

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.cell_graph import ACTIONS, WALL
from caregiver_mj.plans.floor_plan import FloorPlan

CAMERA_RANGE = 5.0  # m; range at which a camera of a usual mobile robot recognises a child
CAMERA_WIDTH = np.deg2rad(90.0)  # rad
BODY = 0.2  # cells; half of a child's width
# Places in a cell, from its centre in units of its size. A cell is in view if a child would be seen in all of them.
# The first is the centre, from which children walk to the others.
PLACES = 0.3 * np.array([(0.0, 0.0), *ACTIONS])
ALL_ROUND = len(ACTIONS)  # heading of a caregiver that turns round once
_ROUNDING = 1e-9
_MOST_LOOKOUTS = 12


@dataclasses.dataclass(frozen=True)
class Sight:
    """A caregiver's sight of children."""

    name: str = "all"  #: `all`, `walls`, `camera` or `rooms`
    cameras: int = 0  #: number of ceiling cameras

    @classmethod
    def of(cls, text: str | Sight) -> Sight:
        """Parse `all`, `walls`, `camera` or `rooms:N`, or raise CaregiverError."""
        if isinstance(text, Sight):
            return text
        found = re.fullmatch(r"all|walls|camera|(rooms):(\d{1,9})", str(text), re.ASCII)
        if not found:
            raise CaregiverError(f"sight must be all, walls, camera or rooms:N, got {text!r}")
        return cls(found[1] or found[0], int(found[2] or 0))

    def __str__(self) -> str:
        return f"{self.name}:{self.cameras}" if self.name == "rooms" else self.name

    @property
    def is_full(self) -> bool:
        """Whether everything is seen."""
        return self.name == "all"

    @property
    def turns(self) -> bool:
        """Whether the view depends on the caregiver's heading."""
        return self.name in ("camera", "rooms")


FULL = Sight()


class Visibility:
    """The free cells in view from each caregiver cell.

    `seen` is by cell, heading (a move or `ALL_ROUND`) and free cell, bool (caregiver cells, moves + 1, free cells); the
    caregiver's own cell always is. `ceiling` are the caregiver cells under ceiling cameras.
    """

    def __init__(self, plan: FloorPlan, sight: Sight):
        walls = _up_to_walls(plan)
        free = len(plan.free_cells)
        in_view = walls[:, None].repeat(ALL_ROUND + 1, axis=1)
        if sight.turns:
            here, there = np.array(plan.caregiver_cells), np.array(plan.free_cells)
            to = there - here[:, None]  # (caregiver cells, free cells, 2), rows and columns
            far = np.linalg.norm(to, axis=2)
            ahead = np.stack([to @ np.array(move) for move in ACTIONS], axis=1)
            within = ahead >= np.cos(CAMERA_WIDTH / 2) * far[:, None] - _ROUNDING
            near = far * plan.cell_size <= CAMERA_RANGE + _ROUNDING
            in_view[:, :ALL_ROUND] &= within
            in_view &= near[:, None]
        self.ceiling = _greedy(walls[:free], sight.cameras)
        if sight.cameras:
            in_view |= walls[list(self.ceiling)].any(axis=0)
        self.seen = np.ones_like(in_view) if sight.is_full else in_view


def seen_from(plan: FloorPlan, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return whether points, (n, 2), m, are seen from an eye, (2,), up to the walls, bool (n,)."""
    height, width = plan.shape

    def rows_columns(positions: np.ndarray) -> np.ndarray:
        x, y = np.moveaxis(positions, -1, 0) / plan.cell_size
        return np.stack([(height - 1) / 2 - y, x + (width - 1) / 2], axis=-1)

    return ~_crosses(plan.symbols == WALL, rows_columns(eye), rows_columns(points))


@functools.lru_cache(maxsize=16)
def visibility(plan: FloorPlan, sight: Sight) -> Visibility:
    """Return the cached visibility in a house with a sight."""
    return Visibility(plan, sight)


@functools.lru_cache(maxsize=16)
def lookouts(plan: FloorPlan) -> tuple[int, ...]:
    """Return at most 12 free cells that together see most of the house, up to the walls."""
    return _greedy(_up_to_walls(plan)[: len(plan.free_cells)], _MOST_LOOKOUTS)


def _greedy(seen: np.ndarray, most: int) -> tuple[int, ...]:
    """Return rows of `seen`, bool (n, cells), each adding most to the cells covered by those before."""
    chosen: list[int] = []
    missing = np.ones(seen.shape[1], bool)
    while len(chosen) < most and missing.any():
        gain = (seen & missing).sum(axis=1)
        chosen.append(int(gain.argmax()))
        missing &= ~seen[chosen[-1]]
    return tuple(chosen)


def _up_to_walls(plan: FloorPlan) -> np.ndarray:
    """Return whether each free cell is seen from each caregiver cell, bool (caregiver cells, free cells).

    A child is seen if a straight line from the centre of the caregiver's cell to its centre or one of its sides crosses
    no wall. A line may touch a wall's corner.
    """
    opaque = plan.symbols == WALL
    here, there = np.array(plan.caregiver_cells, float), np.array(plan.free_cells, float)
    points = there[:, None] + BODY * np.array([(0.0, 0.0), *ACTIONS])  # (free cells, 5, 2)
    seen = np.empty((len(here), len(there)), bool)
    for number, eye in enumerate(here):
        seen[number] = ~_crosses(opaque, eye, points.reshape(-1, 2)).reshape(len(there), -1).all(axis=1)
    return seen


def _crosses(opaque: np.ndarray, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return whether the line from an eye to each point, (n, 2), crosses a wall, bool (n,).

    At each crossing between cells, both must be clear. Cell (r, c) extends from r - 1/2 to r + 1/2 and from c - 1/2 to
    c + 1/2.
    """
    crosses = np.zeros(len(points), bool)
    for axis in (0, 1):
        along, across = points[:, axis] - eye[axis], points[:, 1 - axis] - eye[1 - axis]
        edges = np.arange(opaque.shape[axis] - 1) + 0.5
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (edges - eye[axis]) / along[:, None]  # of the way, (n, edges)
        met = (share > 0) & (share < 1)
        at = eye[1 - axis] + np.where(met, share, 0.0) * across[:, None]
        for side in (0, 1):
            # A line on the edge between two cells crosses them only if both are walls.
            cells = [
                opaque.swapaxes(0, axis)[np.arange(len(edges)) + side, np.rint(at + nudge).astype(int)]
                for nudge in (-1e-6, 1e-6)
            ]
            crosses |= (met & cells[0] & cells[1]).any(axis=1)
    return crosses
