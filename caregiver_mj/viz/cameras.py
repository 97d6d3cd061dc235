"""Cameras in a house: with culling, with partial redrawing, and with tiles on the floor."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from caregiver_mj.house.physics import EYE, Physics, raise_walls
from caregiver_mj.house.rendering import mujoco
from caregiver_mj.plans.layout import CEILING
from caregiver_mj.viz.moment import Tile

FOVY = 30.0  # degrees; field of view of a free camera, narrow so that walls hide little
HIDDEN = 3  # first group of geoms that MuJoCo does not draw
_NEAREST = 0.01  # m; least depth before a camera
_CORNERS = np.array(list(itertools.product((-1, 1), repeat=3)))
_MARGIN = 2  # pixels; margin of a bounding box
Part = tuple[int, int, int, int]  # of a picture, pixels: left, top, right, bottom
_MOVED = 1e-4  # m, or entries of a rotation matrix; least motion that is redrawn
_PART_OVERHEAD = 10_000  # pixels; cost of drawing one more part of a picture
_FIRST = 1 << 16  # number of the first tile in a mask, above those of all geoms
_ABOVE = 1.2  # m; height of labels


class Pose(NamedTuple):
    """The pose of a free camera, which is not one of the model's."""

    place: tuple[float, float, float]  # m; point in the middle of the picture
    distance: float  # m; distance from that point
    elevation: float  # rad; angle of the view below the horizon
    azimuth: float = math.pi / 2  # rad; angle from x to the direction of view, by default to the north

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors to the right, down and ahead, the columns of (3, 3)."""
        (sine, cosine), (y, x) = ((math.sin(a), math.cos(a)) for a in (self.elevation, self.azimuth))
        return np.array([(y, -sine * x, cosine * x), (-x, -sine * y, cosine * y), (0.0, -cosine, -sine)])

    @property
    def eye(self) -> np.ndarray:
        """Position of the camera, (3,), m."""
        return self.place - self.distance * self.axes[:, 2]


class Camera:
    """A camera that culls geoms out of view from its scene; OpenGL culls slowly, triangle by triangle.

    Its `pose` is that of a free camera, or None for a camera of the model; `geoms` are the numbers of visible geoms.
    """

    def __init__(self, physics: Physics, where: str | Pose, width: int, height: int, shadows: bool = False):
        """Set up one of the model's cameras by its name, or a free camera."""
        self.width, self.height, self.pose = width, height, where if isinstance(where, Pose) else None
        name = "" if isinstance(where, Pose) else where
        self.view = physics.camera(name, width, height)
        self.view.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows = shadows and name != EYE
        self._model, self._data = physics.model.ptr, physics.data.ptr
        self._id = physics.model.name2id(name, "camera") if name else -1
        fovy = self._model.cam_fovy[self._id] if name else FOVY
        self._scale = height / 2 / math.tan(math.radians(fovy) / 2)  # pixels per metre at a depth of 1 m
        self.geoms = np.flatnonzero(self._model.geom_group < HIDDEN)
        centres, halves = np.split(self._model.geom_aabb[self.geoms, None], 2, axis=2)
        if name == EYE:  # it sees walls of full height
            walls = self._model.geom_bodyid[self.geoms] == 0
            halves[walls, :, 2] += CEILING
        self._corners = centres + halves * _CORNERS  # (geoms, 8, 3); corners of each geom's box in its frame
        suns = self._model.light_castshadow.astype(bool) & shadows
        self._sunlight = self._data.light_xdir[suns]  # (suns, 3); the only lights with shadows

    def render(self) -> np.ndarray:
        """Return the picture, (height, width, 3)."""
        with self.only_seen_in((0, 0, self.width, self.height), self.boxes()):
            return self.view.render()

    @contextlib.contextmanager
    def only_seen_in(self, part: Part, boxes: np.ndarray) -> Iterator[None]:
        """Limit scenes in this context to geoms whose boxes, shadows included, overlap a part of the picture."""
        seen = (boxes[:, :2] < part[2:]).all(axis=1) & (boxes[:, 2:] > part[:2]).all(axis=1)
        unseen, groups, lens = self.geoms[~seen], self._model.geom_group, self._model.vis.global_
        before, fovy = groups[unseen], lens.fovy
        groups[unseen] = HIDDEN
        if self.pose:
            lens.fovy = FOVY
            angles = math.degrees(self.pose.azimuth), -math.degrees(self.pose.elevation)
            self.view.set_pose(self.pose.place, self.pose.distance, *angles)
        try:
            yield
        finally:
            groups[unseen], lens.fovy = before, fovy

    def boxes(self, which: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return bounding boxes of some of `geoms`, with their shadows, in the picture.

        They are left, top, right, bottom in pixels, (n, 4); infinite for a geom beside the camera.
        """
        geoms = self.geoms[which]
        turned = self._corners[which] @ self._data.geom_xmat[geoms].reshape(-1, 3, 3).swapaxes(1, 2)
        corners = self._data.geom_xpos[geoms, None] + turned  # (n, 8, 3)
        on_floor = [corners - corners[..., 2:] / light[2] * light for light in self._sunlight]
        pixels, depth = self._project(np.concatenate([corners, *on_floor], axis=1))
        boxes = np.concatenate([pixels.min(axis=1) - _MARGIN, pixels.max(axis=1) + _MARGIN], axis=1)
        boxes[(depth <= _NEAREST).any(axis=1)] = -np.inf, -np.inf, np.inf, np.inf
        return boxes

    def pixel(self, point: Sequence[float]) -> tuple[float, float] | None:
        """Return the pixel of a point (3,), m, from the left and top; None if it is outside the picture."""
        pixel, depth = self._project(np.array(point))
        x, y = pixel.tolist()
        return (x, y) if depth >= _NEAREST and 0 <= x < self.width and 0 <= y < self.height else None

    def _project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the pixels of points (..., 3), m, from the left and top, (..., 2), and their depths (...), m."""
        if self.pose:
            eye, axes = self.pose.eye, self.pose.axes
        else:
            eye, axes = self._data.cam_xpos[self._id], self._data.cam_xmat[self._id].reshape(3, 3) * (1, -1, -1)
        places = (points - eye) @ axes
        depth = places[..., 2]
        middle = self.width / 2, self.height / 2
        return places[..., :2] / np.maximum(depth, _NEAREST)[..., None] * self._scale + middle, depth


class StillCamera(Camera):
    """A fixed camera, which redraws only the parts of its picture in which something has moved.

    Without a graphics card the time goes into pixels, most of which do not change.
    """

    def __init__(self, physics: Physics, where: str | Pose, width: int, height: int, shadows: bool = True):
        super().__init__(physics, where, width, height, shadows)
        self._physics = physics
        self._picture: np.ndarray | None = None
        self._poses = self._read_poses()
        self._boxes = self.boxes()
        self._owner = self._model.body_rootid[self._model.geom_bodyid[self.geoms]]  # root body of each geom

    def render(self) -> np.ndarray:
        """Return the picture, (height, width, 3), which remains the camera's."""
        poses, before = self._read_poses(), self._boxes
        moved = (np.abs(poses - self._poses) > _MOVED).any(axis=1)
        self._poses[moved] = poses[moved]
        if self._picture is None:
            self._picture = np.empty((self.height, self.width, 3), np.uint8)
            self._boxes = self.boxes()
            self._redraw(0, 0, self.width, self.height)
        elif moved.any():
            self._boxes = before.copy()
            self._boxes[moved] = self.boxes(moved)
            for part in self._changed_parts(before, moved):
                self._redraw(*part)
        return self._picture

    def set_scene(self) -> None:
        """Update the scene."""
        self.view.update()
        if self._id >= 0 and self._model.camera(self._id).name == EYE:
            raise_walls(self._physics, self.view.scene)

    def _changed_parts(self, before: np.ndarray, moved: np.ndarray) -> list[Part]:
        """Return parts of the picture that cover everything that has moved, at its old and new place."""
        parts: list[Part] = []
        for body in np.unique(self._owner[moved]):
            geoms = moved & (self._owner == body)
            boxes = np.concatenate([before[geoms], self._boxes[geoms]])
            corners = np.floor(boxes[:, :2].min(axis=0)), np.ceil(boxes[:, 2:].max(axis=0))
            (left, top), (right, bottom) = np.clip(corners, 0, (self.width, self.height)).astype(int).tolist()
            part = left, top, right, bottom
            for other in list(parts):
                if _area(_union(part, other)) < _area(part) + _area(other) + _PART_OVERHEAD:
                    parts.remove(other)
                    part = _union(part, other)
            parts.append(part)
        return [part for part in parts if _area(part)]

    def _read_poses(self) -> np.ndarray:
        """Return position and rotation of each geom, (geoms, 12)."""
        return np.concatenate([self._data.geom_xpos[self.geoms], self._data.geom_xmat[self.geoms]], axis=1)

    def _redraw(self, left: int, top: int, right: int, bottom: int) -> None:
        """Redraw a part of the picture, through its part of the frustum."""
        with self.only_seen_in((left, top, right, bottom), self._boxes):
            self.set_scene()
        for eye in self.view.scene.camera:
            pixel = (eye.frustum_top - eye.frustum_bottom) / self.height
            eye.frustum_center += (left + right - self.width) / 2 * pixel
            eye.frustum_top, eye.frustum_bottom = (eye.frustum_top - edge * pixel for edge in (top, bottom))
        part = np.empty((bottom - top, right - left, 3), np.uint8)
        area = mujoco.MjrRect(0, 0, right - left, bottom - top)
        contexts = self._physics.contexts
        with contexts.gl.make_current() as gl:
            gl.call(mujoco.mjr_render, area, self.view.scene.ptr, contexts.mujoco.ptr)
            gl.call(mujoco.mjr_readPixels, part, None, area, contexts.mujoco.ptr)
        assert self._picture is not None  # `render` has made it
        self._picture[top:bottom, left:right] = part[::-1]


def _area(part: Part) -> int:
    return max(part[2] - part[0], 0) * max(part[3] - part[1], 0)


def _union(one: Part, other: Part) -> Part:
    return min(one[0], other[0]), min(one[1], other[1]), max(one[2], other[2]), max(one[3], other[3])


class TileLayer(StillCamera):
    """Blends translucent tiles into the pictures of a camera, hidden by things before them.

    MuJoCo's translucent geoms would shade things below them. So tiles are drawn separately, as a mask in which the
    colour of each geom is its number.
    """

    def __init__(self, physics: Physics, where: str | Pose, width: int, height: int, still: bool = True):
        """Set up the camera, see `Camera`; `still` says whether it is fixed."""
        super().__init__(physics, where, width, height, shadows=False)
        self._tiles: Sequence[Tile] = ()
        self._still = still
        flags, flag = self.view.scene.flags, mujoco.mjtRndFlag
        flags[flag.mjRND_SEGMENT] = flags[flag.mjRND_IDCOLOR] = True
        flags[flag.mjRND_SKYBOX] = flags[flag.mjRND_REFLECTION] = False

    def lay(self, picture: np.ndarray, tiles: Sequence[Tile]) -> None:
        """Blend tiles into a picture of the present moment, (height, width, 3)."""
        if list(tiles) != list(self._tiles) or not self._still:
            self._picture = None  # to redraw all of it
        self._tiles = tiles
        if not tiles:
            return
        mask = self.render()
        seen = mask[..., 2] >= _FIRST >> 16
        which = (mask[seen].astype(np.int32) << (0, 8, 16)).sum(axis=1) - 1 - _FIRST
        opacity = np.array([tile.opacity for tile in tiles])[which, None]
        colour = np.array([tile.colour for tile in tiles])[which]
        picture[seen] = (picture[seen] * (1.0 - opacity) + colour * opacity).round()

    def set_scene(self) -> None:
        """Update the scene, with the tiles."""
        super().set_scene()
        draw_tiles(self.view.scene.ptr, self._tiles, first=_FIRST)


def draw_tiles(scene: mujoco.MjvScene, tiles: Sequence[Tile], first: int | None = None) -> None:
    """Add tiles to a scene as far as it has room; in a mask they are opaque, with numbers from `first` on."""
    begin = scene.ngeom
    scene.ngeom += min(len(tiles), scene.maxgeom - begin)
    for number, (tile, geom) in enumerate(zip(tiles, scene.geoms[begin:], strict=False)):
        sides, middle = (tile.half, tile.half, tile.height / 2), (*tile.centre, tile.height / 2)
        rgba = np.array([*(part / 255 for part in tile.colour), tile.opacity]) if first is None else np.ones(4)
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_BOX, sides, middle, np.eye(3).ravel(), rgba)
        geom.objtype = mujoco.mjtObj.mjOBJ_UNKNOWN
        geom.segid = begin + number if first is None else first + number


def draw_label(scene: mujoco.MjvScene, text: str, place: np.ndarray) -> None:
    """Add a label above a place, x and y in m, to a scene with room for it."""
    scene.ngeom += 1
    geom, where = scene.geoms[scene.ngeom - 1], (*place[:2], _ABOVE)
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_LABEL, np.zeros(3), where, np.eye(3).ravel(), np.ones(4))
    geom.label = text
