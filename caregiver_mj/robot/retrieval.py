"""Stances and arm paths to pick up a fallen candle, or a small thing, from a table or the floor, clear of the house."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import threading
from collections.abc import Callable, Generator, Iterable, Sequence
from typing import Any, Generic, TypeVar

import mujoco
import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.robot import geometry
from caregiver_mj.robot.embodiment import Embodiment
from caregiver_mj.robot.geometry import UPRIGHT, Pose, Vector, hand_rotation, upright_grip
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.reach import LOW, TRAY_SPOTS, ReachPath, pick_up_path, retrieval_paths, share_at, tray_path
from caregiver_mj.robot.separation import is_child_at_line
from caregiver_mj.robot.view import View

_ELSEWHERE = 1e3  # m; place of the child out of the way, as it will have moved
_RESTING = 0.004  # m; penetration of a resting candle
_MARGIN = 0.005  # m; gap between the robot and everything


class PlanningScene:
    """Collision checks against walls, furniture, floor and candles, by MuJoCo.

    It takes over a specification of the house with robot, toddler and candles, named as in the simulation. Nothing
    moves in it: it sets poses and reads contacts, one thread at a time. Making it is as costly as making the house, so
    make it on first use.
    """

    def __init__(self, spec: mujoco.MjSpec, plan: FloorPlan, robot: Embodiment):
        spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # sleeping bodies have no contacts
        for geom in spec.geoms:  # before compiling, which makes the bounding boxes
            if geom.name.startswith("robot/"):
                geom.margin = _MARGIN
            elif geom.name.startswith("table_") and geom.name.endswith("/top"):
                geom.size[:2] += layout.TABLE_MARGIN
        self._lock = threading.Lock()
        self._model = model = spec.compile()
        self._data = mujoco.MjData(model)
        names = [model.geom(i).name for i in range(model.ngeom)]
        self._robot = np.array([name.startswith("robot/") for name in names])
        self._pads = np.array([name.endswith("_pad") for name in names])
        things = [hazard.element for hazard in plan.hazards.at(Where.ON_TABLE)]
        # Geoms of each thing, and the opening of the hand for it; the last are for NOTHING.
        self._things = [np.array([name.startswith(f"{one}/") for name in names]) for one in things]
        self._things.append(np.zeros(len(names), bool))
        self._open = [*map(robot.grasp.opened, layout.things(plan)), robot.grasp.open]
        joints = (robot.names.base, robot.names.arm, robot.names.fingers)
        rows = ([model.joint(f"robot/{name}").qposadr[0] for name in part] for part in joints)
        self._base, self._arm, self._fingers = rows
        candles = [model.joint(f"{one}/joint").qposadr[0] for one in things]
        self._candles = np.array(candles, int)[:, None] + np.arange(7)
        self._hand = self._data.body("robot/hand")
        self._data.qpos[model.joint("toddler/x").qposadr[0]] = _ELSEWHERE

    def __deepcopy__(self, memo: dict[int, Any]) -> PlanningScene:
        """Return itself: calls leave no state, and a lock serialises threads."""
        return self

    def is_free(
        self, base: Sequence[float], arm: Iterable[np.ndarray], candles: np.ndarray, between: int, held: bool = False
    ) -> bool:
        """Return whether the robot touches nothing with its base at (x, y, yaw) and its arm at each of some postures.

        Postures are joint positions, rad, (joints,); the hand is open. Candles have poses (candles, 7), m and
        quaternions. Candle `between`, or NOTHING, may be between the fingers. If `held`, the hand takes it along from
        the first posture, and it must touch nothing either once lifted.
        """
        qpos = self._data.qpos
        carried: tuple[np.ndarray, np.ndarray] | None = None  # the candle in the hand's frame
        with self._lock:
            qpos[self._base], qpos[self._candles], qpos[self._fingers] = base, candles, self._open[between]
            for joints in arm:
                qpos[self._arm] = joints
                mujoco.mj_kinematics(self._model, self._data)
                if held and carried is None:
                    carried = self._in_hand(between)
                elif carried is not None:
                    self._carry(between, *carried)
                if self._touches(self._things[between], held):
                    return False
        return True

    def _in_hand(self, candle: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of a candle, position (3,) and quaternion (4,), in the hand's frame."""
        back, turn, place, orientation = np.empty(3), np.empty(4), np.empty(3), np.empty(4)
        pose = self._data.qpos[self._candles[candle]]
        mujoco.mju_negPose(back, turn, self._hand.xpos, self._hand.xquat)
        mujoco.mju_mulPose(place, orientation, back, turn, pose[:3], pose[3:])
        return place, orientation

    def _carry(self, candle: int, place: np.ndarray, orientation: np.ndarray) -> None:
        """Move a candle along with the hand, by its pose in the hand's frame."""
        position, quaternion = np.empty(3), np.empty(4)
        mujoco.mju_mulPose(position, quaternion, self._hand.xpos, self._hand.xquat, place, orientation)
        self._data.qpos[self._candles[candle]] = [*position, *quaternion]
        mujoco.mj_kinematics(self._model, self._data)

    def _touches(self, thing: np.ndarray, held: bool) -> bool:
        """Return whether the robot, or the thing that it holds, whose geoms are bool (n,), has a forbidden contact."""
        mujoco.mj_collision(self._model, self._data)
        one, two = self._data.contact.geom.T
        mine = self._robot | (held & thing)
        gripping = (self._pads[one] & thing[two]) | (self._pads[two] & thing[one])
        # The support of a candle is no obstacle before it is lifted.
        resting = held & (thing[one] | thing[two]) & (self._data.contact.dist > -_RESTING)
        return bool(((mine[one] != mine[two]) & ~gripping & ~resting).any())


