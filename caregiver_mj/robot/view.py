"""What the robot sees at one moment: itself, the children and the candles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.children.walk import BUMP_SPEED, FASTEST
from caregiver_mj.plans import layout
from caregiver_mj.robot.geometry import UPRIGHT, Pose, Vector, upwards

CHILD_RADIUS = layout.CHILD_RADIUS  # metres
NO_GATES, NO_THINGS = np.zeros(0), np.zeros((0, 3))
LOOSE = 0.002  # m; release threshold: how far each finger is off what it has held
OFF_FLOOR = 0.05  # metres above the floor from which on something small does not lie there any more
OFF_TABLE = 0.03  # metres from a table's height beyond which a candle is not on it (one that lies there: 0.022)


def loose(things: Sequence[layout.Thing]) -> float:
    """Return the metres of each finger off the middle from which on the hand has let go of any of some things."""
    return LOOSE + max((thing.radius for thing in things), default=layout.CANDLE_RADIUS)


def off_table(things: Sequence[layout.Thing]) -> np.ndarray:
    """Return the metres from a table's height beyond which each of some things does not even lie on it, (things,)."""
    return np.array([OFF_TABLE + (thing.width - layout.CANDLE_RADIUS) for thing in things])


class ChildView(NamedTuple):
    """What the robot sees of one child."""

    position: Vector  # its middle (x, y), metres
    velocity: Vector  # how it moves (vx, vy), m/s


@dataclasses.dataclass(eq=False, slots=True)  # to look up what has been worked out of it
class View:
    """What the robot sees at one moment, in metres and radians."""

    now: float  # seconds since the episode's start
    base: Pose  # pose (x, y, yaw) of its base
    fingers: float  # how far the fingers stand off the middle, both together
    arm: np.ndarray  # joint positions (joints,), radians
    children: tuple[ChildView, ...]  # all children in the house that are seen
    candles: np.ndarray  # position of each candle's foot, (candles, 3)
    candle_orientations: np.ndarray  # its orientation, a quaternion (w, x, y, z), (candles, 4)
    # how far each gate stands open, (gates,), radians
    gates: np.ndarray = dataclasses.field(default_factory=lambda: NO_GATES)
    # where each small thing is that lay on the floor at first, (things, 3)
    things: np.ndarray = dataclasses.field(default_factory=lambda: NO_THINGS)
    table_heights: np.ndarray | None = None  # how high the tables' tops are, (tables,); None if as usual
    age: float = 0.0  # seconds since all this was observed; what it is now is foretold from that
    unsure: float = 0.0  # metres by which children may be nearer than they seem; 0 if all is seen exactly
    numbers: tuple[int, ...] | None = None  # which children these are; None if they are all that there are
    # where a child that is not seen may come round a corner, at the worst; where it may be, for a robot that does not
    # see all round
    lurking: tuple[ChildView, ...] = ()
    hidden: tuple[ChildView, ...] = ()  # where one that was seen a moment ago may have come to
    # heading in which it sees most of where children may be that it does not see; None if it sees all round
    gaze: float | None = None
    # m/s; with which a child may come, and at most, should it run
    child_comes: float = BUMP_SPEED
    child_runs: float = FASTEST

    @property
    def unseen(self) -> tuple[ChildView, ...]:
        """Where children may be beside the robot unseen: who sees all round sees one come round a corner in time."""
        return self.hidden if self.gaze is None else self.hidden + self.lurking

    def child_distance(self, place: Vector | np.ndarray) -> float:
        """Return the metres from a place to the middle of the nearest child."""
        nearest = math.inf
        for child in self.children:  # a plain loop: this is asked at every control timestep
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
        """Return how high a table's top is."""
        return layout.TABLE_HEIGHT if self.table_heights is None else float(self.table_heights[table])

    def stands_on_table(self, candle: int, table: int) -> bool:
        """Return whether a candle is upright and as high as a table, so that it can be gripped from the front."""
        height = float(self.candles[candle, 2])
        return abs(height - self.table_height(table)) < OFF_TABLE and self.candle_upright(candle) > UPRIGHT
