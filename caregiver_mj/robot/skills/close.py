"""Close: swing a gate shut until it latches."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans import layout
from caregiver_mj.robot import geometry
from caregiver_mj.robot.driver import TIME_OUT
from caregiver_mj.robot.geometry import Pose, hand_rotation
from caregiver_mj.robot.kinematics import ATTEMPTS, Arm, arm_of
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import ReachPath, guesses
from caregiver_mj.robot.separation import is_child_at_arm, is_child_at_line
from caregiver_mj.robot.skills.retrieve import CHILD_BESIDE, NEAR_SOON
from caregiver_mj.robot.skills.skill import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.robot.view import View

# Poses of the base in the landing's frame, x and y, m, and yaw, rad, and distances of the hand from the hinge, m, in
# the order of trial.
_STANDS = tuple(itertools.product((-0.73, -0.70), (0.2, 0.1, 0.0), (0.0, 0.4, -0.4)))
_FROM_HINGE = (0.30, 0.35)
_PITCH = math.radians(65.0)  # of the hand, which points along the panel; straight down it reaches less far
_DEPTH, _OVER = 0.025, 0.05  # m; pinch point below the panel's top, and above it before and after
_STEP = math.radians(28.0)  # greatest step between poses on the arc, between which the hand slides along the panel
# Push past the stop, and pull back to test the latch: on this way each finger in turn is clear of the panel.
_BEYOND, _TEST = math.radians(4.0), math.radians(6.3)
_MEETS = 0.09  # m/s; speed of the hand as a finger meets the panel or pulls at the latch
_ASTRIDE = 0.021  # m; distance of each finger from the panel's middle
# m; distance of a child from the gate below which the hand stays in, and closes slowly. Within `CHILD_BESIDE` it stops
# or creeps back.
_CHILD_AWAY, _CHILD_NEAR = 0.55, 0.45


class Closing(NamedTuple):
    """A robot's plan to close a gate."""

    base: Pose  # in the landing's frame, with x towards the stairs
    path: ReachPath  # of the arm: over the panel (1), astride it (2), along its arc, back to the tucked arm
    radius: float  # m; distance of the hand from the hinge
    pushed: int  # pose with the gate pushed to its stop; the next one tests the latch
    metres: list[float]  # m; motion of the hand on each line of the path, see `ReachPath.longest`

    def speed(self, line: int, slowly: bool = False) -> float:
        """Return the greatest speed of the hand on a line of the path, in lines a second."""
        return _MEETS / self.metres[line] if slowly or line in (2, self.pushed) else math.inf


