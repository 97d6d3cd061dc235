"""Speed and separation: how fast the base may drive near children, and which motions a close child forbids.

After ISO 13482 (a mobile servant robot avoids, slows down and stops) and ISO/TS 15066 (speed and separation), without a
claim to comply with them. Every child counts: the strictest bound holds. Whatever the command, the base does not push a
child, nor slide along it fast.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot import geometry
from caregiver_mj.robot.base_motion import NO_SPEED, PLANNED_AHEAD
from caregiver_mj.robot.base_path import BRAKES_ALONG
from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.feedback import GENTLY
from caregiver_mj.robot.geometry import Pose, Vector
from caregiver_mj.robot.kinematics import hand_offset, hand_position
from caregiver_mj.robot.limits import CREEP, Limits, RobotLimits
from caregiver_mj.robot.view import CHILD_RADIUS, ChildView, View

# m, cosine between motion and child; a base nearer than this first leaves the child, in a direction below that cosine.
BESIDE, LEAVING = 0.15, -0.8
FORESIGHT = 2.2  # m; range within which paths avoid a child; a farther one will have moved on
_REACTION = 0.04  # s; delay of control and servo before the base brakes
_SEPARATION = 0.08  # m; distance that must remain when the base has stopped
_FAR = 2.0  # m; range beyond which a child does not slow the base down
FREE = 1.5  # m; distance of the nearest child from which on feedback and arm are unbounded
_PASSING, _PASSING_GAP = 0.35, 0.4  # share of a passing speed that is approach at contact; m, gap where none is
# Speeds of the base's surface along a child that comes to touch it, below a strike.
_SLIDE_SPEED, _SLIDE_TOUCHING = 0.02, 0.025  # m/s; before contact, and in contact
ADDED = 0.01  # m/s; the part of a turn, or of feedback, beside these or a creep
_SLIDE_TOWARDS = 0.2  # greatest cosine between motion and child with which the base slides past and does not push
_BUILDS_UP = 0.2  # s; time until a change of rate has built up
_SLIDE_RATES = (1.0, 0.8, 0.6, 0.45, 0.33, 0.25, 0.18, 0.12, 0.08, 0.05)  # candidates
_COMING_SPEED = 0.1  # m/s; speed of a child above which it comes towards the robot
COMING_GAP, _TOUCHING_GAP = 0.9, 0.01  # m; gaps below which it counts, and below which it has arrived
GENTLE_GAP = 0.10  # m; gap below which the base yields to a push
# 1/s; increase with the gap of the speed of return to the reference, a creep within that gap: so fast the base can
# brake before a child that comes.
_RELEASED = 0.6
_AT_HAND = 0.5  # m; distance of arm and child's centre below which the arm yields to a push
_TUCKED = 0.05  # share of the reach below which the arm is tucked
_WITHIN = 1e-6  # m; length of a vector of which only the direction is known
_SOON = 0.8  # s; horizon within which a child keeps its velocity
_HEAD_ON = 0.5  # cosine between motion and child above which `must_stop` considers the child
_TOUCHED = 0.002  # m; gap of a child that touches the base, or will in the next control step
_NO_NEARER = GENTLE_GAP / 2  # m; gap below which no motion leads to a child, and a path past it counts as barred
_BRAKES = 0.8  # share of the acceleration limit for braking in contact; before contact commands keep to the limit
# m/s; decrease of the command, before contact, of a base with little room to leave. A greater one would use nearly all
# of its acceleration, and leave none to react to a child that walks round it.
_EASES = 0.1
_BACK = tuple(0.05 * i for i in range(1, 9))  # m; distances straight away from a child at which room is checked
# Share of the acceleration limit for braking before an obstacle there; delay in multiples of acceleration over jerk.
_COMES_TO_REST, _BUILDS_UP_LATER = 0.55, 2.5
# m/s, s; the direction away from a child turns as it walks at the heels of a base that leaves it. From the first speed
# on it is predicted until the base follows its command, at twice that speed over the whole second.
_FAST, _LATER = 0.2, 0.035
_ROUNDS = 8  # rounds over several children, unless none changes the velocity any more
_STRAYS = 0.08  # rad; turn of the direction to a child that walks along until the base follows its command
# For a box-shaped base: m; distance that the child walks along its surface meanwhile. m/s; speed of the base along it
# as it leaves, below a strike with a turn included. m; distances that a child may run along the surface, and so round a
# corner: by then the base, which may leave a side faster, must be slow.
_MOVES_ON, _ASTRAY = 0.031, 0.034
_RUNS_ON = tuple(0.04 * i for i in range(8))


def is_alone(view: View, robot: Embodiment, apart: float = _SEPARATION + _FAR) -> bool:
    """Return whether all children, also possible unseen ones, are over `apart` m away, by default beyond all bounds."""
    return _nearest(view) > robot.footprint + CHILD_RADIUS + apart


@functools.lru_cache(maxsize=1)  # several callers a timestep
def _nearest(view: View) -> float:
    """Return the distance of the base's centre from that of the nearest child, also a possible unseen one, m."""
    nearest = view.child_distance(view.base[:2])
    for child in view.hidden + view.lurking:
        nearest = min(nearest, math.dist(child.position, view.base[:2]))
    return nearest


