"""What a base must not do beside a child, whatever it is told: push, or slide along it fast."""

from __future__ import annotations

import math

from caregiver_mj.robot.clearance import Clearance
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.hand import hand_offset
from caregiver_mj.robot.se2 import Vector
from caregiver_mj.robot.separation import FOLLOWING_SPEED, GENTLE_GAP, gap_to, outwards, slide_speed
from caregiver_mj.robot.view import ChildView, View

_TOUCHED = 0.002  # metres to a child that touches the base, or does so at the next control timestep
_NO_NEARER = 0.05  # metres to a child below which nothing leads towards it, be it on a path that slides past it
_BRAKES = 1.5  # m/s^2 with which it brakes where it is touched; until then what is told keeps its own limits
# m/s by which it is asked to brake, until then, where it has little room to leave: asked for more, it would follow that
# with nearly all of its acceleration, and a child that turns round it with none.
_EASES = 0.1
_LANDS = 0.5  # share of its jerk with which it comes, until then, to what it may have: it must not overshoot
_BACK = tuple(0.05 * i for i in range(1, 9))  # metres straight away from a child where there may be room
_COMES_TO_REST, _BUILDS_UP = 1.0, 0.15  # m/s^2 with which it brakes there, and seconds until it does
# What is straight off a child changes as it walks on at the heels of a base that leaves it. From this speed on, m/s, it
# counts how that will be so many seconds later, when the base does what it is told; at twice that speed fully.
_FAST, _LATER = 0.2, 0.035
# Of several children each is asked in turn, over and over, until none of them changes it by more than so much, m/s.
_ROUNDS, _SETTLED = 8, 1e-3
_STRAYS = 0.08  # radians by which a child that goes along moves on until the base does what it is told
# The same of a base with corners: the metres that it moves on, of which the surface there makes an angle; and how fast
# such a base may then go along it as it leaves, m/s: slower than a strike, with a turn of the base. A child may run
# round a corner: by then the base, which may leave a side faster, is to be slow. So far along it looks, metres.
_MOVES_ON, _ASTRAY = 0.031, 0.034
_RUNS_ON = tuple(0.04 * i for i in range(8))


def restrain(
    view: View,
    robot: Embodiment,
    clearance: Clearance,
    seconds: float,
    is_loaded: bool,
    velocity: Vector,
    before: Vector,
) -> tuple[Vector, bool]:
    """Takes from a velocity of the base what leads towards a child that is at it, or fast along one nearby.

    What the base is told is more than its planned velocity: feedback takes it back to where it should be, and so
    towards a child that has pushed it off.

    Args:
        view: What is seen.
        robot: The robot.
        clearance: How much room there is. Without what leads along a child the base leaves it straighter than it
            would, where there is room for that; else it goes where it would, and slowly.
        seconds: A control timestep.
        is_loaded: Whether there is a candle in the hand, which then needs room as well.
        velocity: That the base would be told, m/s.
        before: What it was told a control timestep ago, m/s: it brakes from that no harder than it may.

    Returns:
        What is left of the velocity, and whether a child touches the base: then it must not take its time.
    """
    # Where it is not known to the millimetre who touches whom, it keeps its limits, and is slow sooner.
    is_touched = not view.unsure and any(gap_to(view.base, robot, child) < _TOUCHED for child in view.children)
    left, rounds = velocity, _ROUNDS if len(view.children) > 1 else 1
    for _ in range(rounds):
        wanted = left
        for child in view.children:
            left = _restrained(view, robot, clearance, seconds, is_loaded, is_touched, child, left, before)
        if rounds == 1 or math.dist(left, wanted) < _SETTLED:
            return left, is_touched
    # What one child leaves leads towards another one: it brakes.
    speed = math.hypot(*before)
    kept = 1.0 - seconds * _BRAKES / speed if is_touched and speed > seconds * _BRAKES else 0.0
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
    room = gap_to(view.base, robot, child) - view.unsure
    if room >= GENTLE_GAP:
        return velocity
    vx, vy = velocity
    offset = child.position[0] - view.base[0], child.position[1] - view.base[1]
    dx, dy = outwards(robot, view.base[2], offset)
    leaves = -(before[0] * dx + before[1] * dy) / math.hypot(dx, dy)
    if later := _LATER * min(1.0, max(0.0, leaves / _FAST - 1.0)):
        x = offset[0] + later * (child.velocity[0] - before[0])
        y = offset[1] + later * (child.velocity[1] - before[1])
        offset = x, y
        dx, dy = outwards(robot, view.base[2], offset)
    away = math.hypot(dx, dy)
    x, y = dx / away, dy / away
    # Touched by any, it is told at once.
    bounds = (seconds * _BRAKES, math.inf) if is_touched else (math.inf, _LANDS * robot.limits.as_told.jerk)
    towards, told = vx * x + vy * y, before[0] * x + before[1] * y
    if room < _NO_NEARER:
        towards = min(towards, _bounded(told, 0.0, seconds, *bounds))
    corners = _corners(robot, view.base[2], offset)
    strays = corners[0] if corners else _STRAYS
    slower = robot.limits.slowing(max(0.0, room) / FOLLOWING_SPEED - view.age)
    slides = max(0.0, slide_speed(room) + strays * min(0.0, towards)) + slower
    if any(corners):
        slowing, later = robot.limits.as_told.slowing, _LATER + view.age
        leaving = min(
            (_ASTRAY + slower) / corner + slowing(on / FOLLOWING_SPEED - later)
            for on, corner in zip(_RUNS_ON, corners, strict=True)
            if corner
        )
        towards = max(towards, -_bounded(-told, leaving, seconds, *bounds))
    across = vy * x - vx * y
    way = math.copysign(1.0, across)
    most = _bounded(way * (before[1] * x - before[0] * y), slides, seconds, *bounds)
    if abs(across) > max(most, slides):
        # What is left leads straighter away from the child than its way does: no faster than there is room for.
        on_its_way = towards * max(0.0, most) / abs(across)
        slowed = min(on_its_way, -_speed_back(view, robot, clearance, is_loaded, (x, y)))
        towards = max(towards, slowed if is_touched else min(slowed, told + _EASES))
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
    gently that it does not go beyond it.

    Args:
        speed: So fast it is.
        most: So fast it may be.
        seconds: A control timestep.
        change: By how much that may change within one, m/s.
        jerk: With which its acceleration goes at the end, m/s^3; infinite if it may go at once.
    """
    off = most - speed
    if off <= 0.0:
        return max(most, speed - change)
    return speed + min(off, change, seconds * math.sqrt(2 * jerk * off))


def _speed_back(view: View, robot: Embodiment, clearance: Clearance, is_loaded: bool, child: Vector) -> float:
    """How fast the base may go straight away from a child, in a direction, to come to rest where there is room, m/s."""
    here, room = view.base[:2], 0.0
    hand = hand_offset(view, robot) if is_loaded else None
    for back in _BACK:
        there = here[0] - back * child[0], here[1] - back * child[1]
        if not clearance.can_stand(there) or (hand and not clearance.hand_has_room(here, there, hand)):
            meanwhile = _COMES_TO_REST * _BUILDS_UP  # room = v^2 / (2 braking) + v * build-up, solved for v
            return math.sqrt(meanwhile**2 + 2 * _COMES_TO_REST * room) - meanwhile
        room = back
    return math.inf
