"""The cameras of the house."""

from __future__ import annotations

import mujoco
import numpy as np

from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan

# The overview camera looks north and down, and shows the whole house in pictures of 4:3 and anything wider.
_OVERVIEW_ELEVATION = np.radians(60.0)
_OVERVIEW_FOVY = 30.0  # degrees; a long lens, so that near walls do not hide the rooms behind them
_OVERVIEW_ASPECT = 4 / 3
_OVERVIEW_MARGIN = 1.04  # size of the picture relative to that of the house

_FOLLOW_OFFSET = (0.0, -1.75, 2.3)  # metres from the first child; the line of sight passes over walls
_FOLLOW_FOVY = 50.0  # degrees

_NEAREST = 0.02  # metres; nothing nearer to a camera is drawn, and the gripper's camera is very near
_FARTHEST = 8000.0  # metres; MuJoCo guards against speckled shadows by a tiny fraction of this, so it must not be small


def add_cameras(spec: mujoco.MjSpec, plan: FloorPlan) -> None:
    """Adds the cameras, and sets what the whole picture depends on: extent, clipping and where the sun stands."""
    half_y, half_x = np.array(plan.shape) * plan.cell_size / 2
    extent = max(half_x, half_y)
    spec.stat.center = [0, 0, layout.WALL_HEIGHT / 2]
    spec.stat.extent = extent
    spec.visual.map.znear = _NEAREST / extent
    spec.visual.map.zfar = _FARTHEST / extent

    radius = np.hypot(half_x, half_y) + layout.WALL_HEIGHT
    spec.visual.map.shadowclip = radius / extent
    sun = spec.light("sun")
    sun.pos = -2 * radius * sun.dir / np.linalg.norm(sun.dir)

    corners = np.array(np.meshgrid([-half_x, half_x], [-half_y, half_y], [0, layout.WALL_HEIGHT])).reshape(3, -1).T
    forward = np.array([0, np.cos(_OVERVIEW_ELEVATION), -np.sin(_OVERVIEW_ELEVATION)])
    _add_camera(spec.worldbody, "overview", _overview_position(corners, forward), forward, _OVERVIEW_FOVY)

    offset = np.array(_FOLLOW_OFFSET)
    follow = _add_camera(spec.body("toddler/toddler"), "follow", offset, -offset, _FOLLOW_FOVY)
    follow.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM


def _add_camera(
    body: mujoco.MjsBody, name: str, position: np.ndarray, forward: np.ndarray, fovy: float
) -> mujoco.MjsCamera:
    """Adds a camera that looks along a direction in the plane of y and z, with x to the right."""
    pitch = np.arctan2(forward[1], -forward[2])  # from straight down
    return body.add_camera(name=name, pos=position, quat=[np.cos(pitch / 2), np.sin(pitch / 2), 0, 0], fovy=fovy)


def _overview_position(corners: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """The nearest position from which a camera sees all corners.

    A corner at height v and depth f in camera coordinates is in the picture if |v - s| <= t (f + d), where t is the
    tangent of half the vertical field of view, d the camera's distance behind and s its shift above the origin.
    Both bounds are linear in d and s, so the narrowest fit of top and bottom has a closed form; the width adds
    |u| <= t_x (f + d).

    Args:
        corners: Points that must be seen, (n, 3).
        forward: Direction of view, (3,), in the plane of y and z.

    Returns:
        Position (3,).
    """
    right = np.array([1.0, 0, 0])
    up = np.cross(right, forward)
    u, v, f = corners @ right, corners @ up, corners @ forward
    tangent = np.tan(np.radians(_OVERVIEW_FOVY) / 2) / _OVERVIEW_MARGIN
    top, bottom = (v / tangent - f).max(), (-v / tangent - f).max()
    width = (np.abs(u) / (tangent * _OVERVIEW_ASPECT) - f).max()
    distance = max((top + bottom) / 2, width)
    return up * tangent * (top - bottom) / 2 - forward * distance
