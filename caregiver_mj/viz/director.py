"""The cameras of a film: an overview that the house fills, a close shot of the actors, and a shot of the hand."""

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
_STEEP = math.radians(60.0)  # rad below the horizon; lines of sight pass over low walls
_ALONG_STEEP = math.radians(70.0)  # rad; the same in a long house, whose children walk close behind walls
_CLOSE_STEEP, _STEEPEST = 52, 85  # degrees; the same of a close shot: usual, and greatest to see over screens
_MARGIN = 1.03  # size of a picture relative to that of the house
_COLUMNS = 0.52, 0.47, 0.42, 0.37, 0.32, 0.29, 0.26, 0.23, 0.20  # candidate shares of the width beside the house
_ROWS = 0.60, 0.55, 0.50, 0.45, 0.40  # candidate shares of the height below a long house
_WORTH = 1.08  # factor by which the house may be smaller for a wider column, or a higher row
_TALL = 1.4  # m; height of things along the northern walls
_AROUND, _TOP = 0.45, 1.2  # m; half width, and height, the robot's, of the space of each actor in a close shot
_NEAREST, _FARTHEST = 3.4, 9.0  # m; distances of the camera in a close shot
_LOOK_HEIGHT = 0.35  # m; height of the middle of a close shot
# m; height from which on a child must be visible, three quarters of it; half of a child's width; height of the visible
# point above a hazard.
_LOW, _HALF, _RAISED = 0.20, 0.12, 0.05
# m; distance from the child within which the robot and its hazard, or another hazard, are in the close shot.
_PARTNER, _HAZARD = 4.0, 2.5
# m; distance beyond which the camera cuts and does not pan. s; time constants of a pan, and of a rise, which must be
# faster because screens hide somebody until its end.
_CUT, _EASE, _RISE = 2.5, 0.5, 0.2
_AT_HAND = 0.55  # m; distance of the fingers from a thing below which the hand works on it
_STANDS = 0.08  # m/s; speed up to which the base stands
# Camera in a shot of the hand: m from the thing; rad below the horizon, and from the arm's direction.
_FROM_HAND, _DOWN_ON_HAND, _ASIDE = 1.2, math.radians(35.0), math.radians(75.0)
_LINGERS = 1.0  # s; time for which the shot stays after the work, which is short, while the hand is in sight


class Overview(NamedTuple):
    """A view of a house, nearly as large as possible, with room beside or below it for insets."""

    pose: Pose  # of the camera, for the picture without the row
    column: int  # pixels; width of the room to the right of the house, as high as the picture
    row: int  # pixels; height of the room below it; either column or row is 0


def overview(plan: FloorPlan, width: int, height: int) -> Overview:
    """Return the overview of a house in a picture of a size in pixels; below a long house there is a row."""
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, WALL_HEIGHT])).reshape(3, -1).T
    corners = np.append(corners, [(-half_x, half_y, _TALL), (half_x, half_y, _TALL)], axis=0)
    beside = [Overview(_fit(corners, width / height, share), round(share * width), 0) for share in _COLUMNS]
    rows = [round(share * height) for share in _ROWS]
    below = [Overview(_fit(corners, width / (height - row), 0.0, _ALONG_STEEP), 0, row) for row in rows]

    def size(view: Overview) -> float:
        """Return the size of the house, up to a common factor."""
        return (height - view.row) / view.pose.distance

    views = max(beside, below, key=lambda views: max(map(size, views)))
    largest = max(map(size, views))
    return next(view for view in views if size(view) * _WORTH >= largest)


def _fit(corners: np.ndarray, aspect: float, column: float, steep: float = _STEEP) -> Pose:
    """Return the nearest pose with all corners (n, 3) in the picture, left of a column with a share of its width."""
    axes, high = Pose((0.0, 0.0, 0.0), 0.0, steep).axes, _TANGENT / _MARGIN
    eye = nearest_eye(corners, axes, (high * aspect, high * aspect * (1 - 2 * column)), high)
    far = -eye[2] / axes[2, 2]  # m; distance of the floor
    x, y, z = (eye + far * axes[:, 2]).tolist()
    return Pose((x, y, z), far, steep)


class CloseShot:
    """A close shot that follows the actors: a child, the robot near it, and the hazard between them.

    The camera looks down as steeply as necessary to see them over `screens`, see that function, and keeps them left of
    a column with a share of the picture's width.
    """

    def __init__(self, aspect: float, fps: float, screens: np.ndarray, column: float = 0.0):
        self._aspect, self._screens = aspect, screens
        self._pan, self._rise = _share_in_frame(fps, _EASE), _share_in_frame(fps, _RISE)
        self._column = column
        self._now: np.ndarray | None = None  # x, y and distance, m, and elevation, rad

    def follow(self, state: HudState) -> Pose:
        """Return the camera's pose in the next frame."""
        wanted = clear_pose(cast(state), self._aspect, self._screens, self._column)
        aim = np.array([*wanted.place[:2], wanted.distance, wanted.elevation])
        if self._now is None or math.dist(self._now[:2], aim[:2]) > _CUT:
            self._now = aim
        share = self._rise if aim[3] > self._now[3] else self._pan
        self._now = self._now + np.array([self._pan, self._pan, self._pan, share]) * (aim - self._now)
        x, y, distance, elevation = self._now.tolist()
        return Pose((x, y, _LOOK_HEIGHT), distance, elevation)


