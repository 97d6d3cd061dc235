"""A camera that does not move, and draws no more of the house than has changed."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
import mujoco
import numpy as np
from dm_control.mujoco import engine

from caregiver_mj.viz.cameras import Camera

Part = tuple[int, int, int, int]  # of a picture, in pixels: left, top, right, bottom

_MOVED = 1e-4  # metres, or entries of a rotation, by which something must have moved to be drawn anew
_PART_OVERHEAD = 10_000  # pixels that could be drawn in the time that one more part of a picture takes


class StillCamera(Camera):
    """A camera that does not move: after the first picture it draws only the parts in which something else has.

    Without a graphics card the time goes into pixels, and most of them show the same house as before.
    """

    def __init__(self, physics: engine.Physics, name: str, width: int, height: int, shadows: bool = True):
        super().__init__(physics, name, width, height, shadows)
        self._physics = physics
        self._picture: np.ndarray | None = None
        self._poses = self._read_poses()
        self._owner = self._model.body_rootid[self._model.geom_bodyid[self.geoms]]  # the body that each moves with

    def render(self) -> np.ndarray:
        """Draws the picture (height, width, 3), which stays the camera's."""
        poses = self._read_poses()
        moved = (np.abs(poses - self._poses) > _MOVED).any(axis=1)
        if self._picture is None:
            self._picture = np.empty((self.height, self.width, 3), np.uint8)
            self._redraw(0, 0, self.width, self.height)
        else:
            for part in self._changed_parts(poses, moved):
                self._redraw(*part)
        self._poses[moved] = poses[moved]
        return self._picture

    def forget(self) -> None:
        """Has the whole picture drawn anew the next time."""
        self._picture = None

    def set_scene(self) -> None:
        """Makes the scene that is drawn."""
        self.view.update()

    def _changed_parts(self, poses: np.ndarray, moved: np.ndarray) -> list[Part]:
        """Parts of the picture that hold all that has moved, before and after."""
        parts: list[Part] = []
        for body in np.unique(self._owner[moved]):
            geoms = moved & (self._owner == body)
            centres = np.concatenate([poses[geoms, :3], self._poses[geoms, :3]])
            part = self._part_around(self.boxes(centres, np.tile(self.radius[geoms], 2)))
            for other in list(parts):
                if _area(_union(part, other)) < _area(part) + _area(other) + _PART_OVERHEAD:
                    parts.remove(other)
                    part = _union(part, other)
            parts.append(part)
        return [part for part in parts if _area(part)]

    def _part_around(self, boxes: np.ndarray) -> Part:
        """The part of the picture that holds some boxes (n, 4)."""
        size = self.width, self.height
        left, top = np.clip(np.floor(boxes[:, :2].min(axis=0)), 0, size).astype(int).tolist()
        right, bottom = np.clip(np.ceil(boxes[:, 2:].max(axis=0)), 0, size).astype(int).tolist()
        return left, top, right, bottom

    def _read_poses(self) -> np.ndarray:
        """Position and rotation of everything that is drawn, (geoms, 12)."""
        return np.concatenate([self._data.geom_xpos[self.geoms], self._data.geom_xmat[self.geoms]], axis=1)

    def _redraw(self, left: int, top: int, right: int, bottom: int) -> None:
        """Draws a part of the picture anew, through the part of the frustum that belongs to it."""
        with self.only_seen_in(left, top, right, bottom):
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
