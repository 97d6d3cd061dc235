"""Cameras on a house."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
import contextlib
import math
from collections.abc import Iterator

import mujoco
import numpy as np
from dm_control.mujoco import engine

_HIDDEN = 3  # the first group of geoms that MuJoCo does not draw
_NEAREST = 0.01  # metres before a camera
_MARGIN = 2  # pixels by which a box is wider than what it holds


class Camera:
    """A camera that leaves out of the scene what it does not see.

    OpenGL would do so too, but one triangle after the other.

    Attributes:
        width: Width of its pictures, pixels.
        height: Their height.
        view: dm_control's camera.
        geoms: Numbers of the geoms that are drawn, (geoms,).
        radius: Radius of the ball around each, metres, (geoms,).
    """

    def __init__(self, physics: engine.Physics, name: str, width: int, height: int, shadows: bool = False):
        self.width, self.height = width, height
        self.view = engine.Camera(physics, height=height, width=width, camera_id=name)
        self.view.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._model, self._data = physics.model.ptr, physics.data.ptr
        self._id = physics.model.name2id(name, "camera")
        self._scale = height / 2 / math.tan(math.radians(self._model.cam_fovy[self._id]) / 2)  # pixels a metre, 1 m off
        self.geoms = np.flatnonzero(self._model.geom_group < _HIDDEN)
        radius = self._model.geom_rbound[self.geoms]
        self.radius = np.where(radius > 0, radius, np.inf)  # a plane has none
        suns = self._model.light_castshadow.astype(bool) & shadows
        self._sunlight = self._data.light_xdir[suns]  # (suns, 3); nothing else in the house throws shadows

    def render(self) -> np.ndarray:
        """Draws the picture (height, width, 3)."""
        with self.only_seen_in(0, 0, self.width, self.height):
            return self.view.render()

    @contextlib.contextmanager
    def only_seen_in(self, left: int, top: int, right: int, bottom: int) -> Iterator[None]:
        """Within, scenes are made only of what lies, or throws a shadow, in a part of the picture."""
        boxes = self.boxes(self._data.geom_xpos[self.geoms], self.radius)
        seen = (boxes[:, :2] < (right, bottom)).all(axis=1) & (boxes[:, 2:] > (left, top)).all(axis=1)
        unseen, groups = self.geoms[~seen], self._model.geom_group
        before = groups[unseen]
        groups[unseen] = _HIDDEN
        try:
            yield
        finally:
            groups[unseen] = before

    def boxes(self, centres: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Where in the picture balls and their shadows on the floor are.

        Args:
            centres: Their centres, (n, 3), metres.
            radius: Their radii, (n,), metres.

        Returns:
            Bounds in pixels: left, top, right, bottom, (n, 4); infinite ones for what is beside the camera.
        """
        on_floor = [centres - centres[:, 2:] / light[2] * light for light in self._sunlight]
        axes = self._data.cam_xmat[self._id].reshape(3, 3) * (1, -1, -1)  # to the right, down, and ahead
        places = (np.stack([centres, *on_floor]) - self._data.cam_xpos[self._id]) @ axes  # (1 + suns, n, 3)
        across, depth, radius = places[..., :2], places[..., 2:], radius[:, None]
        beside = depth - radius < _NEAREST
        near, far = np.where(beside, 1.0, depth - radius), np.where(beside, 1.0, depth + radius)
        low = np.minimum((across - radius) / near, (across - radius) / far) * self._scale - _MARGIN
        high = np.maximum((across + radius) / near, (across + radius) / far) * self._scale + _MARGIN
        low, high = np.where(beside, -np.inf, low).min(axis=0), np.where(beside, np.inf, high).max(axis=0)
        centre = np.array([self.width, self.height]) / 2
        return np.concatenate([centre + low, centre + high], axis=1)
