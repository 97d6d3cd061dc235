"""Observations of the house: everything, or what is in view, with the errors of sensing."""

from __future__ import annotations

import collections
from collections.abc import Mapping
from typing import Any

import numpy as np

from caregiver_mj.house.eyes import RobotEyes
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.sensing import Sensing, Sensor
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import PLACES, Sight

_LOOKS = 5  # control timesteps between updates of the view


class Observer:
    """Observes one episode after another in a house.

    Attributes:
        sensing: Errors, gaps and delay of observations.
        sight: Which children observations show.
        seen: Whether each child is seen or felt, bool (children,).
    """

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
        """Prepare to observe.

        Args:
            plan: The house.
            children: Number of children.
            tables: Rectangles of the tables and heights of their tops, (tables, 5), m.
            control_timestep: Seconds between observations.
            has_robot: Whether the robot is in the house.
            sensing: Errors of observations, as `Sensing.of` takes them; None for exact ones.
            sight: Which children observations show, as `Sight.of` takes it.

        Raises:
            CaregiverError: A number of the sensing is out of range, or the sight is unknown.
        """
        self.sensing, self.sight = Sensing.of(sensing), Sight.of(sight)
        self._plan, self._has_robot = plan, has_robot
        self._eyes = RobotEyes(plan, self.sight) if has_robot and not self.sight.is_full else None
        exact = self.sensing.is_exact
        self._sensor = None if exact else Sensor(self.sensing, control_timestep, tables, layout.things(plan))
        self._shown = 0 if children == 1 else slice(None)  # a single child has no dimension
        self.seen, self._cells_seen = np.ones(children, bool), np.ones((len(plan.free_cells), len(PLACES)))
        self._things_seen: list[np.ndarray] = []  # candles, things on the floor, and gates
        self._things_shown: dict[int, np.ndarray] = {}

    def reset(self, physics: Physics, seed: int) -> None:
        """Begin an episode with a seed of its errors."""
        if self._sensor:
            self._sensor.reset(seed)
        self._things_shown.clear()
        self._look(physics)

    def take_in(self, physics: Physics, step: int) -> None:
        """Update the view after a control timestep with a number, from 1."""
        if step % _LOOKS == 0:
            self._look(physics)
        if self._eyes:
            for touch in physics.touches:
                self.seen[touch.child] |= touch.kind == "robot"

    def observe(self, physics: Physics, step: int) -> dict[str, np.ndarray]:
        """Return the perceived observation, by key; repeated calls in a step return the same."""
        exact = self._all_in_sight(physics)
        return self._sensor.sense(step, exact) if self._sensor else exact

    def _all_in_sight(self, physics: Physics) -> dict[str, np.ndarray]:
        """Return the observation of everything in view, without errors."""
        observation: dict[str, np.ndarray] = collections.OrderedDict()
        places, rates = physics.toddler_positions(), physics.toddler_velocities()
        if not self.sight.is_full:
            places[~self.seen] = rates[~self.seen] = 0.0
            observation["toddler_seen"] = self.seen.astype(float)
            observation["cell_seen"] = self._cells_seen.astype(float)
        observation["toddler_position"], observation["toddler_velocity"] = places[self._shown], rates[self._shown]
        if self._plan.candle_tables:
            poses = self._as_last_seen(0, physics.candle_poses())
            observation["candle_position"] = poses[:, :3]
            observation["candle_orientation"] = poses[:, 3:]
        if self._plan.floor_cells:
            observation["battery_position"] = self._as_last_seen(1, physics.thing_positions())
        if self._plan.mouths:
            observation["gate_position"] = self._as_last_seen(2, physics.gate_positions())
        if self._has_robot:
            observation["base_position"] = physics.base_position()
            observation["base_velocity"] = physics.base_velocity()
            observation["arm_position"] = physics.arm_position()
            observation["arm_velocity"] = physics.arm_velocity()
            observation["finger_position"] = physics.finger_position()
        return observation

    def _as_last_seen(self, kind: int, poses: np.ndarray) -> np.ndarray:
        """Return poses of things: for those out of view, the last seen or initial ones."""
        if not self._things_seen:  # full sight
            return poses
        shown = self._things_shown.setdefault(kind, poses.copy())
        seen = self._things_seen[kind]
        shown[seen] = poses[seen]
        return shown.copy()

    def _look(self, physics: Physics) -> None:
        """Update which children, things and cells are in view."""
        if self._eyes:
            self.seen, things, self._cells_seen = self._eyes.look(physics)
            candles, lying = len(self._plan.candle_tables), len(self._plan.floor_cells)
            self._things_seen = np.split(things, [candles, candles + lying])
