"""Observations of the house for policies, of everything or what is in view, and `TaskInfo` beside them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Truth
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.sensing import Sensing, Sensor
from caregiver_mj.interventions.verb import Intervention
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import CAMERA_RANGE, CAMERA_WIDTH, PLACES, Sight, seen_from, visibility
from caregiver_mj.robot.embodiment import Embodiment

_LOOKS = 5  # control steps between updates of the view
_SIDES = np.array([(0.0, 0.0), *ACTIONS])
# m; points of a child's body relative to its centre on the floor. A child is seen if one of them is.
_HEAD = 0.68
_BODY = np.array([(0, 0, 0.15), (0, 0, _HEAD), *((0.08 * x, 0.08 * y, 0.42) for x, y in _SIDES)])
_THING = np.array((0.0, 0.0, 0.05))  # m; point of a thing, above its foot
_ROOM = 0.12  # m; distance from a thing's point within which a hit counts as the thing
_AT_HAND = 1.2  # m from the base's centre; nearer things, perhaps in the hand, are always seen


class Observer:
    """Observes the episodes in a house."""

    seen: np.ndarray  #: whether each child is seen or felt, bool (children,)

    def __init__(
        self,
        plan: FloorPlan,
        children: int,
        tables: np.ndarray,
        control_timestep: float,
        *,
        has_robot: bool = True,
        sensing: Sensing | Mapping[str, Any] | None = None,
        sight: Sight | str = "all",
    ):
        """Prepare to observe every `control_timestep` seconds.

        `tables` are rectangles and heights of the tables' tops, (tables, 5), m. `Sensing.of` takes the errors of
        observations, and `Sight.of` the children that they show.

        Raises:
            CaregiverError: A number of the sensing is out of range, or the sight is unknown.
        """
        self.sensing, self.sight = Sensing.of(sensing), Sight.of(sight)
        self._plan = plan
        self._eyes = RobotEyes(plan, self.sight) if has_robot and not self.sight.is_full else None
        exact = self.sensing.is_exact
        self._sensor = None if exact else Sensor(self.sensing, control_timestep, tables, layout.things(plan))
        self.seen, self._cells_seen = np.ones(children, bool), np.ones((len(plan.free_cells), len(PLACES)))
        # By key of observations: things in view, none for full sight; and their shown values.
        self._things_seen: dict[str, np.ndarray] = {}
        self._things_shown: dict[str, np.ndarray] = {}

    def reset(self, physics: Physics, seed: int) -> None:
        """Begin an episode with the seed of its errors."""
        if self._sensor:
            self._sensor.reset(seed)
        self._things_shown.clear()
        self._look(physics)

    def take_in(self, physics: Physics, step: int) -> None:
        """Update the view after a numbered control step, from 1."""
        if step % _LOOKS == 0:
            self._look(physics)
        if self._eyes:
            for touch in physics.touches:
                self.seen[touch.child] |= touch.kind == "robot"

    def observe(self, physics: Physics, step: int) -> dict[str, np.ndarray]:
        """Return the observation by key, with errors; repeated calls in a step return the same."""
        exact = self._all_in_sight(physics)
        return self._sensor.sense(step, exact) if self._sensor else exact

    def _all_in_sight(self, physics: Physics) -> dict[str, np.ndarray]:
        """Return the observation of everything in view, without errors."""
        exact = {key: view.copy() for key, view in physics.live.items()}
        if self.sight.is_full:
            return exact
        observation = {"toddler_seen": self.seen.astype(float), "cell_seen": self._cells_seen.astype(float)} | exact
        for key in ("toddler_position", "toddler_velocity"):
            np.atleast_2d(observation[key])[~self.seen] = 0.0
        for key in observation.keys() & self._things_seen.keys():  # things out of view are as last seen, or as at first
            shown, seen = self._things_shown.setdefault(key, observation[key]), self._things_seen[key]
            shown[seen] = observation[key][seen]
            observation[key] = shown.copy()
        return observation

    def _look(self, physics: Physics) -> None:
        """Update which children, things and cells are in view."""
        if self._eyes:
            self.seen, things, self._cells_seen = self._eyes.look(physics)
            candles, lying = len(self._plan.candle_tables), len(self._plan.floor_cells)
            on_tables, on_floor, gates = np.split(things, [candles, candles + lying])
            self._things_seen = {
                "candle_position": on_tables,
                "candle_orientation": on_tables,
                "battery_position": on_floor,
                "gate_position": gates,
            }


class RobotEyes:
    """The views of the robot's eye and of ceiling cameras, occluded by walls, furniture and the robot's arm.

    The eye is on a mast, at the site `eye` of the robot's model. Walls count up to the ceiling although they are low;
    rays find other occlusions.
    """

    def __init__(self, plan: FloorPlan, sight: Sight):
        self._plan, self._sight = plan, sight
        over = visibility(plan, sight).ceiling if sight.cameras else ()
        self._ceiling = [np.array([*plan.position(plan.caregiver_cells[cell]), layout.CEILING]) for cell in over]
        self._cells = np.array([plan.position(cell) for cell in plan.free_cells])
        heads = np.pad(plan.cell_size * PLACES, ((0, 0), (0, 1)), constant_values=_HEAD)
        self._heads = (np.pad(self._cells, ((0, 0), (0, 1)))[:, None] + heads).reshape(-1, 3)

    def look(self, physics: Physics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Look once.

        Returns:
            Whether each child is seen, bool (children,); each candle, small thing and gate, bool (things,); and a
            child's head at each place of each free cell, bool (cells, `PLACES`).
        """
        children = np.pad(physics.toddler_positions()[:, :2], ((0, 0), (0, 1)))
        lying = np.concatenate([physics.candle_poses()[:, :3], physics.thing_positions()])
        things = np.concatenate([lying + _THING, physics.panel_positions()])
        points = np.concatenate([(children[:, None] + _BODY).reshape(-1, 3), self._heads, things])
        ends = len(children) * len(_BODY), len(points) - len(things)
        bodies = np.array(physics.touch_reader.bodies)
        own = np.full(len(points), -1)
        own[: ends[0]] = bodies.repeat(len(_BODY))
        room = np.where(np.arange(len(points)) < ends[1], 0.0, _ROOM)
        found = np.zeros(len(points), bool)
        looks = []  # points in view of each camera, and the geoms that rays hit
        x, y, yaw = physics.base_position().tolist()
        eye = physics.eye_position()
        # Beside a wall the eye is in the wall's cell, which is wider than the wall: test from the base's centre.
        for camera, middle in ((eye, np.array((x, y))), *((camera, camera[:2]) for camera in self._ceiling)):
            in_view = seen_from(self._plan, middle, points[:, :2])
            if camera is eye and self._sight.turns:
                to = points[:, :2] - eye[:2]
                far, ahead = np.linalg.norm(to, axis=1), to[:, 0] * np.cos(yaw) + to[:, 1] * np.sin(yaw)
                in_view &= (far <= CAMERA_RANGE) & (ahead >= np.cos(CAMERA_WIDTH / 2) * far)
            which = np.flatnonzero(in_view)
            geom, free = physics.first_hits(camera, points[which])
            far = np.linalg.norm(points[which] - camera, axis=1)
            found[which] |= (free >= far - room[which]) | (geom == own[which])
            looks.append((which, geom))
        seen = found[: ends[0]].reshape(len(children), -1).any(axis=1)
        for which, geom in looks:  # an unseen child must not reveal itself by hiding something
            found[which] |= np.isin(geom, bodies[~seen])
        away = np.linalg.norm(things[:, :2] - (x, y), axis=1)
        cells = found[ends[0] : ends[1]].reshape(len(self._cells), -1)
        # A child in the base's own cell would be felt.
        assert physics.embodiment is not None  # it has the eye
        felt = physics.embodiment.footprint + layout.CHILD_RADIUS - PLACES.max() * self._plan.cell_size
        cells[np.linalg.norm(self._cells - (x, y), axis=1) < felt] = True
        return np.asarray(seen), found[ends[1] :] | (away < _AT_HAND), cells


@dataclasses.dataclass(frozen=True)
class TaskInfo:
    """Information for policies beside observations."""

    plan: FloorPlan  # the house
    family: ChildGroup  # the children
    embodiment: Embodiment | None  # the robot, if any
    sensing: Sensing  # errors, gaps and delay of observations
    sight: Sight  # which children observations show
    novice_timestep: float  # s
    child_speed: float  # m/s, at which the children walk
    # m; heights of the tables' tops, (tables,), if observations show them; else None
    table_heights: np.ndarray | None
    # returns the order in an observation; None if the task leaves the choice to the caregiver
    orders: Callable[[Mapping[str, np.ndarray]], Intervention | None] | None
    caregiver_seed: int  # seed of this episode for a random caregiver
    starting_tables: tuple[int, ...]  # index of each candle's table at the start of this episode
    truth: Callable[[], Truth]  # hidden state, for a `PrivilegedCaregiver` only