def gap(view: View, robot: Embodiment, unseen: tuple[ChildView, ...] = ()) -> float:
    """Return the gap between the base and the nearest child or possible `unseen` one, m."""
    nearest = math.inf
    for child in view.children + unseen:  # a plain loop is faster
        nearest = min(nearest, gap_to(view.base, robot, child))
    return nearest


def catch_up_speed(gap: float, gentle: float = CREEP) -> float:
    """Return the speed of a base's return to its reference, m/s, with a child, perhaps in between, at a gap, m."""
    return gentle + _RELEASED * max(0.0, gap - GENTLE_GAP)


def is_child_at_hand(view: View, robot: Embodiment, reached: float) -> bool:
    """Return whether a child may walk into the hand or the extended arm.

    `reached` is the extension as a share of the reach; tucked, the hand is above a child's head.
    """
    if reached < _TUCKED or gap(view, robot) > FREE:
        return False
    return is_child_at_arm(view, robot, _AT_HAND, 0.0)


def is_child_at_arm(view: View, robot: Embodiment, near: float, within: float) -> bool:
    """Return `is_child_at_line` for the line from the base's edge to the hand."""
    edge, hand = geometry.to_world(view.base, (robot.footprint, 0.0)), hand_position(view, robot)[:2].tolist()
    return is_child_at_line(view, edge, hand, near, within)


def comes(view: View, robot: Embodiment) -> bool:
    """Return whether a child walks towards the robot, or has just run into it."""
    for child in view.children:
        room = gap_to(view.base, robot, child)
        comes_at = -_along(child.velocity, _offset(view.base, child))
        if room < _TOUCHING_GAP or (room < COMING_GAP and comes_at > _COMING_SPEED):
            return True
    return False


def is_in_the_way(view: View, robot: Embodiment, points: Iterable[Vector]) -> bool:
    """Return whether a child is, or will soon be, where the base would pass through some points."""
    near = robot.footprint + CHILD_RADIUS + _NO_NEARER
    places = child_places(view.children)
    return any(math.dist(point, place) < near for point in points for place in places)


def near_children(view: View, place: Vector) -> tuple[ChildView, ...]:
    """Return the children that the path of a base at a place must avoid."""
    return tuple(child for child in view.children if math.dist(child.position, place) < FORESIGHT)


def child_places(children: Iterable[ChildView]) -> list[Vector]:
    """Return the positions of children, now and after `_SOON` seconds at their present velocities."""
    places = []
    for child in children:
        (x, y), (vx, vy) = child.position, child.velocity
        places += [(x, y), (x + _SOON * vx, y + _SOON * vy)]
    return places


def is_child_at_line(view: View, start: Vector, end: Vector, near: float, within: float) -> bool:
    """Return whether a child's centre is, or may be within a time, near a line that the arm is on or moves along.

    `near` is in m; `within` is in s, at the children's present velocities.
    """
    far = near + math.dist(start, end)
    for (x, y), (vx, vy) in view.children:
        if math.dist((x, y), start) - within * math.hypot(vx, vy) > far:
            continue  # the usual case
        for time in (0.0, within / 2, within):
            if geometry.distance_to_line((x + time * vx, y + time * vy), start, end) < near:
                return True
    return False


