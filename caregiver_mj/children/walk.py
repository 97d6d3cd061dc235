"""Kinematics of a toddler in the house: from cell to cell, or into an obstacle and back."""

from __future__ import annotations

import math
from collections.abc import Iterable

from caregiver_mj.errors import check_number
from caregiver_mj.plans.floor_plan import DEFAULT_CELL_SIZE

Vector = tuple[float, float]

WALKING_SPEED = 1.6 / 3.6  # m/s, of 1 to 2 year olds (paper, section V.C)
# At that speed; both grow in proportion to a child's speed, whose timestep shrinks.
BUMP_SPEED = 0.62  # m/s; greatest speed towards an obstacle: a bump into any wall fits into a timestep
FASTEST = 1.0  # m/s; greatest speed, after turning back late
SLOWEST_CHILD, FASTEST_CHILD = 0.1, 1.0  # m/s; range of children's speeds
_TURN_RATE = 8.0  # 1/s; gain from heading error to turning rate
_FRONTAL = 0.2  # cosine between motion and contact above which the contact is in the way
_HALF_WAY = 0.5  # share of a move up to which a blocked toddler turns back


def check_speed(child_speed: float) -> float:
    """Return a child's speed, m/s, as a float; raise CaregiverError outside of the accepted range."""
    check_number("child_speed, in m/s,", child_speed, SLOWEST_CHILD, FASTEST_CHILD)
    return float(child_speed)


def novice_timestep(
    control_timestep: float, cell_size: float = DEFAULT_CELL_SIZE, child_speed: float = WALKING_SPEED
) -> float:
    """Return the time to walk the length of a cell, rounded to whole control steps, s."""
    return round(cell_size / child_speed / control_timestep) * control_timestep


class ToddlerWalk:
    """The kinematics of one toddler.

    Attributes:
        position: Position, m.
        velocity: Velocity, m/s.
        yaw: Heading, rad.
        yaw_rate: Rate of turning, rad/s.
        blocked: Whether something stopped its present move.
        returns: Whether it has turned back.
    """

    def __init__(self, duration: float, child_speed: float = WALKING_SPEED):
        self._duration = duration  # s; of a move, or of a bump and the return
        haste = child_speed / WALKING_SPEED
        self._bump_speed, self._fastest = haste * BUMP_SPEED, haste * FASTEST

    def reset(self, position: Vector, yaw: float) -> None:
        """Place the toddler, at rest."""
        self.position, self.yaw = position, yaw
        self.velocity, self.yaw_rate = (0.0, 0.0), 0.0
        self._home = self._goal = position
        self.blocked = False
        self._bumps = self.returns = False
        self._left = 0.0

    def begin(self, home: Vector, goal: Vector, bump: bool) -> None:
        """Begin a move from its home, the centre of its cell, to that of another cell.

        With `bump`, that cell holds an obstacle, and the toddler comes back in any case.
        """
        self._home, self._goal, self._bumps = home, goal, bump
        self.returns = self.blocked = False
        self._left = self._duration
        self._length = math.dist(self.position, goal)

    def carry(self, x: float, y: float) -> None:
        """Displace it by (x, y), m, as after a push."""
        self.position = self.position[0] + x, self.position[1] + y

    def stay(self) -> None:
        """Begin a move on the spot."""
        self.begin(self.position, self.position, bump=False)

    def step(self, timestep: float, touched: Iterable[Vector]) -> None:
        """Advance by a timestep, s; `touched` are unit vectors from the toddler to its contacts."""
        touched = list(touched)
        velocity = self._towards(self._home if self.returns else self._goal)
        if not self.returns:
            stopped = _is_in_the_way(velocity, touched)
            if self._bumps:
                turns_back = stopped or self._left <= self._duration / 2
            else:  # past half of the move it waits until the way is free
                self.blocked = stopped
                turns_back = stopped and math.dist(self.position, self._goal) > (1 - _HALF_WAY) * self._length
            if turns_back:
                self.returns = True
                velocity = self._towards(self._home)
        if touched and _is_in_the_way(velocity, touched):
            velocity = (0.0, 0.0)
        self.velocity = velocity
        self.position = (self.position[0] + timestep * velocity[0], self.position[1] + timestep * velocity[1])
        if not self.returns and (velocity[0] or velocity[1]):  # it returns backwards
            turn = math.remainder(math.atan2(velocity[1], velocity[0]) - self.yaw, math.tau)
            self.yaw_rate = _TURN_RATE * turn
            self.yaw += timestep * self.yaw_rate
        else:
            self.yaw_rate = 0.0
        self._left -= timestep

    def _towards(self, aim: Vector) -> Vector:
        """Return the velocity to reach a point in time, limited to a toddler's speed."""
        dx, dy = aim[0] - self.position[0], aim[1] - self.position[1]
        distance = math.hypot(dx, dy)
        if distance < 1e-6 or self._left < 1e-6:
            return 0.0, 0.0
        speed = distance / self._left
        if self._bumps or self.returns:
            speed = max(speed, min(self._bump_speed, distance / min(self._left, 0.02)))
        speed = min(speed, self._fastest)
        return speed * dx / distance, speed * dy / distance


def _is_in_the_way(velocity: Vector, touched: list[Vector]) -> bool:
    if not touched:
        return False
    speed = math.hypot(*velocity)
    return any(velocity[0] * x + velocity[1] * y > _FRONTAL * speed for x, y in touched)
