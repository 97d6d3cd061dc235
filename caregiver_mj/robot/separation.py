"""Speed and separation: how fast the base may drive near children, which of them count, and what it must not do.

The ideas are those of ISO 13482 (a mobile servant robot avoids, slows down and stops) and of ISO/TS 15066 (speed and
separation); nothing here claims to comply with them. Of several children every one counts: the base keeps what the
strictest of them asks for. Whatever the command, it does not push a child, nor slide along it fast.
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

# A base nearer to a child than so many metres leaves it first, and straight: with this cosine between motion and child
# at most.
BESIDE, LEAVING = 0.15, -0.8
FORESIGHT = 2.2  # metres within which paths are planned round a child: one farther away will be elsewhere by then
# The base must be able to stop before a child that walks towards it.
_REACTION = 0.04  # seconds of control and servo until the base begins to brake
_SEPARATION = 0.08  # metres that shall remain
# m/s with which it may turn to look for a child round a corner, to which it comes at a creep: with that no strike.
_LOOKING = 0.04
_FAR = 2.0  # metres beyond which a child does not slow the base down
FREE = 1.5  # metres to every child from which on neither feedback nor arm is bounded
_PASSING, _PASSING_GAP = 0.35, 0.4  # share of the speed that counts so at no distance, and metres where none does
# How a base may move along a child, or turn, that comes to touch it: slower than what counts as a strike, 0.05 m/s.
_SLIDE_SPEED, _SLIDE_TOUCHING = 0.02, 0.025  # m/s of its surface; the second where it touches it already
_TURN_SPEED = 0.01  # m/s, the same of a turn
_SLIDE_TOWARDS = 0.2  # cosine between motion and child, at most: what slides past and does not push
_BUILDS_UP = 0.2  # seconds until a change of rate has built up
_SLIDE_RATES = (1.0, 0.8, 0.6, 0.45, 0.33, 0.25, 0.18, 0.12, 0.08, 0.05)  # that are tried
_COMING_SPEED = 0.1  # m/s towards the robot
_COMING_GAP, _TOUCHING_GAP = 0.9, 0.01  # metres
GENTLE_GAP = 0.10  # metres to a child below which the base yields to a push
# How much faster than a creep the base then returns to where it shall be, 1/s, per metre by which there is more room:
# so fast it can brake before a child that comes.
_RELEASED = 0.6
GENTLE_UNSEEN = 0.01  # m/s, for that creep, where one may be unseen: it may peek meanwhile, both to be no strike
_AT_HAND = 0.5  # metres from the arm to the middle of a child below which the arm yields to a push
_TUCKED = 0.05  # share of the reach below which it is tucked
_WITHIN = 1e-6  # metres, of a vector of which only the direction is known
_SOON = 0.8  # seconds within which a child goes on as it walks now
_HEAD_ON = 0.5  # cosine between motion and child above which a base that cannot stop before it on its path leaves that
_TOUCHED = 0.002  # metres to a child that touches the base, or does so at the next control timestep
_NO_NEARER = 0.05  # metres to a child below which nothing leads towards it, and it stands in the way of a path past it
_BRAKES = 0.8  # share of its limit with which it brakes where it is touched; until then commands keep it
# m/s by which it is asked to brake, until then, where it has little room to leave: asked for more, it would follow that
# with nearly all of its acceleration, and a child that turns round it with none.
_EASES = 0.1
_BACK = tuple(0.05 * i for i in range(1, 9))  # metres straight away from a child where there may be room
# Share of its limits with which it brakes there; and how often the time that their jerk takes to that, until it does.
_COMES_TO_REST, _BUILDS_UP_LATER = 0.55, 2.5
# What is straight off a child changes as it walks on at the heels of a base that leaves it. From this speed on, m/s, it
# counts how that will be so many seconds later, when the base follows its command; at twice that speed fully.
_FAST, _LATER = 0.2, 0.035
_ROUNDS = 8  # in which each of several children is asked in turn, until none of them changes it any more
_STRAYS = 0.08  # radians by which a child that goes along moves on until the base follows its command
# The same of a base with corners: the metres that it moves on, of which the surface there makes an angle; and how fast
# such a base may then go along it as it leaves, m/s: slower than a strike, with a turn of the base. A child may run
# round a corner: by then the base, which may leave a side faster, is to be slow. So far along it looks, metres.
_MOVES_ON, _ASTRAY = 0.031, 0.034
_RUNS_ON = tuple(0.04 * i for i in range(8))


def is_alone(view: View, robot: Embodiment, apart: float = _SEPARATION + _FAR) -> bool:
    """Return whether every child, also one that may be there unseen, is farther from the base than so many metres.

    By default that is too far away for anything to be bounded.
    """
    return _nearest(view) > robot.footprint + CHILD_RADIUS + apart


@functools.lru_cache(maxsize=1)  # many ask at the same moment
def _nearest(view: View) -> float:
    """Metres from the base's middle to that of the nearest child, or of one that may be there unseen."""
    nearest = view.child_distance(view.base[:2])
    for child in view.hidden + view.lurking:
        nearest = min(nearest, math.dist(child.position, view.base[:2]))
    return nearest


