"""Portable things of the house: candles and hot drinks on tables, small things on the floor."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.house.children import Children
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE, NOTHING, HazardKind, State, Where
from caregiver_mj.recording.ledger import FAR, FLAME_CLEAR, WAX_CLEAR, Contacts
from caregiver_mj.robot.geometry import Vector, to_world, upwards
from caregiver_mj.robot.view import CHILD_RADIUS, OFF_FLOOR, off_table

_BELOW = 0.05  # m; depth below a table's top at which a candle has fallen down
FLAME_RADIUS = 0.016  # m, as in models/candle.xml
_FLAME = np.linspace(0.170 + FLAME_RADIUS, 0.246 - FLAME_RADIUS, 3)  # m; spheres along its axis, above its foot
_BODY = 0.15, 0.68  # m; ends of the axis of a child's body above the floor, as in models/toddler.xml
_IN_HAND = 0.04  # m; greatest distance of a held candle's axis from the fingertips' middle
_SPHERES = 8  # along the body of a carried thing
_LENGTH = 0.30  # m; more than the distance of a held candle's farthest part from the fingertips' middle


class Candles:
    """Tracks the candles of one episode."""

    starting_tables: list[int]  #: index of each candle's table at the start of the episode

    def __init__(self, table_rectangles: np.ndarray, table_heights: np.ndarray | None = None):
        """Take the tables' rectangles as of `plans.layout`, (tables, 4), and heights, (tables,), m."""
        self.table_rectangles = table_rectangles
        usual = np.full(len(table_rectangles), layout.TABLE_HEIGHT)
        self.table_heights = usual if table_heights is None else table_heights
        self._lowest = self.table_heights.min(initial=layout.TABLE_HEIGHT) - _BELOW
        self.reset([])

    def reset(self, starting_tables: Sequence[int]) -> None:
        """Begin an episode with each candle on a table."""
        self.starting_tables = list(starting_tables)
        self._fallen: set[int] = set()

    def standing(self, physics: Physics) -> np.ndarray:
        """Return whether each candle is upright, and no lower than a table, (candles,)."""
        high = physics.candle_poses()[:, 2] > self._lowest
        return high & (physics.candle_upright() > np.cos(np.radians([kind.upset for kind in physics.carried])))

    def count_fallen(self, physics: Physics) -> int:
        """Return the number that have fallen since the last call."""
        fallen = set(np.flatnonzero(~self.standing(physics)).tolist())
        count = len(fallen - self._fallen)
        self._fallen = fallen
        return count

    def are_on(self, physics: Physics, table: int) -> np.ndarray:
        """Return whether each candle stands or lies on a table, (candles,)."""
        x, y, half_x, half_y = self.table_rectangles[table]
        poses = physics.candle_poses()
        over = (np.abs(poses[:, 0] - x) < half_x) & (np.abs(poses[:, 1] - y) < half_y)
        off = off_table([layout.thing(kind) for kind in physics.carried])
        return over & (np.abs(poses[:, 2] - self.table_heights[table]) < off)


def watch_candle(physics: Physics, seconds: float, tally: Contacts) -> None:
    """Count the distances of a candle in the hand, if any, for a control step, s."""
    if not physics.is_gripping():
        return
    pinch, children = physics.pinch_position(), physics.toddler_positions()
    x, y, _ = pinch.tolist()
    counts = max(FLAME_CLEAR, WAX_CLEAR, tally.flame_distance, tally.wax_distance)  # greater distances do not matter
    if all(math.hypot(x - cx, y - cy) > counts + _LENGTH + CHILD_RADIUS for cx, cy, _ in children.tolist()):
        return
    poses = physics.candle_poses()
    if not len(poses):
        return
    axes = upwards(poses[:, 3:])
    from_foot = pinch - poses[:, :3]
    bodies = _bodies(physics.carried)
    along = np.clip((from_foot * axes).sum(axis=1), bodies[:, 0], bodies[:, -1])
    off = np.linalg.norm(from_foot - along[:, None] * axes, axis=1)
    nearest = int(off.argmin())
    if off[nearest] > _IN_HAND:
        return
    kind = physics.carried[nearest]
    spheres = np.concatenate([bodies[nearest], _FLAME if kind is CANDLE else ()])
    distances = _distances(poses[nearest, :3] + spheres[:, None] * axes[nearest], children[:, :2])
    wax = min(distances[:_SPHERES]) - CHILD_RADIUS - layout.thing(kind).width
    flame = min(distances[_SPHERES:], default=math.inf) - CHILD_RADIUS - FLAME_RADIUS
    tally.carry(min(FAR, max(0.0, flame)), min(FAR, max(0.0, wax)), seconds)


