"""A child's body on a spring and damper behind its walk, and soft to the touch: an option of the tasks.

As it is, a child goes where its walk takes it, whatever stands there: between two control timesteps it is a free body
of 12 kg, and then it is put back. So the forces between it and the robot are those of a wall that a servo leans on. A
compliant child is pushed aside instead: its feet follow the walk, its body sways over them, and when it has been pushed
farther than its feet reach it steps. Where nothing touches it, it walks as ever.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from caregiver_mj.children.walk import ToddlerWalk

if TYPE_CHECKING:
    from caregiver_mj.house.physics import Physics

MASS = 12.0  # kg, as in models/toddler.xml
_GRAVITY = 9.81  # m/s^2
_CENTRE = 0.46  # metres above the floor: 57 % of its height, own
# What keeps an inverted pendulum up, m g over its height, is the least that a standing child has; people who stand
# quietly have little more (Winter et al., "Stiffness control of balance in quiet standing", J Neurophysiol 80, 1998).
STANCE = MASS * _GRAVITY / _CENTRE  # N/m: 256
_DAMPING_RATIO = 0.7  # own
SWAY = 2 * _DAMPING_RATIO * math.sqrt(STANCE * MASS)  # N s/m
STRIDE = 0.06  # metres off its feet from which on it steps: half the length of a foot of 12 cm; that is 15 N
# Its surface is as soft as an adult's chest or pelvis, 25 N/mm (ISO/TS 15066:2016, annex A; DGUV 2011). MuJoCo's
# stiffness is per effective mass, here that of child and robot, 10.5 kg: 1 / (time constant * damping ratio)^2.
SOFTNESS = 0.051, 0.4  # time constant in seconds, damping ratio
_ROUNDING = 1e-9  # metres, or m/s, that are none


class CompliantBody:
    """The body of one child."""

    def reset(self, walk: ToddlerWalk) -> None:
        """Begins an episode, upright."""
        self._feet, self._pace = walk.position, (0.0, 0.0)

    def follow(self, walk: ToddlerWalk, physics: Physics, number: int, seconds: float) -> None:
        """Has the body follow the walk for one control timestep.

        Args:
            walk: Where its feet are now, after the walk's step. If it is pushed too far, they step after it.
            physics: The simulation.
            number: Which child it is.
            seconds: Of the control timestep.
        """
        (x, y, _), (vx, vy, _) = physics.toddler_position(number), physics.toddler_velocities()[number]
        lean = _none(float(x) - self._feet[0]), _none(float(y) - self._feet[1])
        sway = _none(float(vx) - self._pace[0]), _none(float(vy) - self._pace[1])
        far = math.hypot(*lean)
        if far > STRIDE:
            step = 1.0 - STRIDE / far
            walk.carry(step * lean[0], step * lean[1])
            lean = lean[0] * (1.0 - step), lean[1] * (1.0 - step)
        force = -STANCE * lean[0] - SWAY * sway[0], -STANCE * lean[1] - SWAY * sway[1]
        physics.set_toddler(walk, number, lean, sway, force)
        # Where its feet will be when this is asked again, for the physics carries them on.
        self._pace = walk.velocity
        self._feet = walk.position[0] + seconds * walk.velocity[0], walk.position[1] + seconds * walk.velocity[1]


def _none(value: float) -> float:
    """Nothing, for what is rounding only: then the body is exactly where the walk is."""
    return 0.0 if abs(value) < _ROUNDING else value