def child_cells(children: Iterable[ChildView], plan: FloorPlan) -> set[Cell]:
    """Return the cells of `child_places`."""
    return {plan.cell_at(place) for place in child_places(children)}


def allowed_rate(
    view: View,
    robot: Embodiment,
    velocity: Vector,
    acceleration: Vector = (0.0, 0.0),
    present: Vector = (0.0, 0.0),
    limits: RobotLimits | None = None,
) -> float:
    """Return the share of its planned velocity at which the base can still stop before it touches any child.

    Speed and separation monitoring (after ISO/TS 15066, section 5.5.4): the gap must cover what the robot needs to
    react and brake, and what the child walks meanwhile. At a rate r of its planned speed, stopping takes r * speed /
    deceleration + build-up seconds.

    A base that leaves or slides past a child may go as fast as its surface can slow down to a creep before contact.
    Otherwise the two could block each other, each waiting for the other's place.

    Args:
        view: The robot's view.
        robot: The robot.
        velocity: Planned velocity, m/s.
        acceleration: Planned acceleration, m/s^2, which reduces the braking that is left (`RobotLimits.braking`).
        present: Present velocity, m/s, at which the base may already leave a child.
        limits: Limits in force; the robot's by default.
    """
    if velocity[0] == 0.0 and velocity[1] == 0.0:
        return 1.0
    rate, limits = 1.0, limits or robot.limits
    for child in view.children:
        rate = min(rate, _allowed_rate(view, robot, limits, child, velocity, acceleration, present))
    if lurking := view.lurking + view.hidden:
        corner = min(_allowed_rate(view, robot, limits, child, velocity, acceleration, present) for child in lurking)
        now = (v - PLANNED_AHEAD * a for v, a in zip(velocity, acceleration, strict=True))  # it may brake
        rate = min(rate, max(corner, CREEP / max(math.hypot(*velocity), math.hypot(*now))))
    return rate


