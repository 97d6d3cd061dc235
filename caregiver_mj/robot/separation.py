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
from caregiver_mj.robot import se2
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.hand import hand_position
from caregiver_mj.robot.se2 import Pose, Vector
from caregiver_mj.robot.view import CHILD_RADIUS, ChildView, View

# A base nearer to a child than so many metres leaves it first, and straight: with this cosine between motion and child
# at most.
BESIDE, LEAVING = 0.15, -0.8
FORESIGHT = 2.2  # metres within which paths are planned round a child: one farther away will be elsewhere by then

# The base must be able to stop before a child that walks towards it.
_CHILD_SPEED = 0.62  # m/s, the fastest that a toddler walks towards something
FOLLOWING_SPEED = 1.0  # m/s, the fastest of one that follows: it makes up for time
_REACTION = 0.04  # seconds of control and servo until the base begins to brake
_SEPARATION = 0.08  # metres that shall remain
_FAR = 2.0  # metres beyond which a child does not slow the base down
_PASSING, _PASSING_GAP = 0.35, 0.4  # share of the speed that counts so at no distance, and metres where none does
# How a base may move along a child, or turn, that comes to touch it: slower than what counts as a strike, 0.05 m/s.
_SLIDE_SPEED, _SLIDE_TOUCHING = 0.02, 0.025  # m/s of its surface; the second where it touches it already
_TURN_SPEED = 0.01  # m/s likewise, of a turn
_SLIDE_TOWARDS = 0.2  # cosine between motion and child, at most: what slides past and does not push
_BUILDS_UP = 0.2  # seconds until a change of rate has built up
_SLIDE_RATES = (1.0, 0.8, 0.6, 0.45, 0.33, 0.25, 0.18, 0.12, 0.08, 0.05)  # that are tried

_COMING_SPEED = 0.1  # m/s towards the robot
_COMING_GAP, _TOUCHING_GAP = 0.9, 0.01  # metres
GENTLE_GAP = 0.10  # metres to a child below which the base yields to a push
# How fast the base then returns to where it shall be, m/s: slower than a strike; and per metre by which there is more
# room, 1/s: so fast it can brake before a child that comes.
_GENTLE_SPEED, _RELEASED = 0.03, 0.6
_AT_HAND = 0.5  # metres from the arm to the middle of a child below which the arm yields to a push
_TUCKED, _FAR_FROM_HAND = 0.05, 1.2  # share of the reach below which it is tucked, and metres beyond which none is near
_IN_THE_WAY_GAP = 0.05  # metres between base and child on a path below which the child stands in its way
_WITHIN = 1e-6  # metres, of a vector of which only the direction is known
_SOON = 0.8  # seconds within which a child goes on as it walks now


def gap(view: View, robot: Embodiment) -> float:
    """Metres between the robot's base and the nearest child."""
    nearest = math.inf
    for child in view.children:  # a plain loop: this is asked at every control timestep
        nearest = min(nearest, gap_to(view.base, robot, child))
    return nearest


def catch_up_speed(gap: float) -> float:
    """How fast a base that is off its reference may return to it, m/s, with a child so many metres away.

    The child may be in between, or come there.
    """
    return _GENTLE_SPEED + _RELEASED * max(0.0, gap - GENTLE_GAP)


def is_child_at_hand(view: View, robot: Embodiment, reached: float) -> bool:
    """Whether a child is so near to the hand, or to the arm that is out, that it might walk into it.

    Args:
        view: What is seen.
        robot: The robot.
        reached: How far its hand reaches out; tucked it is over the child's head.
    """
    if reached < _TUCKED or gap(view, robot) > _FAR_FROM_HAND:
        return False
    edge, hand = se2.to_world(view.base, (robot.footprint, 0.0)), hand_position(view, robot)[:2].tolist()
    return distance_from_line(view, edge, hand, 0.0) < _AT_HAND


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


def distance_from_line(view: View, start: Vector, end: Vector, within: float) -> float:
    """Metres from a line, along which the arm is or moves, to the nearest child's middle.

    Args:
        view: What is seen.
        start: Where the line begins, metres.
        end: Where it ends.
        within: Seconds in which the children may come nearer as they walk now.
    """
    nearest = math.inf
    for (x, y), (vx, vy) in view.children:
        for time in (0.0, within / 2, within):
            nearest = min(nearest, se2.distance_to_line((x + time * vx, y + time * vy), start, end))
    return nearest