def gap(view: View, robot: Embodiment, unseen: tuple[ChildView, ...] = ()) -> float:
    """Return the metres between the robot's base and the nearest child, or where it may be unseen."""
    nearest = math.inf
    for child in view.children + unseen:  # a plain loop: this is asked at every control timestep
        nearest = min(nearest, gap_to(view.base, robot, child))
    return nearest


def catch_up_speed(gap: float, gentle: float = CREEP) -> float:
    """Return how fast a base that is off its reference may return to it, m/s, with a child so many metres away.

    The child may be in between, or come there.
    """
    return gentle + _RELEASED * max(0.0, gap - GENTLE_GAP)


def is_child_at_hand(view: View, robot: Embodiment, reached: float) -> bool:
    """Return whether a child is so near to the hand, or to the arm that is out, that it might walk into it.

    Args:
        view: What is seen.
        robot: The robot.
        reached: How far its hand reaches out; tucked it is over the child's head.
    """
    if reached < _TUCKED or gap(view, robot) > FREE:
        return False
    edge, hand = geometry.to_world(view.base, (robot.footprint, 0.0)), hand_position(view, robot)[:2].tolist()
    return is_child_at_line(view, edge, hand, _AT_HAND, 0.0)


def comes(view: View, robot: Embodiment) -> bool:
    """Return whether a child walks towards the robot, or has just run into it."""
    for child in view.children:
        room = gap_to(view.base, robot, child)
        comes_at = -_along(child.velocity, _offset(view.base, child))
        if room < _TOUCHING_GAP or (room < _COMING_GAP and comes_at > _COMING_SPEED):
            return True
    return False


def is_in_the_way(view: View, robot: Embodiment, points: Iterable[Vector]) -> bool:
    """Return whether a child stands, or will stand shortly, where the base would pass through some points."""
    near = robot.footprint + CHILD_RADIUS + _NO_NEARER
    places = child_places(view.children)
    return any(math.dist(point, place) < near for point in points for place in places)


def near_children(view: View, place: Vector) -> tuple[ChildView, ...]:
    """Return the children round whom a base at a place plans its way."""
    return tuple(child for child in view.children if math.dist(child.position, place) < FORESIGHT)


def child_places(children: Iterable[ChildView]) -> list[Vector]:
    """Return where children are, and where each will be shortly if it walks on."""
    places = []
    for child in children:
        (x, y), (vx, vy) = child.position, child.velocity
        places += [(x, y), (x + _SOON * vx, y + _SOON * vy)]
    return places


def is_child_at_line(view: View, start: Vector, end: Vector, near: float, within: float) -> bool:
    """Return whether a child's middle is near a line, along which the arm is or moves, or may be soon.

    Args:
        view: What is seen.
        start: Where the line begins, metres.
        end: Where it ends.
        near: Metres below which it is near.
        within: Seconds in which the children may come nearer as they walk now.
    """
    far = near + math.dist(start, end)
    for (x, y), (vx, vy) in view.children:
        if math.dist((x, y), start) - within * math.hypot(vx, vy) > far:
            continue  # most of the time
        for time in (0.0, within / 2, within):
            if geometry.distance_to_line((x + time * vx, y + time * vy), start, end) < near:
                return True
    return False


def child_cells(children: Iterable[ChildView], plan: FloorPlan) -> set[Cell]:
    """Return the cells of these places."""
    return {plan.cell_at(place) for place in child_places(children)}