def _allowed_rate(
    view: View,
    robot: Embodiment,
    limits: RobotLimits,
    child: ChildView,
    velocity: Vector,
    acceleration: Vector,
    present: Vector,
) -> float:
    """Return `allowed_rate` for one child and a velocity other than zero."""
    base = view.base
    room = _gap_however_turned(base, robot, child) - _SEPARATION
    if room > _FAR:
        return 1.0
    gap = gap_to(base, robot, child)
    (vx, vy), speed = velocity, math.hypot(*velocity)
    dx, dy = way = _way_to(base, robot, child)
    away = math.hypot(dx, dy)
    towards, across = _along(velocity, way), (vx * dy - vy * dx) / away
    # While a change of rate builds up, the path speeds up, or turns.
    soon = max(abs(across), abs(across + _BUILDS_UP * (acceleration[0] * dy - acceleration[1] * dx) / away))
    slides = slide_speed(gap)
    creep = slides / max(abs(across), slides)
    leaves, comes_at = max(0.0, -_along(present, way)), _walking_speed(view, child)
    # Near a child, part of a passing speed counts as approach: child and path may turn.
    approach = towards + speed * _PASSING * min(1.0, max(0.0, 1.0 - room / _PASSING_GAP))
    if towards <= LEAVING * speed:
        return 1.0  # `restrain` limits `across` near contact
    if approach <= 0.0:
        return max(creep, _sliding_rate(view, limits, gap, comes_at, leaves, towards, soon))
    # approach * r * (stopping / 2 + reaction) + child * (stopping + reaction) = room, solved for r
    deceleration, build_up = limits.braking(velocity, acceleration)
    stopping = speed / deceleration
    delay = _REACTION + build_up + view.age
    a = approach * stopping / 2
    b = approach * delay + comes_at * stopping
    c = comes_at * delay - room
    rate = 0.0 if c >= 0.0 else (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
    if towards <= _SLIDE_TOWARDS * speed:
        rate = max(rate, creep, _sliding_rate(view, limits, gap, comes_at, leaves, towards, soon))
    return min(1.0, rate)


def must_stop(
    view: View, robot: Embodiment, velocity: Vector, acceleration: Vector, limits: RobotLimits | None = None
) -> bool:
    """Return whether a base with this velocity, m/s, and acceleration, m/s^2, needs all remaining distance to stop.

    On a path that speeds up or turns, braking starts later than `allowed_rate` assumes. The base then leaves the path:
    a protective stop (ISO 10218-1). Changing the acceleration from a to braking at b costs (a + b)^2 / (2 b jerk)
    seconds.
    """
    if (speed := math.hypot(*velocity)) < _SLIDE_SPEED:
        return False
    bounds = (limits or robot.limits).as_commanded
    braking, jerk = BRAKES_ALONG * bounds.acceleration, BRAKES_ALONG * bounds.jerk
    ahead = (velocity[0] * acceleration[0] + velocity[1] * acceleration[1]) / speed
    delay = _REACTION + view.age + max(0.0, ahead + braking) ** 2 / (2 * braking * jerk)
    for child in view.children:
        towards = _along(velocity, _way_to(view.base, robot, child))
        needs = towards * (delay + speed / (2 * braking)) + _walking_speed(view, child) * (delay + speed / braking)
        if towards > _HEAD_ON * speed and gap_to(view.base, robot, child) < needs:
            return True
    return False


def _sliding_rate(
    view: View, limits: RobotLimits, gap: float, comes_at: float, leaves: float, towards: float, across: float
) -> float:
    """Return the share of a velocity from which the base's surface slows down to a creep before contact.

    Speeds are in m/s: that of the child, that with which the base now leaves it, and the velocity towards the child,
    negative away from it, and across. The gap is in m.
    """
    for rate in _SLIDE_RATES:
        closing = comes_at + max(rate * towards, -leaves)
        until_touched = max(0.0, gap) / closing if closing > 0.0 else math.inf
        if rate * across <= slide_speed(gap) + limits.slowing(until_touched - _REACTION - view.age):
            return rate
    return 0.0


def _walking_speed(view: View, child: ChildView) -> float:
    """Return a child's greatest speed of approach, m/s: a usual child's, or its own present one if that is higher."""
    return max(view.child_comes, min(view.child_runs, math.hypot(*child.velocity)))


def slide_speed(gap: float) -> float:
    """Return the greatest speed of the base's surface along a child at a gap, m, however soon it comes, m/s."""
    return _SLIDE_TOUCHING if gap < _TOUCHING_GAP else _SLIDE_SPEED


def allowed_turning(view: View, robot: Embodiment, velocity: Vector, turning: tuple[float, float]) -> float:
    """Return the rate, rad/s, from which a turn slows down to a creep before a child can touch the base.

    The base has a velocity, m/s, and turns at a rate, rad/s, with an acceleration, rad/s^2 (`turning`).
    """
    limits, speed = robot.limits.yaw, math.hypot(*velocity)
    room, closing = _nearest(view) - robot.footprint - CHILD_RADIUS, view.child_runs + speed
    if turning == (0.0, 0.0) and limits.slowing(room / closing - _REACTION - view.age) > limits.velocity:
        return math.inf  # any turn that begins now can end in time
    # An accelerating turn becomes still faster before it can slow down.
    rate, acceleration = turning
    speeds_up = max(0.0, acceleration if rate >= 0.0 else -acceleration)
    delay, most = speeds_up / limits.jerk, abs(rate) + speeds_up**2 / (2 * limits.jerk)
    allowed = math.inf
    # With a narrow view, the base must be able to turn to see a child that may be near.
    unseen = view.unseen
    for child in view.children + unseen:
        gap = _gap_however_turned(view.base, robot, child)
        if gap < _FAR:
            creep, comes_at = ADDED / robot.footprint, view.child_runs
            if child in unseen:
                creep, comes_at = max(creep, (CREEP + ADDED - speed) / robot.footprint), view.child_comes
            closing = comes_at + max(0.0, _along(velocity, _offset(view.base, child)))
            time = max(0.0, gap) / closing - _REACTION - view.age
            too_fast = most > creep + limits.slowing(time - delay)
            allowed = min(allowed, creep if too_fast else creep + limits.slowing(time))
    return allowed


def _gap_however_turned(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Return the gap to a child, m, with any heading of the base."""
    return math.dist(child.position, base[:2]) - robot.footprint - CHILD_RADIUS


def gap_to(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Return the gap between base and child, m."""
    return math.hypot(*_way_to(base, robot, child)) - robot.rounding - CHILD_RADIUS


def _offset(base: Pose, child: ChildView) -> Vector:
    return child.position[0] - base[0], child.position[1] - base[1]


def _way_to(base: Pose, robot: Embodiment, child: ChildView) -> Vector:
    return outwards(robot, base[2], _offset(base, child))


def _along(velocity: Vector, way: Vector) -> float:
    """Return the component of a velocity along a vector, m/s."""
    return (velocity[0] * way[0] + velocity[1] * way[1]) / (math.hypot(*way) or 1.0)


def outwards(robot: Embodiment, yaw: float, offset: Vector) -> Vector:
    """Return the vector to a place from the nearest point within the base's sides, normal to its surface there.

    In a round base that point is the centre; on a box-shaped one the vector is normal to a side, except at corners. The
    place is an offset from the base's centre in the house's axes, m; `yaw` is the base's heading, rad.
    """
    if robot.sides == (0.0, 0.0):
        return offset if offset != (0.0, 0.0) else (_WITHIN, 0.0)  # at its very centre: any direction
    x, y = geometry.rotate(-yaw, offset)
    beyond_x, beyond_y = abs(x) - robot.sides[0], abs(y) - robot.sides[1]
    if max(beyond_x, beyond_y) <= 0.0:  # an estimate within the base, where no child can be
        beyond_x, beyond_y = (_WITHIN, 0.0) if beyond_x > beyond_y else (0.0, _WITHIN)
    return geometry.rotate(yaw, (math.copysign(max(0.0, beyond_x), x), math.copysign(max(0.0, beyond_y), y)))


def restrain(
    view: View,
    robot: Embodiment,
    clearance: Clearance,
    seconds: float,
    is_loaded: bool,
    velocity: Vector,
    before: Vector,
) -> tuple[Vector, bool]:
    """Remove from the base's velocity what leads towards a child in contact, or fast along a close one.

    The command is more than the planned velocity: feedback returns the base to its reference, and so towards a child
    that has pushed it off.

    Args:
        view: The robot's view.
        robot: The robot.
        clearance: The room. Without its speed along a child, the base leaves it more directly, where there is room,
            else slowly in its own direction.
        seconds: The control timestep, s.
        is_loaded: Whether a candle is in the hand, which also needs room.
        velocity: The wanted command, m/s.
        before: The previous command, m/s, from which braking is limited.

    Returns:
        The remaining velocity, and whether a child touches the base, so that the command must apply at once.
    """
    # With inexact sensing contact is unknown: the base keeps its limits, and slows down earlier.
    is_touched = not view.unsure and any(gap_to(view.base, robot, child) < _TOUCHED for child in view.children)
    children = view.children + view.hidden
    limits = robot.limits.loaded if is_loaded else robot.limits
    left, rounds = velocity, _ROUNDS if len(children) > 1 else 1
    for _ in range(rounds):
        wanted = left
        for child in children:
            left = _restrained(view, robot, clearance, seconds, is_loaded, is_touched, child, left, before)
        if rounds == 1 or math.dist(left, wanted) < NO_SPEED:
            return left, is_touched
    # No velocity suits all children: brake.
    speed, change = math.hypot(*before), seconds * _BRAKES * limits.as_commanded.acceleration
    kept = 1.0 - change / speed if is_touched and speed > change else 0.0
    return (kept * before[0], kept * before[1]), is_touched


def _restrained(
    view: View,
    robot: Embodiment,
    clearance: Clearance,
    seconds: float,
    is_loaded: bool,
    is_touched: bool,
    child: ChildView,
    velocity: Vector,
    before: Vector,
) -> Vector:
    """Return the velocity of the base that remains for one child, m/s."""
    limits = robot.limits.loaded if is_loaded else robot.limits
    command_limits = limits.as_commanded
    room = gap_to(view.base, robot, child) - view.unsure
    if room >= GENTLE_GAP:
        return velocity
    vx, vy = velocity
    offset = _offset(view.base, child)
    dx, dy = outwards(robot, view.base[2], offset)
    leaves = -_along(before, (dx, dy))
    if later := _LATER * min(1.0, max(0.0, leaves / _FAST - 1.0)):
        x = offset[0] + later * (child.velocity[0] - before[0])
        y = offset[1] + later * (child.velocity[1] - before[1])
        offset = x, y
        dx, dy = outwards(robot, view.base[2], offset)
    away = math.hypot(dx, dy)
    x, y = dx / away, dy / away
    # In contact with any child, the command applies at once.
    braking = seconds * _BRAKES * command_limits.acceleration
    bounds = (braking, math.inf) if is_touched else (math.inf, GENTLY * command_limits.jerk)
    towards, commanded = vx * x + vy * y, before[0] * x + before[1] * y
    if room < _NO_NEARER:
        towards = min(towards, _bounded(commanded, 0.0, seconds, *bounds))
    corners = _corners(robot, view.base[2], offset)
    strays = corners[0] if corners else _STRAYS
    slower = limits.slowing(max(0.0, room) / view.child_runs - view.age)
    slides = max(0.0, slide_speed(room) + strays * min(0.0, towards)) + slower
    if any(corners):
        slowing, later = command_limits.slowing, _LATER + view.age
        leaving = min(
            (_ASTRAY + slower) / corner + slowing(on / view.child_runs - later)
            for on, corner in zip(_RUNS_ON, corners, strict=True)
            if corner
        )
        towards = max(towards, -_bounded(-commanded, leaving, seconds, *bounds))
    across = vy * x - vx * y
    way = math.copysign(1.0, across)
    most = _bounded(way * (before[1] * x - before[0] * y), slides, seconds, *bounds)
    if abs(across) > max(most, slides):
        # The remaining velocity leads more directly away from the child: limit it to the room there.
        on_its_way = towards * max(0.0, most) / abs(across)
        slowed = min(on_its_way, -_speed_back(view, robot, clearance, is_loaded, (x, y), command_limits))
        towards = max(towards, slowed if is_touched else min(slowed, commanded + _EASES))
    across = way * min(abs(across), most)
    return towards * x - across * y, towards * y + across * x


def _corners(robot: Embodiment, yaw: float, offset: Vector) -> tuple[float, ...]:
    """Return how far the surface's normal turns, rad, as a child at an offset walks a little along it.

    First at the child, then where it has run on by each of `_RUNS_ON`, in either direction; empty for a round base.
    """
    if robot.sides == (0.0, 0.0):
        return ()
    x, y = outwards(robot, yaw, offset)
    away = math.hypot(x, y)
    along_x, along_y = -y / away, x / away

    def way_off(on: float) -> float:
        there_x, there_y = outwards(robot, yaw, (offset[0] + on * along_x, offset[1] + on * along_y))
        return math.atan2(there_y, there_x)

    def turns(on: float) -> float:
        here = way_off(on)
        return max(abs(math.remainder(way_off(on + way) - here, math.tau)) for way in (_MOVES_ON, -_MOVES_ON))

    return tuple(max(turns(on), turns(-on)) for on in _RUNS_ON)


def _bounded(speed: float, most: float, seconds: float, change: float, jerk: float) -> float:
    """Return the next commanded speed, m/s, for a bound `most`.

    Above the bound it brakes by at most `change` in a control step. Below it approaches the bound without
    overshoot, with `change` and a final jerk, m/s^3, which is infinite if the acceleration may drop at once.
    """
    off = most - speed
    if off <= 0.0:
        return max(most, speed - change)
    return speed + min(off, change, seconds * math.sqrt(2 * jerk * off))


def _speed_back(
    view: View, robot: Embodiment, clearance: Clearance, is_loaded: bool, child: Vector, limits: Limits
) -> float:
    """Return the speed at which the base can leave a child, a unit vector away, and stop where there is room, m/s."""
    here, room = view.base[:2], 0.0
    hand = hand_offset(view, robot) if is_loaded else None
    for back in _BACK:
        there = here[0] - back * child[0], here[1] - back * child[1]
        if not clearance.can_stand(there) or (hand and not clearance.hand_has_room(here, there, hand)):
            braking = _COMES_TO_REST * limits.acceleration
            meanwhile = braking * _BUILDS_UP_LATER * limits.acceleration / limits.jerk
            return math.sqrt(meanwhile**2 + 2 * braking * room) - meanwhile  # room = v^2 / (2 braking) + v * build-up
        room = back
    return math.inf
