"""Speed and separation: how fast the base may drive near children, and which of them count.

The ideas are those of ISO 13482 (a mobile servant robot avoids, slows down and stops) and of ISO/TS 15066 (speed and
separation); nothing here claims to comply with them. Of several children every one counts: the base keeps what the
strictest of them asks for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.se2 import Pose, Vector
from caregiver_mj.robot.view import CHILD_RADIUS, ChildView, View

FORESIGHT = 2.2  # metres within which paths are planned round a child: one farther away will be elsewhere by then

# The base must be able to stop before a child that walks towards it.
_CHILD_SPEED = 0.62  # m/s, the fastest that a toddler walks towards something
_REACTION = 0.04  # seconds of control and servo until the base begins to brake
_SEPARATION = 0.08  # metres that shall remain
_FAR = 2.0  # metres beyond which a child does not slow the base down
_PASSING, _PASSING_GAP = 0.35, 0.4  # share of the speed that counts so at no distance, and metres where none does
# How a base to which a child has come too close may still leave: slower than a strike even if it led to the child.
_CREEP_SPEED = 0.04  # m/s
_CREEP_TOWARDS = 0.2  # cosine between motion and child, at most: what slides past and does not push

_COMING_SPEED = 0.1  # m/s towards the robot
_COMING_GAP, _TOUCHING_GAP = 0.9, 0.01  # metres
_GENTLE_GAP = 0.10  # metres to a child below which the base yields to a push
_IN_THE_WAY_GAP = 0.05  # metres between base and child on a path below which the child stands in its way
_SOON = 0.8  # seconds within which a child goes on as it walks now


def gap(view: View, robot: Embodiment) -> float:
    """Metres between the robot's base and the nearest child."""
    nearest = math.inf
    for child in view.children:  # a plain loop: this is asked at every control timestep
        nearest = min(nearest, _gap(view.base, robot, child))
    return nearest


def is_child_close(view: View, robot: Embodiment) -> bool:
    """Whether a child is so close that the base must not push back when it is pushed."""
    return gap(view, robot) < _GENTLE_GAP


def comes(view: View, robot: Embodiment) -> bool:
    """Whether a child walks towards the robot, or has just run into it."""
    return any(_comes(view.base, robot, child) for child in view.children)


def is_in_the_way(view: View, robot: Embodiment, points: Iterable[Vector]) -> bool:
    """Whether a child stands, or will stand shortly, where the base would pass through some points."""
    near = robot.footprint + CHILD_RADIUS + _IN_THE_WAY_GAP
    places = child_places(view.children)
    return any(math.dist(point, place) < near for point in points for place in places)


def near_children(view: View, place: Vector) -> tuple[ChildView, ...]:
    """The children round whom a base at a place plans its way."""
    return tuple(child for child in view.children if math.dist(child.position, place) < FORESIGHT)


def child_places(children: Iterable[ChildView]) -> list[Vector]:
    """Where children are, and where each will be shortly if it walks on."""
    places = []
    for child in children:
        (x, y), (vx, vy) = child.position, child.velocity
        places += [(x, y), (x + _SOON * vx, y + _SOON * vy)]
    return places


def child_cells(children: Iterable[ChildView], plan: FloorPlan) -> set[Cell]:
    """The cells of these places."""
    return {plan.cell_at(place) for place in child_places(children)}


def allowed_rate(view: View, robot: Embodiment, velocity: Vector) -> float:
    """The share of its planned velocity, m/s, at which the base can still stop before it touches any child.

    Speed and separation monitoring (the idea of ISO/TS 15066, section 5.5.4): while robot and child close in, the
    distance between them must cover what the robot needs to react and brake, and what the child walks meanwhile.
    At a rate r of its planned speed, stopping takes r * speed / deceleration + build-up seconds.

    Where no speed is low enough for that, the base may still leave: at any speed if it goes well away from the child,
    and at a creep if it slides past. Else the two could keep each other where they are: the child waits for the place
    in which the base waits for the child to go.
    """
    if velocity[0] == 0.0 and velocity[1] == 0.0:
        return 1.0
    rate = 1.0
    for child in view.children:
        rate = min(rate, _allowed_rate(view, robot, child, velocity))
    return rate


def _allowed_rate(view: View, robot: Embodiment, child: ChildView, velocity: Vector) -> float:
    """The same for one child, for a velocity that is not zero."""
    base = view.base
    room = _gap(base, robot, child) - _SEPARATION
    if room > _FAR:
        return 1.0
    (vx, vy), speed = velocity, math.hypot(*velocity)
    dx, dy = child.position[0] - base[0], child.position[1] - base[1]
    approach = towards = (vx * dx + vy * dy) / (math.hypot(dx, dy) or 1.0)
    # Close by, a path past the child counts as one that leads towards it: it may turn, and so may the path.
    approach += speed * _PASSING * min(1.0, max(0.0, 1.0 - room / _PASSING_GAP))
    if approach <= 0.0:
        return 1.0
    # approach * r * (stopping / 2 + reaction) + child * (stopping + reaction) = room, solved for r
    limits = robot.limits.base
    stopping = speed / limits.acceleration
    delay = _REACTION + limits.acceleration / limits.jerk + view.age
    a = approach * stopping / 2
    b = approach * delay + _CHILD_SPEED * stopping
    c = _CHILD_SPEED * delay - room
    if c >= 0.0:
        return min(1.0, _CREEP_SPEED / speed) if towards <= _CREEP_TOWARDS * speed else 0.0
    return min(1.0, (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a))


def _comes(base: Pose, robot: Embodiment, child: ChildView) -> bool:
    """Whether a child walks towards the robot, or has just run into it."""
    room = _gap(base, robot, child)
    dx, dy = base[0] - child.position[0], base[1] - child.position[1]
    towards = (dx * child.velocity[0] + dy * child.velocity[1]) / (math.hypot(dx, dy) or 1.0)
    return room < _TOUCHING_GAP or (room < _COMING_GAP and towards > _COMING_SPEED)


def _gap(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Metres between base and child."""
    return math.dist(child.position, base[:2]) - robot.footprint - CHILD_RADIUS
