"""What a base must not do beside a child, whatever it is told: push, or slide along it fast."""

from __future__ import annotations

import math

from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.separation import FOLLOWING_SPEED, GENTLE_GAP, SLIDE_SPEED, TOUCHING_GAP, gap_to
from caregiver_mj.robot.view import View

_TOUCHED = 0.002  # metres to a child that touches the base, or does so at the next control timestep
_BRAKES, _BRAKES_GENTLY = 1.5, 1.0  # m/s^2 with which a base brakes that is touched, and one that nearly is
_STRAYS = 0.04  # radians by which a child that goes along has moved on since it was seen
_GIVES_BACK = 1.0  # m/s^2 with which a base gets back what has been taken away
_SHARE = 0.9  # of the base's acceleration, together with what it does on its path meanwhile


class Restraint:
    """Takes from a base's velocity what pushes a child, and gives it back when the child has gone.

    What the base is told is more than its planned velocity: feedback takes it back to where it should be, and so
    towards a child that has pushed it off.
    """

    def __init__(self, robot: Embodiment, control_timestep: float):
        """Prepares it.

        Args:
            robot: The robot.
            control_timestep: Seconds between two calls.
        """
        self._robot, self._timestep = robot, control_timestep
        self.reset()

    def reset(self) -> None:
        """Begins an episode at rest."""
        self._told: Vector = (0.0, 0.0)  # the last velocity, m/s
        self._taken: Vector = (0.0, 0.0)  # what of it had been taken away

    def __call__(self, view: View, velocity: Vector) -> Vector:
        """What is left of the velocity, m/s, that the base would be told for the coming control timestep."""
        vx, vy = told = self._without_push(view, self._given_back(velocity))
        self._told, self._taken = told, (velocity[0] - vx, velocity[1] - vy)
        return told

    def _given_back(self, velocity: Vector) -> Vector:
        """The velocity without what is still to be given back of it.

        Without it the base would have two accelerations at once: that of its path, and this one.
        """
        taken = math.hypot(*self._taken)
        if taken < 1e-9:
            return velocity
        x, y = self._taken[0] / taken, self._taken[1] / taken
        taken = min(taken, max(0.0, velocity[0] * x + velocity[1] * y))  # of a velocity that has got less: not more
        left = (velocity[0] - taken * x, velocity[1] - taken * y)
        # left + back * (x, y) differs from what it was told last by no more than this, solved for the largest back
        most = _SHARE * self._robot.limits.base_acceleration * self._timestep
        change_x, change_y = left[0] - self._told[0], left[1] - self._told[1]
        along, across = change_x * x + change_y * y, change_x * y - change_y * x
        room = math.sqrt(max(0.0, most**2 - across**2)) - along
        back = min(taken, max(0.0, min(room, _GIVES_BACK * self._timestep)))
        return left[0] + back * x, left[1] + back * y

    def _without_push(self, view: View, velocity: Vector) -> Vector:
        """The velocity without what in it leads towards a child that touches the base, or fast along one nearby."""
        (vx, vy), before, robot = velocity, self._told, self._robot
        for child in view.children:
            gap = gap_to(view.base, robot, child)
            if gap < GENTLE_GAP:
                dx, dy = child.position[0] - view.base[0], child.position[1] - view.base[1]
                away = math.hypot(dx, dy)
                x, y = dx / away, dy / away
                brakes = self._timestep * (_BRAKES if gap < _TOUCHED else _BRAKES_GENTLY)
                towards = vx * x + vy * y
                if gap < TOUCHING_GAP:
                    towards = min(towards, max(0.0, before[0] * x + before[1] * y - brakes))
                slower = robot.limits.slowing(max(0.0, gap) / FOLLOWING_SPEED - view.age)
                slides = max(0.0, SLIDE_SPEED + _STRAYS * min(0.0, towards)) + slower
                most = max(slides, abs(before[1] * x - before[0] * y) - brakes)
                across = min(most, max(-most, vy * x - vx * y))
                vx, vy = towards * x - across * y, towards * y + across * x
        return vx, vy