class Close(Skill):
    """Closes a gate: puts the hand astride the panel, swings it to its stop, and tests the latch.

    The base rests while the arm is out, and the hand stops while a child is close. If a child stays, the hand returns
    the way it came, and the skill fails. Beside a child it returns, and leaves a latched gate, at a creep.

    Attributes:
        gate: Number of the gate.
    """

    def __init__(self, navigator: Navigator, gate: int):
        super().__init__(navigator)
        self.gate = gate
        self._mouth = list(navigator.plan.mouths.values())[gate]
        self._frame = layout.gate_frames(navigator.plan)[gate]
        self._closing = closing(arm_of(self.embodiment))
        self._at = 0  # next pose
        self._attempts, self._waits_since, self._until = 1, math.inf, 0.0
        self._withdraws = False

    def _act(self, view: View, robot: RobotMotion) -> Status:
        if self._at == 0 and not self._withdraws:
            return self._approach(view, robot)
        closes = self._at <= self._closing.pushed and not self._withdraws
        is_beside = self._is_child_within(view, CHILD_BESIDE)
        if not is_beside:
            self._waits_since = math.inf
        elif closes:
            robot.stop_reaching()
            self._waits_since = min(self._waits_since, view.now)
            if view.now > self._waits_since + TIME_OUT:
                self._withdraws, self._at = True, max(0, math.ceil(robot.reached) - 1)
            return Status.COMMITTED
        slowly = closes and self._is_child_within(view, _CHILD_NEAR)
        speed = self._closing.speed(self._at - (self._at > robot.reached), slowly)
        robot.reach(float(self._at), creeps=is_beside, speed=speed)
        if robot.reached != self._at or view.now < self._until:
            return Status.COMMITTED
        return self._come_back(robot) if self._withdraws else self._go_on(view, robot)

    def _approach(self, view: View, robot: RobotMotion) -> Status:
        """Drive to the stand before the gate, and begin to reach."""
        robot.reach(0.0)
        robot.grip(self.embodiment.grasp.open)
        if view.closed_gates[self.gate]:
            return Status.DONE
        x, y, yaw = self._closing.base
        goal = geometry.to_world(self._frame, (x, y))
        status = self.driver.drive(view, robot, goal, self._mouth, self._frame[2] + yaw)
        if status is not Status.DONE or robot.reached > 0.0 or self._is_child_within(view, _CHILD_AWAY):
            return Status.RUNNING if status is Status.DONE else status
        robot.reach_along(self._closing.path)
        self._at = 1
        return Status.COMMITTED

    def _go_on(self, view: View, robot: RobotMotion) -> Status:
        if self._at == self._closing.path.goal:
            robot.reach_along(self._closing.path)
            return Status.DONE if view.closed_gates[self.gate] else Status.FAILED
        if self._at == 2:
            robot.grip(_ASTRIDE)
        elif self._at == self._closing.pushed + 1:
            if not view.closed_gates[self.gate] and self._attempts < ATTEMPTS:
                self._attempts, self._at = self._attempts + 1, self._closing.pushed
                self._aim(view, robot)
                return Status.COMMITTED
            robot.grip(self.embodiment.grasp.open)
        self._until = view.now + robot.grip_time
        self._at += 1
        if self._closing.pushed <= self._at < self._closing.path.goal:
            self._aim(view, robot)
        return Status.COMMITTED

    def _aim(self, view: View, robot: RobotMotion) -> None:
        """Adapt the next pose to the base's position, which a leaning child can change."""
        arm, path = arm_of(self.embodiment), self._closing.path
        x, y = geometry.to_local(self._frame, view.base[:2])
        poses = [*(path.joints(float(i)) for i in range(path.goal)), arm.tucked]
        with contextlib.suppress(CaregiverError):  # keep an unreachable pose
            base = x, y, view.base[2] - self._frame[2]
            poses[self._at] = _pose(arm, base, self._closing.radius, _way()[self._at - 1], [poses[self._at]])
        self._closing = self._closing._replace(path=_path(arm, poses))
        robot.reach_along(self._closing.path)

    def _come_back(self, robot: RobotMotion) -> Status:
        if self._at == 0:
            return Status.FAILED
        if self._at == 2:
            robot.grip(self.embodiment.grasp.open)
        self._at -= 1
        return Status.COMMITTED

    def _is_child_within(self, view: View, distance: float) -> bool:
        """Return whether a child is, or may soon be, so near to the gate, or beside the arm."""
        (x, y), length, _ = layout.gate()
        opening = float(view.gates[self.gate])
        shut, now = (x, y - length), (x + length * math.sin(opening), y - length * math.cos(opening))
        hinge, *ends = (geometry.to_world(self._frame, place) for place in ((x, y), shut, now))
        at_gate = any(is_child_at_line(view, hinge, end, distance, NEAR_SOON) for end in ends)
        return at_gate or is_child_at_arm(view, self.embodiment, CHILD_BESIDE, NEAR_SOON)


@functools.cache
def closing(arm: Arm) -> Closing:
    """Return a robot's plan to close a gate, or raise CaregiverError if its arm cannot."""
    way = _way()
    for base, radius in itertools.product(_STANDS, _FROM_HINGE):
        poses = [arm.tucked]
        try:
            for i, place in enumerate(way):
                poses.append(_pose(arm, base, radius, place, poses[-1:] if i else None))
        except CaregiverError:
            continue
        path = _path(arm, [*poses, arm.tucked])
        if all(arm.clears_itself(path.joints(s)) for s in np.linspace(0.0, path.goal, 4 * path.goal)):
            metres = [path.longest(arm, line, line + 1) for line in range(path.goal)]
            return Closing(base, path, radius, len(way) - 3, metres)
    raise CaregiverError(f"the arm of '{arm.embodiment.name}' cannot close a gate")


def _path(arm: Arm, poses: Sequence[np.ndarray]) -> ReachPath:
    """Return the hand's path, gently accelerated with the panel, which swings between the fingers and hits them."""
    return ReachPath(poses, arm.embodiment.limits.arm, gently=slice(2, len(_way()) - 3))


def _way() -> list[tuple[float, float]]:
    """Return the panel's angle, rad, and the hand's height, m, of every pose with the hand out."""
    arc = np.linspace(layout.GATE_OPEN, -_BEYOND, 1 + math.ceil((layout.GATE_OPEN + _BEYOND) / _STEP)).tolist()
    over, astride = layout.gate().height + _OVER, layout.gate().height - _DEPTH
    return [(layout.GATE_OPEN, over), *((angle, astride) for angle in (*arc, _TEST - _BEYOND, 0.0)), (0.0, over)]


def _pose(
    arm: Arm, base: Pose, radius: float, place: tuple[float, float], nearest: Sequence[np.ndarray] | None
) -> np.ndarray:
    """Return joint positions for one pose, near others if given; raise CaregiverError if the arm cannot."""
    (angle, height), (hinge_x, hinge_y) = place, layout.gate().hinge
    point = geometry.to_local(base, (hinge_x + radius * math.sin(angle), hinge_y - radius * math.cos(angle)))
    rotation = hand_rotation(angle - math.pi / 2 - base[2], _PITCH)
    return arm.solve_nearest(np.array([*point, height]), rotation, nearest or guesses(arm, rotation))