_DIRECTIONS = 16  # around a point
_MOST_STANDS = 40  # most stands tried, nearest first, to limit the time
_NO_TURNING = 2.0  # m; detour worth taking to stand where the base can turn
_PAST_CHILD, _SOON, _CHILD_AT_ARM = 3.0, 0.5, 0.6  # m; detour worth taking to keep children, for s, m away from the arm
_LIFTS = (0.0, 0.25)  # m; lift before the hand turns; the second clears a wall
_OPEN_ANGLE = 0.5  # rad; angle to both sides that must be free for laying it down
_HEADINGS = (0.0, math.pi / 2)  # of the hand over a small thing, in the base's frame
_CHILD_AWAY = 1.7  # m; distance of a child from the base for laying down
_CHECKS = 49  # poses on the arm's path checked for collisions
# ms; durations of pieces of a search: a route, a pose check, a path check, an attempt at inverse kinematics.
_ROUTE, _POSE, _WAY, _GUESS = 0.2, 0.1, 3.0, 6.0
Heights = tuple[float, ...]  # of the tables' tops, m
Found = TypeVar("Found")
Work = Generator[float, None, Found]  # yields ms
_AT_ONCE = 12.0  # ms; stated duration of a search in a control step, which its last piece may exceed


@dataclasses.dataclass(frozen=True)
class Stance:
    """Pose of the base to pick up or lay down a candle, and the arm's path from there."""

    base: Pose  # pose (x, y, yaw), m and rad
    path: ReachPath  # the arm's path; its last pose is the grip
    # rad; pitch of the hand to lay the candle down again; None if it is upright in the tucked arm
    pitch_down: float | None = None


