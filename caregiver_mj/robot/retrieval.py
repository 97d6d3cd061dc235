"""Where to stand, and how to reach, to pick up a candle that has fallen: on a table or on the floor."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Generator
from typing import Generic, TypeVar

import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.robot import geometry
from caregiver_mj.robot.geometry import UPRIGHT, Pose, Vector, hand_rotation, upright_grip
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.planning_scene import PlanningScene
from caregiver_mj.robot.reach import LOW, TRAY_SPOTS, ReachPath, pick_up_path, retrieval_paths, share_at, tray_path
from caregiver_mj.robot.separation import is_child_at_line
from caregiver_mj.robot.view import View

_DIRECTIONS = 16  # round a point
_MOST_STANDS = 40  # that are tried, the nearest ones, lest it takes too long
_NO_TURNING = 2.0  # metres of detour that it is worth to stand where the base can turn
# Metres of detour that it is worth to reach where no child is, or will be in so many seconds, so near to the arm.
_PAST_CHILD, _SOON, _CHILD_AT_ARM = 3.0, 0.5, 0.6
_LIFTS = (0.0, 0.25)  # metres that the hand goes up with it before it turns; the second is to clear a wall
_OPEN_ANGLE = 0.5  # radians to both sides that must be free where it is laid down
_HEADINGS = (0.0, math.pi / 2)  # of the hand over something small, in the base's frame
_CHILD_AWAY = 1.7  # metres from a child to where the base stands then
_CHECKS = 49  # poses on the arm's way that are checked for collisions
# Milliseconds that pieces of a search take: a route, a pose checked, a way of the arm checked, a try at its kinematics.
_ROUTE, _POSE, _WAY, _GUESS = 0.2, 0.1, 3.0, 6.0
Heights = tuple[float, ...]  # of the tables' tops, metres; None stands for the usual one
Found = TypeVar("Found")
Work = Generator[float, None, Found]  # yields milliseconds
_AT_ONCE = 12.0  # stated milliseconds of a search in a control timestep; the last piece of work may come on top


@dataclasses.dataclass(frozen=True)
class Stance:
    """Where the base stands to pick a candle up, or to lay it down, and the arm's way from there."""

    base: Pose  # pose (x, y, yaw), metres and radians
    path: ReachPath  # the arm's way; its last pose is the grip
    # with what pitch the hand lays the candle down again, radians. None where it need not, because the candle stands
    # upright once the arm is tucked
    pitch_down: float | None = None


class RetrievalPlanner:
    """Finds stances in one house. It knows nothing of time: the candle lies still.

    Children will be elsewhere by the time that the base is there; but where one is now, the arm reaches last.
    """

    def __init__(self, navigator: Navigator, make_scene: Callable[[Heights | None], PlanningScene]):
        # Making the house's planning scene is costly, and seldom needed: it is made then only.
        self._navigator, self._make_scene = navigator, make_scene
        self._heights: Heights | None = None
        self._robot, self._arm = navigator.robot, arm_of(navigator.robot)
        self._things = layout.things(navigator.plan)

    @functools.cached_property
    def _scene(self) -> PlanningScene:
        return self._make_scene(self._heights)

    def prepare(self, heights: Heights | None) -> None:
        """Make the planning scene now, where there is time for it, unless there is one for tables of these heights."""
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
        """Search for the nearest stance from which the arm gets at a candle; return None if there is none.

        If there is one from which the candle can be gripped such that it stands upright in the tucked hand, it is of
        these. Else it is one from which it can be taken along level, or if it stands on its head, with its head down.
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
        """Search for the nearest stance from which the arm gets at a thing on the floor; None if there is none."""
        for base, reach in (yield from self._stands(view, NOTHING, view.things[thing])):
            for heading in _HEADINGS:
                path = pick_up_path(self._arm, reach, heading)
                is_clear = path is not None and self._is_clear(view, NOTHING, base, path)
                yield _WAY
                if path is not None and is_clear:
                    return Stance(base, path)
        return None

    def to_lay_down(self, view: View, candle: int, pitch: float) -> Work[Stance | None]:
        """Search for the nearest stance to lay a candle on open floor, away from children, the hand at a pitch, rad."""
        path = yield from self._path_down(pitch, self._things[candle])
        if path is None:
            return None
        # The candle is in the hand, and in nobody's way where it is now.
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
        # Where children leave none that is away from them it is laid down at another one, once they have gone on.
        for _, place in sorted(places, key=lambda each: view.child_distance(each[1]) < _CHILD_AWAY):
            if not navigator.clearance.can_stand(place):
                continue
            for yaw in _directions():
                # Free to both sides too, so that there is room to pick it up again.
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
        """The arm's way to lay a thing on the floor with a pitch of the hand, radians; None if there is none."""
        postures, height = self._robot.postures, thing.width + self._robot.grasp.above_lying
        for reach in (postures.floor_reach, *postures.lying_reaches):
            if path := (yield from self._path((reach, height), hand_rotation(0.0, pitch))):
                return path
        return None

    def _stands(self, view: View, candle: int, point: np.ndarray) -> Work[list[tuple[Pose, float]]]:
        """Poses of the base from which to reach for a point, the nearest one first, and how far to reach."""
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
        """The arm's way to lift a candle at a point (distance ahead, height), if neither touches anything."""
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
        """Whether the robot touches nothing along a path of the arm, or tucked; nor the candle that it lifts."""
        if path is None:
            return self._scene.is_free(base, [self._arm.tucked], view.candle_poses, candle)
        last = share_at(self._arm, path, LOW) if candle == NOTHING else path.goal  # or it ends in the floor
        way = [path.joints(s) for s in np.linspace(last, 0.0, _CHECKS)]  # where it is tightest comes first
        return self._scene.is_free(base, way, view.candle_poses, candle) and (
            not lifts or self._scene.is_free(base, way, view.candle_poses, candle, held=True)
        )

    def _path(self, target: Vector, grip: np.ndarray, lift: float = 0.0) -> Work[ReachPath | None]:
        """The arm's way to a point given by distance ahead and height, None if it is out of reach."""
        for path in retrieval_paths(self._arm, np.array([target[0], 0.0, target[1]]), grip, lift):
            yield _GUESS
            if path:
                return path
        return None


def _directions() -> list[float]:
    return [math.tau * i / _DIRECTIONS for i in range(_DIRECTIONS)]


def _turned(vector: np.ndarray, yaw: float) -> np.ndarray:
    """A vector (3,) turned about the vertical."""
    return np.array([*geometry.rotate(yaw, (vector[0], vector[1])), vector[2]])


class Search(Generic[Found]):
    """A search that takes long, spread over control timesteps.

    A search is a generator that yields, after each piece of work, roughly what that took, and returns what it has
    found. What it takes is not measured but stated: how far a search gets must not depend on how busy the machine is.

    Attributes:
        ended: Whether it has come to its end.
        found: What it has found, if it has.
    """

    found: Found

    def __init__(self, work: Work[Found]):
        self._work, self.ended = work, False

    def go_on(self, milliseconds: float = _AT_ONCE) -> bool:
        """Search for a while; return whether it has come to its end."""
        while not self.ended and milliseconds > 0.0:
            try:
                milliseconds -= next(self._work)
            except StopIteration as end:
                self.found, self.ended = end.value, True
        return self.ended