def allowed_rate(
    view: View,
    robot: Embodiment,
    velocity: Vector,
    acceleration: Vector = (0.0, 0.0),
    present: Vector = (0.0, 0.0),
    limits: RobotLimits | None = None,
) -> float:
    """Return the share of its planned velocity, m/s, at which the base can still stop before it touches any child.

    Its planned acceleration, m/s^2, tells what the path leaves it to brake with, see `RobotLimits.braking`; its present
    velocity, m/s, how fast it leaves a child already. The limits are those in force, by default the robot's.

    Speed and separation monitoring (the idea of ISO/TS 15066, section 5.5.4): while robot and child close in, the
    distance between them must cover what the robot needs to react and brake, and what the child walks meanwhile.
    At a rate r of its planned speed, stopping takes r * speed / deceleration + build-up seconds.

    A base that does not lead towards the child may leave, or slide past, so fast that its surface can slow down to a
    creep along the child before that is at it. Else the two could keep each other where they are: the child waits for
    the place in which the base waits for the child to go.
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
    """The same for one child, for a velocity that is not zero."""
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
    # Close by, a path past the child counts as one that leads towards it: it may turn, and so may the path.
    approach = towards + speed * _PASSING * min(1.0, max(0.0, 1.0 - room / _PASSING_GAP))
    if towards <= LEAVING * speed:
        return 1.0  # what is left of `across` is taken away where a child may come to touch, see `restrain`
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
    """Return whether a base that moves so, m/s and m/s^2, has no more than the way left that it needs to stop.

    A path that itself speeds up, or turns, slows down later than `allowed_rate` reckons with. The base then leaves it:
    a protective stop (ISO 10218-1). A linear change of acceleration costs (a + b)^2 / (2 b jerk) of time, with b that
    of braking.
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
    """The share of a velocity, m/s towards a child and across, from which the surface slows down before it is touched.

    So fast the child may come, and the base leaves it now, m/s; `towards` is negative for a velocity away from it.
    """
    for rate in _SLIDE_RATES:
        closing = comes_at + max(rate * towards, -leaves)
        until_touched = max(0.0, gap) / closing if closing > 0.0 else math.inf
        if rate * across <= slide_speed(gap) + limits.slowing(until_touched - _REACTION - view.age):
            return rate
    return 0.0


def _walking_speed(view: View, child: ChildView) -> float:
    """How fast a child may come, m/s: as toddlers do, and one that runs as fast as it does."""
    return max(view.child_comes, min(view.child_runs, math.hypot(*child.velocity)))


def slide_speed(gap: float) -> float:
    """Return how fast the surface of a base may be along a child so many metres away, however soon that comes, m/s."""
    return _SLIDE_TOUCHING if gap < _TOUCHING_GAP else _SLIDE_SPEED


def allowed_turning(view: View, robot: Embodiment, velocity: Vector, turning: tuple[float, float]) -> float:
    """Return how fast the base may turn, rad/s, to turn no faster than at a creep when a child comes to touch it.

    Args:
        view: What is seen.
        robot: The robot.
        velocity: Of the base now, m/s.
        turning: Rate, rad/s, and acceleration, rad/s^2, of the base's turn now.
    """
    limits, speed = robot.limits.yaw, math.hypot(*velocity)
    room, closing = _nearest(view) - robot.footprint - CHILD_RADIUS, view.child_runs + speed
    if turning == (0.0, 0.0) and limits.slowing(room / closing - _REACTION - view.age) > limits.velocity:
        return math.inf  # whatever turn begins now can end in time
    # Before a turn that speeds up can slow down its acceleration has to go, and meanwhile it becomes faster still.
    rate, acceleration = turning
    speeds_up = max(0.0, acceleration if rate >= 0.0 else -acceleration)
    delay, most = speeds_up / limits.jerk, abs(rate) + speeds_up**2 / (2 * limits.jerk)
    allowed = math.inf
    # One that does not see all round must turn to see one that may be at it.
    unseen = view.unseen
    for child in view.children + unseen:
        gap = _gap_however_turned(view.base, robot, child)
        if gap < _FAR:
            creep, comes_at = _TURN_SPEED / robot.footprint, view.child_runs
            if child in unseen:
                creep, comes_at = max(creep, (_LOOKING - speed) / robot.footprint), view.child_comes
            closing = comes_at + max(0.0, _along(velocity, _offset(view.base, child)))
            time = max(0.0, gap) / closing - _REACTION - view.age
            too_fast = most > creep + limits.slowing(time - delay)
            allowed = min(allowed, creep if too_fast else creep + limits.slowing(time))
    return allowed


