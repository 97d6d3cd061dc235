"""Small things on the floor, and those that children have taken."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.house.children import Children
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State, Where
from caregiver_mj.robot import geometry
from caregiver_mj.robot.geometry import Vector
from caregiver_mj.robot.view import OFF_FLOOR

_OFFSET = 0.2  # metres off the middle of its cell at the start, at most, in x and in y
_FARTHEST = 1.5  # cells between two points of one cell, and more
_MOUTH = 0.09, 0.62  # metres ahead of a child's axis, and above the floor: inside its body, where nothing touches it


class Things:
    """Tracks the small things of one episode.

    A child takes what lies in the cell that it comes into, as in the grid, unless the robot has got hold of it. It has
    no hands: from then on the thing is put, at every control timestep, where the child's mouth is. That alone is not
    done by forces, as the child's own walk is not.
    """

    def __init__(self, plan: FloorPlan):
        self._plan, self._kinds = plan, [hazard.kind.name for hazard in plan.hazards.at(Where.FLOOR)]
        self._taken = [NOTHING] * len(self._kinds)  # by which child each has been taken
        self._is_off = [False] * len(self._kinds)  # the floor

    def reset(self, physics: Physics, random: np.random.RandomState) -> None:
        """Place each in its cell at the start of an episode."""
        for i, cell in enumerate(self._plan.floor_cells):
            middle = self._plan.position(self._plan.free_cells[cell])
            place = middle + random.uniform(-_OFFSET, _OFFSET, size=2)
            physics.set_thing(i, (*place, 0.0), random.uniform(-np.pi, np.pi))
            self._taken[i], self._is_off[i] = NOTHING, False

    def go_along(self, physics: Physics) -> None:
        """Move the things that children have taken along with them."""
        ahead, height = _MOUTH
        for i, child in enumerate(self._taken):
            if child != NOTHING:
                x, y, yaw = physics.toddler_position(child).tolist()
                physics.set_thing(i, (*geometry.to_world((x, y, yaw), (ahead, 0.0)), height), yaw)

    def take_in(self, physics: Physics, children: Children) -> None:
        """Update which things are off the floor or taken, after a control timestep."""
        for i, place in enumerate(physics.thing_positions().tolist()):
            is_off = self._taken[i] != NOTHING or place[2] > OFF_FLOOR
            if not is_off:
                taker = next((k for k, child in enumerate(children) if self._is_at(child.position, place)), NOTHING)
                if taker != NOTHING and not physics.robot_touches_thing(i):
                    self._taken[i], is_off, children[taker].holds = taker, True, True
                    children.hurt(taker, self._kinds[i])
                    self.go_along(physics)
            if is_off != self._is_off[i]:
                self._is_off[i] = is_off
                states = self._plan.hazards.split(children.state)[2]
                states[i] = State.GONE if is_off else State.AS_PLANNED

    def _is_at(self, child: Vector, place: Sequence[float]) -> bool:
        """Return whether a child is in the cell of a place."""
        is_near = math.dist(child, place[:2]) < _FARTHEST * self._plan.cell_size
        return is_near and self._plan.cell_at(child) == self._plan.cell_at(place)