class RetrievalPlanner:
    """Finds stances in one house for candles at rest; the arm avoids the children's present places if it can."""

    def __init__(self, navigator: Navigator, make_scene: Callable[[Heights | None], PlanningScene]):
        # The planning scene is costly and rarely needed: made on first use.
        self._navigator, self._make_scene = navigator, make_scene
        self._heights: Heights | None = None
        self._robot, self._arm = navigator.robot, arm_of(navigator.robot)
        self._things = layout.things(navigator.plan)

    @functools.cached_property
    def _scene(self) -> PlanningScene:
        return self._make_scene(self._heights)

    def prepare(self, heights: Heights | None) -> None:
        """Make the planning scene in advance, unless there is one for tables of these heights, m."""
        if heights != self._heights:
            self._heights = heights
            vars(self).pop("_scene", None)
        self._scene  # noqa: B018 (kept once asked for)
        if self._navigator.plan.floor_cells:
            for spot in TRAY_SPOTS:
                tray_path(self._arm, spot)
            for reach, heading in itertools.product(self._robot.postures.lying_reaches, _HEADINGS):
                pick_up_path(self._arm, reach, heading)

    def to_pick_up(self, view: View, candle: int) -> Work[Stance | None]:
        """Search for the nearest stance to grip a candle; return None without one.

        Grips with which the candle is upright in the tucked hand come first; else it is carried level or, if it stands
        on its head, head down.
        """
        axis = view.candle_axis(candle)
        on_its_head = axis[2] < -UPRIGHT
        thing, usual_pitch = self._things[candle], self._robot.postures.hand_pitch
        point = view.candles[candle] + (thing.height - thing.grip if on_its_head else thing.grip) * axis
        if abs(axis[2]) < UPRIGHT:
            point[2] += self._robot.grasp.above_lying
        stands = yield from self._stands(view, candle, point)
        if not on_its_head:
            for base, reach in stands:
                grip = upright_grip(_turned(axis, -base[2]), usual_pitch)
                if path := (yield from self._lifting_path(view, candle, base, (reach, point[2]), grip)):
                    return Stance(base, path)
        for base, reach in stands:
            ahead = _turned(axis, -base[2])
            heading = 0.0 if on_its_head else math.atan2(ahead[1], ahead[0])
            pitches = (usual_pitch,) if on_its_head else self._robot.postures.lying_pitches
            for pitch, turn in itertools.product(pitches, (0.0, math.pi)):
                grip = hand_rotation(heading + turn, pitch)
                if path := (yield from self._lifting_path(view, candle, base, (reach, point[2]), grip)):
                    return Stance(base, path, pitch + math.pi / 2 if on_its_head else pitch)
        return None

    def to_pick_up_small(self, view: View, thing: int) -> Work[Stance | None]:
        """Search for the nearest stance to grip a thing on the floor; return None without one."""
        for base, reach in (yield from self._stands(view, NOTHING, view.things[thing])):
            for heading in _HEADINGS:
                path = pick_up_path(self._arm, reach, heading)
                is_clear = path is not None and self._is_clear(view, NOTHING, base, path)
                yield _WAY
                if path is not None and is_clear:
                    return Stance(base, path)
        return None

    def to_lay_down(self, view: View, candle: int, pitch: float) -> Work[Stance | None]:
        """Search for the nearest stance to lay a candle on open floor away from children, with a hand's pitch, rad."""
        path = yield from self._path_down(pitch, self._things[candle])
        if path is None:
            return None
        # The candle is in the hand, and no obstacle.
        gone = view.candles.copy()
        gone[candle, 2] = -1.0
        view = dataclasses.replace(view, candles=gone)
        navigator = self._navigator.loaded
        here = navigator.nearest_cell(view.base[:2])
        routes = []
        for cell in navigator.plan.free_cells:
            if route := navigator.route(here, cell):
                routes.append((len(route), cell))
            yield _ROUTE
        places = [(route, tuple(navigator.plan.position(cell).tolist())) for route, cell in sorted(routes)]
        # Places near children come last: there the robot waits until they have gone on.
        for _, place in sorted(places, key=lambda each: view.child_distance(each[1]) < _CHILD_AWAY):
            if not navigator.clearance.can_stand(place):
                continue
            for yaw in _directions():
                # Free to both sides, too, for room to pick it up again.
                bases = [(*place, yaw + aside) for aside in (0.0, -_OPEN_ANGLE, _OPEN_ANGLE)]
                for base in bases:
                    is_clear = self._is_clear(view, candle, base, path)
                    yield _WAY
                    if not is_clear:
                        break
                else:
                    return Stance(bases[0], path)
        return None

    def _path_down(self, pitch: float, thing: layout.Thing) -> Work[ReachPath | None]:
        """Search for the arm's path to lay a thing on the floor with a pitch of the hand, rad; None without one."""
        postures, height = self._robot.postures, thing.width + self._robot.grasp.above_lying
        for reach in (postures.floor_reach, *postures.lying_reaches):
            if path := (yield from self._path((reach, height), hand_rotation(0.0, pitch))):
                return path
        return None

    def _stands(self, view: View, candle: int, point: np.ndarray) -> Work[list[tuple[Pose, float]]]:
        """Search for poses of the base to reach for a point, nearest first, with the reach, m."""
        navigator, clearance = self._navigator, self._navigator.clearance
        here, there = navigator.nearest_cell(view.base[:2]), (float(point[0]), float(point[1]))
        stands = []
        for yaw, reach in itertools.product(_directions(), self._robot.postures.lying_reaches):
            place = geometry.to_world((point[0], point[1], yaw), (-reach, 0.0))
            route = navigator.route(here, navigator.nearest_cell(place)) if clearance.can_stand(place) else None
            if route is not None:
                cost = math.dist(place, view.base[:2]) + navigator.plan.cell_size * len(route)
                cost += 0.0 if clearance.can_turn(place) else _NO_TURNING
                cost += _PAST_CHILD if is_child_at_line(view, place, there, _CHILD_AT_ARM, _SOON) else 0.0
                stands.append((cost, (*place, yaw), reach))
            yield _ROUTE
        clear: list[tuple[Pose, float]] = []
        for _, base, reach in sorted(stands):
            if self._is_clear(view, candle, base, None):
                clear.append((base, reach))
            if len(clear) == _MOST_STANDS:
                break
            yield _POSE
        return clear

    def _lifting_path(
        self, view: View, candle: int, base: Pose, target: Vector, grip: np.ndarray
    ) -> Work[ReachPath | None]:
        """Search for the arm's path to lift a candle at a point (distance ahead, height) without contacts of either."""
        for lift in _LIFTS:
            path = yield from self._path(target, grip, lift)
            if path is None:
                return None
            is_clear = self._is_clear(view, candle, base, path, lifts=True)
            yield 2 * _WAY
            if is_clear:
                return path
        return None

    def _is_clear(self, view: View, candle: int, base: Pose, path: ReachPath | None, lifts: bool = False) -> bool:
        """Return whether robot and lifted candle touch nothing along a path of the arm, or with the arm tucked."""
        if path is None:
            return self._scene.is_free(base, [self._arm.tucked], view.candle_poses, candle)
        last = share_at(self._arm, path, LOW) if candle == NOTHING else path.goal  # it would end in the floor
        way = [path.joints(s) for s in np.linspace(last, 0.0, _CHECKS)]  # the tightest part comes first
        return self._scene.is_free(base, way, view.candle_poses, candle) and (
            not lifts or self._scene.is_free(base, way, view.candle_poses, candle, held=True)
        )

    def _path(self, target: Vector, grip: np.ndarray, lift: float = 0.0) -> Work[ReachPath | None]:
        """Search for the arm's path to a point (distance ahead, height); None out of reach."""
        for path in retrieval_paths(self._arm, np.array([target[0], 0.0, target[1]]), grip, lift):
            yield _GUESS
            if path:
                return path
        return None


def _directions() -> list[float]:
    return [math.tau * i / _DIRECTIONS for i in range(_DIRECTIONS)]


def _turned(vector: np.ndarray, yaw: float) -> np.ndarray:
    """Return a vector (3,) turned about the vertical."""
    return np.array([*geometry.rotate(yaw, (vector[0], vector[1])), vector[2]])


class Search(Generic[Found]):
    """A long search, spread over control steps.

    It is a generator that yields the approximate duration of each piece of work, and returns the result. Durations are
    stated, not measured: progress must not depend on the load of the machine.

    Attributes:
        ended: Whether it has ended.
        found: Its result, after the end.
    """

    found: Found

    def __init__(self, work: Work[Found]):
        self._work, self.ended = work, False

    def go_on(self, milliseconds: float = _AT_ONCE) -> bool:
        """Search for some stated time; return whether the search has ended."""
        while not self.ended and milliseconds > 0.0:
            try:
                milliseconds -= next(self._work)
            except StopIteration as end:
                self.found, self.ended = end.value, True
        return self.ended
