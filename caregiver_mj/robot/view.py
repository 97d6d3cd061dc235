"""What the robot sees at one moment: itself, the children and the candles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.robot.geometry import UPRIGHT, Pose, Vector, upwards

CHILD_RADIUS = layout.CHILD_RADIUS  # metres
NO_GATES, NO_THINGS = np.zeros(0), np.zeros((0, 3))
LOOSE = 0.002  # metres of each finger off what it has held from which on the hand has let go of that
OFF_FLOOR = 0.05  # metres above the floor from which on something small does not lie there any more
OFF_TABLE = 0.03  # metres from a table's height beyond which a candle is not on it (one that lies there: 0.022)


def loose(things: Sequence[layout.Thing]) -> float:
    """Return the metres of each finger off the middle from which on the hand has let go of any of some things."""
    return LOOSE + max((thing.radius for thing in things), default=layout.CANDLE_RADIUS)


def off_table(things: Sequence[layout.Thing]) -> np.ndarray:
    """Return the metres from a table's height beyond which each of some things does not even lie on it, (things,)."""
    return np.array([OFF_TABLE + (thing.width - layout.CANDLE_RADIUS) for thing in things])


class ChildView(NamedTuple):
    """What the robot sees of one child.

    Attributes:
        position: Its middle (x, y), metres.
        velocity: How it moves (vx, vy), m/s.
    """

    position: Vector
    velocity: Vector


@dataclasses.dataclass(eq=False, slots=True)  # to look up what has been worked out of it
class View:
    """What the robot sees at one moment, in metres and radians.

    Attributes:
        now: Seconds since the episode's start.
        base: Pose (x, y, yaw) of its base.
        fingers: How far the fingers stand off the middle, both together.
        arm: Joint positions (joints,), radians.
        children: All children in the house that are seen.
        candles: Position of each candle's foot, (candles, 3).
        candle_orientations: Its orientation, a quaternion (w, x, y, z), (candles, 4).
        gates: How far each gate stands open, (gates,), radians.
        things: Where each small thing is that lay on the floor at first, (things, 3).
        table_heights: How high the tables' tops are, (tables,); None if as usual.
        age: Seconds since all this was observed; what it is now is foretold from that.
        unsure: Metres by which children may be nearer than they seem; 0 if all is seen exactly.
        numbers: Which children these are; None if they are all that there are.
        lurking: Where a child that is not seen may come round a corner, at the worst; where it may be, for a robot that
            does not see all round.
        hidden: Where one that was seen a moment ago may have come to.
        gaze: Heading in which it sees most of where children may be that it does not see; None if it sees all round.
    """

    now: float
    base: Pose
    fingers: float
    arm: np.ndarray
    children: tuple[ChildView, ...]
    candles: np.ndarray
    candle_orientations: np.ndarray
    gates: np.ndarray = dataclasses.field(default_factory=lambda: NO_GATES)
    things: np.ndarray = dataclasses.field(default_factory=lambda: NO_THINGS)
    table_heights: np.ndarray | None = None
    age: float = 0.0
    unsure: float = 0.0
    numbers: tuple[int, ...] | None = None
    lurking: tuple[ChildView, ...] = ()
    hidden: tuple[ChildView, ...] = ()
    gaze: float | None = None

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
        height, (_, x, y, _) = float(self.candles[candle, 2]), self.candle_orientations[candle].tolist()
        return abs(height - self.table_height(table)) < OFF_TABLE and 1 - 2 * (x * x + y * y) > UPRIGHT