@functools.cache
def _bodies(kinds: tuple[HazardKind, ...]) -> np.ndarray:
    """Return spheres as wide as things along their axes, without flames: heights above the foot, (things, n), m."""
    things = [layout.thing(kind) for kind in kinds]
    return np.array([np.linspace(thing.width, thing.height - thing.width, _SPHERES) for thing in things])


def _distances(points: np.ndarray, children: np.ndarray) -> list[float]:
    """Return the distance of each point (n, 3) from the axis of the nearest child (children, 2), m."""
    across = np.linalg.norm(points[:, None, :2] - children, axis=2)  # (n, children)
    low, high = _BODY
    beyond = np.maximum(0.0, np.maximum(points[:, 2] - high, low - points[:, 2]))
    return np.hypot(across, beyond[:, None]).min(axis=1).tolist()


_OFFSET = 0.2  # m; greatest initial offset from its cell's centre in x and in y
_FARTHEST = 1.5  # cells; more than the distance of two points in one cell
_MOUTH = 0.09, 0.62  # m ahead of a child's axis, and above the floor: inside its body, without contacts


class Things:
    """Tracks the small things of one episode.

    A child takes a thing in the cell that it enters, as in the grid, unless the robot holds it. It has no hands: from
    then on the thing is placed at its mouth at every control step. Like the child's own walk, this uses no forces.
    """

    def __init__(self, plan: FloorPlan):
        self._plan, self._kinds = plan, [hazard.kind.name for hazard in plan.hazards.at(Where.FLOOR)]
        self._near = _FARTHEST * plan.cell_size
        self._taken = [NOTHING] * len(self._kinds)  # child that has taken each
        self._is_off = [False] * len(self._kinds)  # whether each is off the floor

    def reset(self, physics: Physics, random: np.random.RandomState) -> None:
        """Place each thing in its cell at the start of an episode."""
        for i, cell in enumerate(self._plan.floor_cells):
            middle = self._plan.position(self._plan.free_cells[cell])
            place = middle + random.uniform(-_OFFSET, _OFFSET, size=2)
            physics.set_thing(i, (*place, 0.0), random.uniform(-np.pi, np.pi))
            self._taken[i], self._is_off[i] = NOTHING, False

    def go_along(self, physics: Physics) -> None:
        """Move taken things with their children."""
        ahead, height = _MOUTH
        for i, child in enumerate(self._taken):
            if child != NOTHING:
                x, y, yaw = physics.toddler_position(child).tolist()
                physics.set_thing(i, (*to_world((x, y, yaw), (ahead, 0.0)), height), yaw)

    def take_in(self, physics: Physics, children: Children) -> None:
        """Update which things are off the floor or taken, after a control step."""
        places = [child.position for child in children]
        for i, place in enumerate(physics.live["battery_position"].tolist()):
            is_off = self._taken[i] != NOTHING or place[2] > OFF_FLOOR
            if not is_off:
                taker = next((k for k, child in enumerate(places) if self._is_at(child, place)), NOTHING)
                if taker != NOTHING and not physics.robot_touches_thing(i):
                    self._taken[i], is_off, children[taker].holds = taker, True, True
                    children.hurt(taker, self._kinds[i])
                    self.go_along(physics)
            if is_off != self._is_off[i]:
                self._is_off[i] = is_off
                states = self._plan.hazards.split(children.state)[2]
                states[i] = State.GONE if is_off else State.AS_PLANNED

    def _is_at(self, child: Vector, place: Sequence[float]) -> bool:
        is_near = math.hypot(child[0] - place[0], child[1] - place[1]) < self._near
        return is_near and self._plan.cell_at(child) == self._plan.cell_at(place)
