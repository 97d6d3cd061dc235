"""The robot's view at one moment: itself, the children and the candles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.children.walk import BUMP_SPEED, FASTEST
from caregiver_mj.plans import layout
from caregiver_mj.robot.geometry import UPRIGHT, Pose, Vector, upwards

CHILD_RADIUS = layout.CHILD_RADIUS  # m
NO_GATES, NO_THINGS = np.zeros(0), np.zeros((0, 3))
LOOSE = 0.002  # m; release threshold: distance of each finger from the thing that it held
OFF_FLOOR = 0.05  # m; height at which a small thing is off the floor
OFF_TABLE = 0.03  # m; distance from a table's height beyond which a candle is not on it (lying: 0.022)


def loose(things: Sequence[layout.Thing]) -> float:
    """Return the distance of each finger from the middle at which the hand has let go of any of some things, m."""
    return LOOSE + max((thing.radius for thing in things), default=layout.CANDLE_RADIUS)


def off_table(things: Sequence[layout.Thing]) -> np.ndarray:
    """Return the distance from a table's height beyond which each thing does not even lie on it, (things,), m."""
    return np.array([OFF_TABLE + (thing.width - layout.CANDLE_RADIUS) for thing in things])


class ChildView(NamedTuple):
    """The robot's view of one child."""

    position: Vector  # centre (x, y), m
    velocity: Vector  # (vx, vy), m/s


@dataclasses.dataclass(eq=False, slots=True)  # compared by identity, as a key of caches
class View:
    """The robot's view at one moment, in metres and radians."""

    now: float  # s since the episode's start
    base: Pose  # pose (x, y, yaw) of the base
    fingers: float  # total distance of the fingers from the middle
    arm: np.ndarray  # joint positions (joints,)
    children: tuple[ChildView, ...]  # children in sight
    candles: np.ndarray  # position of each candle's foot, (candles, 3)
    candle_orientations: np.ndarray  # quaternions (w, x, y, z), (candles, 4)
    # opening angle of each gate, (gates,)
    gates: np.ndarray = dataclasses.field(default_factory=lambda: NO_GATES)
    # position of each small thing that lay on the floor at first, (things, 3)
    things: np.ndarray = dataclasses.field(default_factory=lambda: NO_THINGS)
    table_heights: np.ndarray | None = None  # of the tables' tops, (tables,); None for the standard height
    age: float = 0.0  # s; age of the observation from which the present is predicted
    unsure: float = 0.0  # distance by which children may be nearer than they seem; 0 if exact
    numbers: tuple[int, ...] | None = None  # numbers of the children in sight; None for all
    # worst places of unseen children: where one may come round a corner or, with a narrow view, where one may be
    lurking: tuple[ChildView, ...] = ()
    hidden: tuple[ChildView, ...] = ()  # possible places of children seen a moment ago
    # heading with the likeliest unseen children; None with a view all round
    gaze: float | None = None
    # m/s; usual and greatest speed of a child's approach
    child_comes: float = BUMP_SPEED
    child_runs: float = FASTEST

    @property
    def unseen(self) -> tuple[ChildView, ...]:
        """Possible places of unseen children at the robot; a view all round shows those round a corner in time."""
        return self.hidden if self.gaze is None else self.hidden + self.lurking

    def child_distance(self, place: Vector | np.ndarray) -> float:
        """Return the distance of a place from the nearest child's centre, m."""
        nearest = math.inf
        for child in self.children:  # a plain loop is faster
            nearest = min(nearest, math.dist(child.position, place))
        return nearest

    @property
    def candle_poses(self) -> np.ndarray:
        """Position and orientation of each candle, (candles, 7)."""
        return np.concatenate([self.candles, self.candle_orientations], axis=1)

    def candle_axis(self, candle: int) -> np.ndarray:
        """Return the unit vector (3,) from a candle's foot to its top, in the house."""
        return upwards(self.candle_orientations[candle])

    def candle_upright(self, candle: int) -> float:
        """Return the cosine of a candle's tilt."""
        _, x, y, _ = self.candle_orientations[candle].tolist()
        return 1 - 2 * (x * x + y * y)

    @property
    def closed_gates(self) -> np.ndarray:
        """Whether each gate is closed, (gates,)."""
        return self.gates < layout.GATE_SHUT

    @property
    def things_gone(self) -> np.ndarray:
        """Whether each small thing is off the floor, (things,)."""
        return self.things[:, 2] > OFF_FLOOR

    def table_height(self, table: int) -> float:
        """Return the height of a table's top, m."""
        return layout.TABLE_HEIGHT if self.table_heights is None else float(self.table_heights[table])

    def stands_on_table(self, candle: int, table: int) -> bool:
        """Return whether a candle is upright at a table's height, so that it can be gripped from the front."""
        height = float(self.candles[candle, 2])
        return abs(height - self.table_height(table)) < OFF_TABLE and self.candle_upright(candle) > UPRIGHT