def _share_in_frame(fps: float, seconds: float) -> float:
    """Return the share of the way to its aim that a camera moves in a frame, with a time constant in s."""
    return 1.0 - math.exp(-1.0 / (fps * seconds))


def screens(physics: Physics) -> np.ndarray:
    """Return boxes around all opaque things that stand still in a house: two opposite corners, (n, 2, 3), m."""
    model, data = physics.model.ptr, physics.data.ptr
    still = np.flatnonzero((model.geom_bodyid == 0) & (model.geom_group < HIDDEN) & (model.geom_rgba[:, 3] == 1))
    centre, half = np.split(model.geom_aabb[still], 2, axis=1)
    turned = data.geom_xmat[still].reshape(-1, 3, 3)
    centre = data.geom_xpos[still] + (turned @ centre[..., None])[..., 0]
    half = (np.abs(turned) @ half[..., None])[..., 0]
    return np.stack([centre - half, centre + half], axis=1)


def clear_pose(points: np.ndarray, aspect: float, screens: np.ndarray, column: float = 0.0) -> Pose:
    """Return the least steep close pose from which no screen (n, 2, 3) hides a point, or the fewest are hidden.

    The points are those of `cast`, (n, 3), m; the child's count most.
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
    """Return whether boxes (n, 2, 3) hide points (k, 3) from an eye (3,), bool (k,); a box around a point does not."""
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
    """Return the pose of a camera close to points on the floor (n, 2), m, that looks along an azimuth.

    Each point has a space of `around` m to every side, left of a column with a share of the width. The elevation is
    below the horizon; angles are in rad.
    """
    axes = Pose((0.0, 0.0, 0.0), 0.0, elevation, azimuth).axes
    box = np.array(np.meshgrid([-around, around], [-around, around], [0.0, _TOP])).reshape(3, -1).T
    corners = (np.pad(points, ((0, 0), (0, 1)))[:, None] + box).reshape(-1, 3)
    eye = nearest_eye(corners, axes, (_TANGENT * aspect, _TANGENT * aspect * (1 - 2 * column)), _TANGENT)
    distance = (_LOOK_HEIGHT - eye[2]) / axes[2, 2]
    x, y, z = (eye + distance * axes[:, 2]).tolist()
    return Pose((x, y, z), float(min(max(distance, _NEAREST), _FARTHEST)), elevation, azimuth)


class HandShot:
    """A shot of the hand at work, from the side that `screens` do not hide, or of two such sides the sunnier one."""

    def __init__(self, aspect: float, fps: float, screens: np.ndarray):
        self._distance = _FROM_HAND / min(1.0, aspect)
        self._pan, self._screens, self._lingers = _share_in_frame(fps, _EASE), screens, round(fps * _LINGERS)
        self._left = 0  # frames until the shot ends
        self._now = np.empty(0)  # x, y, z, m, and azimuth, rad

    def follow(self, state: HudState, physics: Physics) -> Pose | None:
        """Return the camera's pose in the next frame; None unless the hand works, or just did, see `hand_works`.

        There must be a robot.
        """
        pinch = physics.pinch_position()
        if not hand_works(state, pinch, physics.base_velocity()):
            left = self._left > 0 and math.dist(pinch[:2], self._now[:2]) > _AT_HAND
            self._left = 0 if left else self._left - 1
            return self._pose(self._now) if self._left > 0 else None
        thing = place_of(state.plan, state.target, state.candles)
        aim = np.array([*thing[:2], pinch[2]])
        if self._left <= 0:
            assert state.robot is not None
            along = math.atan2(thing[1] - state.robot[1], thing[0] - state.robot[0])
            starts = [np.array([*aim, along + side]) for side in (_ASIDE, -_ASIDE)]
            starts.sort(key=lambda start: math.sin(start[3]), reverse=True)  # the sun shines from the south
            seen = (start for start in starts if not hidden(aim[None], self._pose(start).eye, self._screens)[0])
            self._now = next(seen, starts[0])
        self._left = self._lingers
        self._now[:3] += self._pan * (aim - self._now[:3])
        return self._pose(self._now)

    def _pose(self, now: np.ndarray) -> Pose:
        x, y, z, azimuth = now.tolist()
        return Pose((x, y, z), self._distance, _DOWN_ON_HAND, azimuth)


def cast(state: HudState) -> np.ndarray:
    """Return the points to keep visible, (n, 3), m: two sides of a child, then the robot and a hazard if near it."""
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
    """Return whether the hand works on the hazard under intervention, in its place, with the base at rest.

    The fingertips are at `pinch`, (3,), m; the base has a velocity (3,), m/s and rad/s. A gate does not count, because
    only its bars would be visible. Neither does a candle in the hand of a robot that waits away from tables.
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
