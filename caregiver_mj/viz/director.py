"""Where the cameras of a film are: one that the house fills, one close to those whom the film is about."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from caregiver_mj.house.fittings import nearest_eye
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.layout import WALL_HEIGHT
from caregiver_mj.viz.cameras import FOVY, Pose
from caregiver_mj.viz.forecast import place_of
from caregiver_mj.viz.moment import HudState

_TANGENT = math.tan(math.radians(FOVY) / 2)
_STEEP, _CLOSE_STEEP = math.radians(60.0), math.radians(52.0)  # below the horizon: lines of sight pass over low walls
_MARGIN = 1.03  # size of a picture relative to that of the house
_COLUMNS = 0.32, 0.29, 0.26, 0.23, 0.20  # shares of the width that may be left beside the house
_WORTH = 1.08  # times as far off for a wider column
_TALL = 1.4  # metres, of what stands along the northern walls
_AROUND = 0.75  # metres of room round those in a close shot
_NEAREST, _FARTHEST = 3.4, 9.0  # metres off, of a close shot
_LOOK_HEIGHT = 0.35  # metres: the middle of a close shot
_PARTNER, _HAZARD = 4.0, 2.5  # metres from the child within which the robot, or a hazard, is in the close shot
_CUT, _EASE = 2.5, 0.5  # metres that are cut and not panned; seconds after which two thirds of a pan are done
# Metres between the fingers and a thing, or the middle of a landing behind a gate, within which the hand works on it.
_AT_HAND, _AT_GATE = 0.55, 0.9
_STANDS = 0.08  # m/s, at most


class Frame(NamedTuple):
    """The overview of a house that is as large as it can be, and what that leaves free beside it."""

    pose: Pose
    column: int  # pixels to the right of the house


def overview(plan: FloorPlan, width: int, height: int) -> Frame:
    """Return where a camera sees the whole house, with a column beside it, in a picture of a size in pixels."""
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, WALL_HEIGHT])).reshape(3, -1).T
    corners = np.append(corners, [(-half_x, half_y, _TALL), (half_x, half_y, _TALL)], axis=0)
    found = [(_fit(corners, width / height, share), share) for share in _COLUMNS]
    nearest = min(pose.distance for pose, _ in found)
    pose, share = next((pose, share) for pose, share in found if pose.distance <= _WORTH * nearest)
    return Frame(pose, round(share * width))


def _fit(corners: np.ndarray, aspect: float, column: float) -> Pose:
    """Return the nearest pose that has all corners (n, 3) in a picture, left of a column with a share of its width."""
    axes, high = Pose((0.0, 0.0, 0.0), 0.0, _STEEP).axes, _TANGENT / _MARGIN
    eye = nearest_eye(corners, axes, (high * aspect, high * aspect * (1 - 2 * column)), high)
    far = -eye[2] / axes[2, 2]  # to the floor
    x, y, z = (eye + far * axes[:, 2]).tolist()
    return Pose((x, y, z), far, _STEEP)


class CloseShot:
    """Follows those whom the film is about: a child, the robot near it, and the hazard between them."""

    def __init__(self, aspect: float, fps: float):
        self._aspect, self._share = aspect, 1.0 - math.exp(-1.0 / (fps * _EASE))
        self._now: np.ndarray | None = None  # x, y and distance, metres

    def follow(self, state: HudState) -> Pose:
        """Return where the camera is in the next frame."""
        wanted = close_pose(cast(state), self._aspect)
        aim = np.array([*wanted.place[:2], wanted.distance])
        if self._now is None or math.dist(self._now[:2], aim[:2]) > _CUT:
            self._now = aim
        self._now = self._now + self._share * (aim - self._now)
        x, y, distance = self._now.tolist()
        return Pose((x, y, _LOOK_HEIGHT), distance, _CLOSE_STEEP)


def close_pose(points: np.ndarray, aspect: float, azimuth: float = math.pi / 2, around: float = _AROUND) -> Pose:
    """Return where a camera is close to all points on the floor, and looks along an azimuth.

    Args:
        points: Metres, (n, 2).
        aspect: Width of the picture over its height.
        azimuth: Radians.
        around: Metres of room round the points.
    """
    ahead = np.array([math.cos(azimuth), math.sin(azimuth)])
    axes = np.array([(ahead[1], -ahead[0]), ahead])  # to the right, and ahead
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    half = (high - low) / 2 + around
    needed = max(half[0] / aspect, half[1] * math.sin(_CLOSE_STEEP)) / _TANGENT
    x, y = ((low + high) / 2 @ axes).tolist()
    return Pose((x, y, _LOOK_HEIGHT), float(min(max(needed, _NEAREST), _FARTHEST)), _CLOSE_STEEP, azimuth)


def cast(state: HudState) -> np.ndarray:
    """Return where those are whom a moment is about, (n, 2), metres, the child first."""
    plan, robot = state.plan, state.robot
    target = None if state.target == NOTHING else place_of(plan, state.target, state.candles)[:2]
    near = target if target is not None else robot
    places = [child.position for child in state.children]
    child = places[0] if near is None else min(places, key=lambda place: math.dist(place, near[:2]))
    found = [child]
    if robot is not None and math.dist(robot[:2], child) < _PARTNER:
        found.append(robot[:2])
    hazards = [
        place_of(plan, number, state.candles)[:2] for number in range(len(plan.hazards)) if number not in state.gone
    ]
    if target is None and hazards:
        target = min(hazards, key=lambda place: math.dist(place, child))
    if target is not None and math.dist(target, child) < _HAZARD:
        found.append(target)
    return np.array(found)


def hand_works(state: HudState, pinch: np.ndarray, base: np.ndarray) -> bool:
    """Whether the hand is at what the caregiver deals with, and the base stands still.

    The fingertips are at (3,), metres; the base has a velocity (3,), m/s and rad/s.
    """
    if state.target == NOTHING or math.hypot(*base[:2]) > _STANDS:
        return False
    kind = state.plan.hazards[state.target].kind
    reach = _AT_HAND if kind.where is not Where.OPENING else _AT_GATE if kind.fenced else 0.0
    return math.dist(place_of(state.plan, state.target, state.candles)[:2], pinch[:2]) < reach