def child_cells(children: Iterable[ChildView], plan: FloorPlan) -> set[Cell]:
    """The cells of these places."""
    return {plan.cell_at(place) for place in child_places(children)}


def allowed_rate(
    view: View,
    robot: Embodiment,
    velocity: Vector,
    acceleration: Vector = (0.0, 0.0),
    present: Vector = (0.0, 0.0),
) -> float:
    """The share of its planned velocity, m/s, at which the base can still stop before it touches any child.

    Its planned acceleration, m/s^2, tells what the path leaves it to brake with, see `RobotLimits.braking`; its present
    velocity, m/s, how fast it leaves a child already.

    Speed and separation monitoring (the idea of ISO/TS 15066, section 5.5.4): while robot and child close in, the
    distance between them must cover what the robot needs to react and brake, and what the child walks meanwhile.
    At a rate r of its planned speed, stopping takes r * speed / deceleration + build-up seconds.

    A base that does not lead towards the child may leave, or slide past, so fast that its surface can slow down to a
    creep along the child before that is at it. Else the two could keep each other where they are: the child waits for
    the place in which the base waits for the child to go.
    """
    if velocity[0] == 0.0 and velocity[1] == 0.0:
        return 1.0
    rate = 1.0
    for child in view.children:
        rate = min(rate, _allowed_rate(view, robot, child, velocity, acceleration, present))
    return rate


