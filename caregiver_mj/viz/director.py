"""Where the cameras of a film are: one that the house fills, one close to those whom it is about, one at the hand."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from caregiver_mj.house.fittings import nearest_eye
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.plans.layout import WALL_HEIGHT
from caregiver_mj.viz.cameras import FOVY, HIDDEN, Pose
from caregiver_mj.viz.moment import HudState, place_of

_TANGENT = math.tan(math.radians(FOVY) / 2)
_STEEP = math.radians(60.0)  # below the horizon: lines of sight pass over low walls
_ALONG_STEEP = math.radians(70.0)  # of a long house, where children walk right behind walls
_CLOSE_STEEP, _STEEPEST = 52, 85  # degrees, of a close shot: as a rule, and at most, where somebody would be hidden
_MARGIN = 1.03  # size of a picture relative to that of the house
_COLUMNS = 0.52, 0.47, 0.42, 0.37, 0.32, 0.29, 0.26, 0.23, 0.20  # shares of the width that may be left beside the house
_ROWS = 0.60, 0.55, 0.50, 0.45, 0.40  # shares of the height that may be left below a long one
_WORTH = 1.08  # times as small a house for a wider column, or a higher row
_TALL = 1.4  # metres, of what stands along the northern walls
_AROUND, _TOP = 0.45, 1.2  # metres: half of the space of each of those in a close shot, and its height, the robot's
_NEAREST, _FARTHEST = 3.4, 9.0  # metres off, of a close shot
_LOOK_HEIGHT = 0.35  # metres: the middle of a close shot
# Metres above the floor of what no wall may hide: three quarters of a child, and half of its width; and above where a
# hazard stands.
_LOW, _HALF, _RAISED = 0.20, 0.12, 0.05
# Metres from the child within which the robot and its hazard, or another hazard, are in the close shot.
_PARTNER, _HAZARD = 4.0, 2.5
# Metres that are cut and not panned; seconds after which two thirds of a pan are done, and of a rise, before which
# somebody would be hidden.
_CUT, _EASE, _RISE = 2.5, 0.5, 0.2
_AT_HAND = 0.55  # metres between the fingers and a thing within which the hand works on it
_STANDS = 0.08  # m/s, at most
# Metres from a thing, and radians below the horizon and from the arm, of a shot of the hand.
_FROM_HAND, _DOWN_ON_HAND, _ASIDE = 1.2, math.radians(35.0), math.radians(75.0)
_LINGERS = 1.0  # seconds that it stays when the work is done, as robots are fast, with the hand in sight


class Overview(NamedTuple):
    """Where a house is as large as it can be in a picture, with room beside or below it, pixels."""

    pose: Pose  # for the picture without the row
    column: int  # on its right, as high as the picture
    row: int  # below it; one of both is 0


def overview(plan: FloorPlan, width: int, height: int) -> Overview:
    """Return the overview of a house in a picture of a size in pixels; a long house has the room below it."""
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, WALL_HEIGHT])).reshape(3, -1).T
    corners = np.append(corners, [(-half_x, half_y, _TALL), (half_x, half_y, _TALL)], axis=0)
    beside = [Overview(_fit(corners, width / height, share), round(share * width), 0) for share in _COLUMNS]
    rows = [round(share * height) for share in _ROWS]
    below = [Overview(_fit(corners, width / (height - row), 0.0, _ALONG_STEEP), 0, row) for row in rows]

    def size(view: Overview) -> float:
        """Return the size of the house, but for a factor."""
        return (height - view.row) / view.pose.distance

    views = max(beside, below, key=lambda views: max(map(size, views)))
    largest = max(map(size, views))
    return next(view for view in views if size(view) * _WORTH >= largest)


def _fit(corners: np.ndarray, aspect: float, column: float, steep: float = _STEEP) -> Pose:
    """Return the nearest pose that has all corners (n, 3) in a picture, left of a column with a share of its width."""
    axes, high = Pose((0.0, 0.0, 0.0), 0.0, steep).axes, _TANGENT / _MARGIN
    eye = nearest_eye(corners, axes, (high * aspect, high * aspect * (1 - 2 * column)), high)
    far = -eye[2] / axes[2, 2]  # to the floor
    x, y, z = (eye + far * axes[:, 2]).tolist()
    return Pose((x, y, z), far, steep)


class CloseShot:
    """Follows those whom the film is about: a child, the robot near it, and the hazard between them.

    It looks down as steeply as it must for nothing of `screens`, boxes as of that function, to hide them, and keeps
    them left of a column with a share of the picture's width.
    """

    def __init__(self, aspect: float, fps: float, screens: np.ndarray, column: float = 0.0):
        self._aspect, self._screens = aspect, screens
        self._pan, self._rise = _share_in_frame(fps, _EASE), _share_in_frame(fps, _RISE)
        self._column = column
        self._now: np.ndarray | None = None  # x, y and distance, metres, and elevation, radians

    def follow(self, state: HudState) -> Pose:
        """Return where the camera is in the next frame."""
        wanted = clear_pose(cast(state), self._aspect, self._screens, self._column)
        aim = np.array([*wanted.place[:2], wanted.distance, wanted.elevation])
        if self._now is None or math.dist(self._now[:2], aim[:2]) > _CUT:
            self._now = aim
        share = self._rise if aim[3] > self._now[3] else self._pan
        self._now = self._now + np.array([self._pan, self._pan, self._pan, share]) * (aim - self._now)
        x, y, distance, elevation = self._now.tolist()
        return Pose((x, y, _LOOK_HEIGHT), distance, elevation)


def _share_in_frame(fps: float, seconds: float) -> float:
    """Return the share of the way to its aim that a camera moves in a frame, with a time constant."""
    return 1.0 - math.exp(-1.0 / (fps * seconds))


def screens(physics: Physics) -> np.ndarray:
    """Return boxes (n, 2, 3) around all that stands still in a house and can hide somebody: corners in metres."""
    model, data = physics.model.ptr, physics.data.ptr
    still = np.flatnonzero((model.geom_bodyid == 0) & (model.geom_group < HIDDEN) & (model.geom_rgba[:, 3] == 1))
    centre, half = np.split(model.geom_aabb[still], 2, axis=1)
    turned = data.geom_xmat[still].reshape(-1, 3, 3)
    centre = data.geom_xpos[still] + (turned @ centre[..., None])[..., 0]
    half = (np.abs(turned) @ half[..., None])[..., 0]
    return np.stack([centre - half, centre + half], axis=1)


def clear_pose(points: np.ndarray, aspect: float, screens: np.ndarray, column: float = 0.0) -> Pose:
    """Return the least steep close pose from which no screen (n, 2, 3) hides a point; else one that hides fewest.

    The points are in metres, (n, 3), those of `cast`.
    """
    worth = np.ones(len(points))
    worth[:2] = len(points)
    near = (screens[:, 1] > points.min(axis=0) - (0, _FARTHEST, 0)).all(axis=1)
    screens = screens[near & (screens[:, 0, :2] < points[:, :2].max(axis=0)).all(axis=1)]
    best, most = None, -1.0
    for elevation in range(_CLOSE_STEEP, _STEEPEST + 1):
        pose = close_pose(points[:, :2], aspect, elevation=math.radians(elevation), column=column)
        shown = worth @ ~hidden(points, pose.eye, screens)
        if shown > most:
            best, most = pose, shown
        if shown == worth.sum():
            break
    assert best is not None
    return best


def hidden(points: np.ndarray, eye: np.ndarray, screens: np.ndarray) -> np.ndarray:
    """Return whether boxes (n, 2, 3) are between points (k, 3) and an eye (3,), bool (k,); one around it hides none."""
    ray = eye - points
    with np.errstate(divide="ignore", invalid="ignore"):  # along a face: an infinite share of the way, or no number
        ends = (screens - points[:, None, None]) / ray[:, None, None]  # (k, n, 2, 3)
    enters, leaves = np.fmin(*np.moveaxis(ends, 2, 0)).max(axis=2), np.fmax(*np.moveaxis(ends, 2, 0)).min(axis=2)
    return ((enters > 0.0) & (enters < leaves) & (enters < 1.0)).any(axis=1)


def close_pose(
    points: np.ndarray,
    aspect: float,
    azimuth: float = math.pi / 2,
    around: float = _AROUND,
    elevation: float = math.radians(_CLOSE_STEEP),
    column: float = 0.0,
) -> Pose:
    """Return where a camera is close to all those at some points on the floor (n, 2), and looks along an azimuth.

    Each has a space of `around` metres to every side, left of a column with a share of the width. The elevation is
    below the horizon; angles are in radians.
    """
    axes = Pose((0.0, 0.0, 0.0), 0.0, elevation, azimuth).axes
    box = np.array(np.meshgrid([-around, around], [-around, around], [0.0, _TOP])).reshape(3, -1).T
    corners = (np.pad(points, ((0, 0), (0, 1)))[:, None] + box).reshape(-1, 3)
    eye = nearest_eye(corners, axes, (_TANGENT * aspect, _TANGENT * aspect * (1 - 2 * column)), _TANGENT)
    distance = (_LOOK_HEIGHT - eye[2]) / axes[2, 2]
    x, y, z = (eye + distance * axes[:, 2]).tolist()
    return Pose((x, y, z), float(min(max(distance, _NEAREST), _FARTHEST)), elevation, azimuth)


class HandShot:
    """Shows from one side what the hand does, from where nothing of `screens` hides it, and as sunny as it can be."""

    def __init__(self, aspect: float, fps: float, screens: np.ndarray):
        self._distance = _FROM_HAND / min(1.0, aspect)
        self._pan, self._screens, self._lingers = _share_in_frame(fps, _EASE), screens, round(fps * _LINGERS)
        self._left = 0  # frames
        self._now = np.empty(0)  # x, y, z, metres, and azimuth, radians

    def follow(self, state: HudState, physics: Physics) -> Pose | None:
        """Return where the camera is in the next frame, or None if the hand does not work, see `hand_works`."""
        pinch = np.empty(0) if state.robot is None else physics.pinch_position()
        if state.robot is None or not hand_works(state, pinch, physics.base_velocity()):
            gone = state.robot is None or (len(self._now) and math.dist(pinch[:2], self._now[:2]) > _AT_HAND)
            self._left = 0 if gone else self._left - 1
            return self._pose(self._now[:3], self._now[3]) if self._left > 0 else None
        if self._left <= 0:
            self._now = np.empty(0)
        self._left = self._lingers
        thing = np.resize(place_of(state.plan, state.target, state.candles), 3)
        aim = np.array([*thing[:2], pinch[2]])
        if not len(self._now):
            along = math.atan2(thing[1] - state.robot[1], thing[0] - state.robot[0])
            poses = [self._pose(aim, along + side) for side in (_ASIDE, -_ASIDE)]
            poses.sort(key=lambda pose: math.sin(pose.azimuth), reverse=True)  # the sun shines from the south
            seen = [pose for pose in poses if not hidden(aim[None], pose.eye, self._screens)[0]]
            self._now = np.array([*aim, (seen or poses)[0].azimuth])
        self._now[:3] += self._pan * (aim - self._now[:3])
        return self._pose(self._now[:3], self._now[3])

    def _pose(self, place: np.ndarray, azimuth: float) -> Pose:
        x, y, z = place.tolist()
        return Pose((x, y, z), self._distance, _DOWN_ON_HAND, float(azimuth))


def cast(state: HudState) -> np.ndarray:
    """Return what is to be seen of those whom a moment is about, (n, 3), metres: first the two sides of a child."""
    plan, robot = state.plan, state.robot
    target = None if state.target == NOTHING else place_of(plan, state.target, state.candles)
    near = target if target is not None else robot
    places = [child.position for child in state.children]
    child = places[0] if near is None else min(places, key=lambda place: math.dist(place, near[:2]))
    found = [(child[0] + side, child[1], _LOW) for side in (-_HALF, _HALF)]
    if robot is not None and math.dist(robot[:2], child) < _PARTNER:
        found.append((*robot[:2], _LOW))
    hazards = [place_of(plan, number, state.candles) for number in range(len(plan.hazards)) if number not in state.gone]
    if target is None and hazards:
        target = min(hazards, key=lambda place: math.dist(place[:2], child))
    if target is not None and math.dist(target[:2], child) < (_HAZARD if state.target == NOTHING else _PARTNER):
        x, y, z = (*target, 0.0)[:3]  # on the floor where it has no height
        found.append((x, y, z + _RAISED))
    return np.array(found)


def hand_works(state: HudState, pinch: np.ndarray, base: np.ndarray) -> bool:
    """Whether the hand is at a thing that the caregiver deals with, where that stands, and the base stands still.

    The fingertips are at (3,), metres; the base has a velocity (3,), m/s and rad/s. Of a gate a hand sees only bars.
    A thing in the hand of a robot that waits on its way tells nothing.
    """
    if state.target == NOTHING or math.hypot(*base[:2]) > _STANDS:
        return False
    where = state.plan.hazards[state.target].kind.where
    if where is Where.OPENING:
        return False
    thing = place_of(state.plan, state.target, state.candles)[:2]
    tables = [math.dist(thing, state.plan.position(table)) for table in state.plan.tables]
    if where is Where.ON_TABLE and min(tables) > state.plan.cell_size / 2:
        return False
    return math.dist(thing, pinch[:2]) < _AT_HAND