def _gap_however_turned(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Metres between child and base, whose corners may turn towards it."""
    return math.dist(child.position, base[:2]) - robot.footprint - CHILD_RADIUS


def gap_to(base: Pose, robot: Embodiment, child: ChildView) -> float:
    """Return the metres between base and child."""
    return math.hypot(*_way_to(base, robot, child)) - robot.rounding - CHILD_RADIUS


def _offset(base: Pose, child: ChildView) -> Vector:
    return child.position[0] - base[0], child.position[1] - base[1]


def _way_to(base: Pose, robot: Embodiment, child: ChildView) -> Vector:
    return outwards(robot, base[2], _offset(base, child))


def _along(velocity: Vector, way: Vector) -> float:
    """How much of a velocity leads along a way, m/s."""
    return (velocity[0] * way[0] + velocity[1] * way[1]) / (math.hypot(*way) or 1.0)


def outwards(robot: Embodiment, yaw: float, offset: Vector) -> Vector:
    """Return the vector to a place from the nearest point within the base's sides: square to its surface there.

    Of a round base it is that from its middle; that of a box-shaped one is square to a side, except at its corners.

    Args:
        robot: The robot.
        yaw: Heading of its base, radians.
        offset: Of the place from the base's middle, in the house, metres.
    """
    if robot.sides == (0.0, 0.0):
        return offset if offset != (0.0, 0.0) else (_WITHIN, 0.0)  # seen at its very middle: some direction
    x, y = geometry.rotate(-yaw, offset)
    beyond_x, beyond_y = abs(x) - robot.sides[0], abs(y) - robot.sides[1]
    if max(beyond_x, beyond_y) <= 0.0:  # it is seen within the base, where no child can be
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
    """Take from a velocity of the base what leads towards a child that is at it, or fast along one nearby.

    The command is more than the planned velocity: feedback takes it back to where it should be, and so
    towards a child that has pushed it off.

    Args:
        view: What is seen.
        robot: The robot.
        clearance: How much room there is. Without what leads along a child the base leaves it straighter than it
            would, where there is room for that; else it goes where it would, and slowly.
        seconds: A control timestep.
        is_loaded: Whether there is a candle in the hand, which then needs room as well.
        velocity: The command that the references want, m/s.
        before: The command a control timestep ago, m/s: it brakes from that no harder than it may.

    Returns:
        What is left of the velocity, and whether a child touches the base: then it must not take its time.
    """
    # Where it is not known to the millimetre who touches whom, it keeps its limits, and is slow sooner.
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
    # What one child leaves leads towards another one: it brakes.
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
    """What is left of a velocity of the base, m/s, for the sake of one child."""
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
    # Touched by any, it is commanded at once.
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
        # What is left leads straighter away from the child than its way does: no faster than there is room for.
        on_its_way = towards * max(0.0, most) / abs(across)
        slowed = min(on_its_way, -_speed_back(view, robot, clearance, is_loaded, (x, y), command_limits))
        towards = max(towards, slowed if is_touched else min(slowed, commanded + _EASES))
    across = way * min(abs(across), most)
    return towards * x - across * y, towards * y + across * x


def _corners(robot: Embodiment, yaw: float, offset: Vector) -> tuple[float, ...]:
    """Radians by which the way off a base turns as a child at an offset moves on a little along it.

    Here, and where the child is when it has run on by each of `_RUNS_ON`, whichever way; empty of a round base.
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
    """What is asked of a base that may have so much speed at most, m/s.

    A faster one brakes as hard as it may. One that speeds up, or that leaves a child and ceases to, comes to it so
    gently that it does not go beyond it. In a control timestep its speed changes by `change` at most; the jerk, m/s^3,
    is that with which its acceleration goes at the end, infinite if it may go at once.
    """
    off = most - speed
    if off <= 0.0:
        return max(most, speed - change)
    return speed + min(off, change, seconds * math.sqrt(2 * jerk * off))


def _speed_back(
    view: View, robot: Embodiment, clearance: Clearance, is_loaded: bool, child: Vector, limits: Limits
) -> float:
    """How fast the base may go straight away from a child, in a direction, to come to rest where there is room, m/s."""
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