def _allowed_rate(
    view: View, robot: Embodiment, child: ChildView, velocity: Vector, acceleration: Vector, present: Vector
) -> float:
    """The same for one child, for a velocity that is not zero."""
    base = view.base
    room = _gap_however_turned(base, robot, child) - _SEPARATION
    if room > _FAR:
        return 1.0
    gap = gap_to(base, robot, child)
    (vx, vy), speed = velocity, math.hypot(*velocity)
    dx, dy = outwards(robot, base[2], (child.position[0] - base[0], child.position[1] - base[1]))
    away = math.hypot(dx, dy) or 1.0
    towards, across = (vx * dx + vy * dy) / away, (vx * dy - vy * dx) / away
    # While a change of rate builds up, the path speeds up, or turns.
    soon = max(abs(across), abs(across + _BUILDS_UP * (acceleration[0] * dy - acceleration[1] * dx) / away))
    slides = slide_speed(gap)
    creep = slides / max(abs(across), slides)
    leaves = max(0.0, -(present[0] * dx + present[1] * dy) / away)
    # Close by, a path past the child counts as one that leads towards it: it may turn, and so may the path.
    approach = towards + speed * _PASSING * min(1.0, max(0.0, 1.0 - room / _PASSING_GAP))
    if towards <= LEAVING * speed:
        return 1.0  # what is left of `across` is taken away where a child may come to touch, see `restrain`
    if approach <= 0.0:
        return max(creep, _sliding_rate(view, robot, gap, _walking_speed(child), leaves, towards, soon))
    # approach * r * (stopping / 2 + reaction) + child * (stopping + reaction) = room, solved for r
    deceleration, build_up = robot.limits.braking(velocity, acceleration)
    stopping = speed / deceleration
    delay = _REACTION + build_up + view.age
    a = approach * stopping / 2
    comes_at = _walking_speed(child)
    b = approach * delay + comes_at * stopping
    c = comes_at * delay - room
    rate = 0.0 if c >= 0.0 else (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
    if towards <= _SLIDE_TOWARDS * speed:
        rate = max(rate, creep, _sliding_rate(view, robot, gap, _walking_speed(child), leaves, towards, soon))
    return min(1.0, rate)


def _sliding_rate(
    view: View, robot: Embodiment, gap: float, comes_at: float, leaves: float, towards: float, across: float
) -> float:
    """The share of a velocity, m/s towards a child and across, from which the surface slows down before it is touched.

    Args:
        view: What is seen.
        robot: The robot.
        gap: Metres between base and child.
        comes_at: How fast the child may come, m/s.
        leaves: How fast the base leaves the child now, m/s.
        towards: Velocity towards the child, m/s, negative for one away from it.
        across: Speed across.
    """
    for rate in _SLIDE_RATES:
        closing = comes_at + max(rate * towards, -leaves)
        until_touched = max(0.0, gap) / closing if closing > 0.0 else math.inf
        if rate * across <= slide_speed(gap) + robot.limits.slowing(until_touched - _REACTION - view.age):
            return rate
    return 0.0


def _walking_speed(child: ChildView) -> float:
    """How fast a child may come, m/s: as toddlers do, and one that runs as fast as it does."""
    return max(_CHILD_SPEED, min(FOLLOWING_SPEED, math.hypot(*child.velocity)))


def slide_speed(gap: float) -> float:
    """How fast the surface of a base may be along a child so many metres away, however soon that comes, m/s."""
    return _SLIDE_TOUCHING if gap < _TOUCHING_GAP else _SLIDE_SPEED


def allowed_turning(view: View, robot: Embodiment, velocity: Vector, turning: tuple[float, float]) -> float:
    """How fast the base may turn, rad/s, to turn no faster than at a creep when a child comes to touch it.

    Args:
        view: What is seen.
        robot: The robot.
        velocity: Of the base now, m/s.
        turning: Rate, rad/s, and acceleration, rad/s^2, of the base's turn now.
    """
    limits, creep = robot.limits.yaw, _TURN_SPEED / robot.footprint
    # Before a turn that speeds up can slow down its acceleration has to go, and meanwhile it becomes faster still.
    rate, acceleration = turning
    speeds_up = max(0.0, acceleration if rate >= 0.0 else -acceleration)
    delay, most = speeds_up / limits.jerk, abs(rate) + speeds_up**2 / (2 * limits.jerk)
    allowed = math.inf
    for child in view.children:
        gap = _gap_however_turned(view.base, robot, child)
        if gap < _FAR:
            dx, dy = child.position[0] - view.base[0], child.position[1] - view.base[1]
            closing = FOLLOWING_SPEED + max(0.0, (velocity[0] * dx + velocity[1] * dy) / math.hypot(dx, dy))
            time = max(0.0, gap) / closing - _REACTION - view.age
            if most > creep + limits.slowing(time - delay):
                return creep
            allowed = min(allowed, creep + limits.slowing(time))
    return allowed


def _comes(base: Pose, robot: Embodiment, child: ChildView) -> bool:
    """Whether a child walks towards the robot, or has just run into it."""
    room = gap_to(base, robot, child)
    dx, dy = base[0] - child.position[0], base[1] - child.position[1]
    towards = (dx * child.velocity[0] + dy * child.velocity[1]) / (math.hypot(dx, dy) or 1.0)
    return room < _TOUCHING_GAP or (room < _COMING_GAP and towards > _COMING_SPEED)


def _gap_however_turned(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Metres between child and base, whose corners may turn towards it."""
    return math.dist(child.position, base[:2]) - robot.footprint - CHILD_RADIUS


def gap_to(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Metres between base and child."""
    offset = child.position[0] - base[0], child.position[1] - base[1]
    return math.hypot(*outwards(robot, base[2], offset)) - robot.rounding - CHILD_RADIUS


def outwards(robot: Embodiment, yaw: float, offset: Vector) -> Vector:
    """The vector to a place from the nearest point within the base's sides: square to the surface that touches there.

    Of a round base it is that from its middle; that of a box-shaped one is square to a side, except at its corners.

    Args:
        robot: The robot.
        yaw: Heading of its base, radians.
        offset: Of the place from the base's middle, in the house, metres.
    """
    if robot.sides == (0.0, 0.0):
        return offset
    x, y = se2.rotate(-yaw, offset)
    beyond_x, beyond_y = abs(x) - robot.sides[0], abs(y) - robot.sides[1]
    if max(beyond_x, beyond_y) <= 0.0:  # it is seen within the base, where no child can be
        beyond_x, beyond_y = (_WITHIN, 0.0) if beyond_x > beyond_y else (0.0, _WITHIN)
    return se2.rotate(yaw, (math.copysign(max(0.0, beyond_x), x), math.copysign(max(0.0, beyond_y), y)))
