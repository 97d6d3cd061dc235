"""Portraits: pictures of the robot at work from close by, in a soft light."""

from __future__ import annotations

import caregiver_mj.house.rendering  # noqa: F401 (comes before dm_control)

# isort: split
from collections.abc import Callable, Sequence

import numpy as np
from dm_control.mujoco import engine

DEFAULT_SIZE = 1280, 720  # pixels
_SUNS, _SUN_RADIUS = 24, np.deg2rad(1.5)  # pictures of which one is made, and how wide the sun looks, from its middle


def take_portrait(
    physics: engine.Physics,
    look_at: Sequence[float],
    distance: float,
    yaw: float,
    side: float,
    down: float,
    size: tuple[int, int] = DEFAULT_SIZE,
) -> np.ndarray:
    """Takes a picture from one side of the robot or the other, whichever is farther inside the house.

    Args:
        physics: The house.
        look_at: The point in the picture's middle, (3,), metres.
        distance: Metres from there to the camera.
        yaw: Heading of the robot, radians.
        side: Degrees between that and the camera's line of sight.
        down: The line of sight's elevation, degrees.
        size: Width and height in pixels.

    Returns:
        The picture (height, width, 3).
    """
    azimuth = min((np.rad2deg(yaw) + sign * side for sign in (1, -1)), key=lambda a: _from_middle(look_at, distance, a))
    width, height = size
    camera = engine.MovableCamera(physics, height, width)
    camera.set_pose(look_at, distance, azimuth, down)
    return _in_soft_light(physics, camera.render)


def _in_soft_light(physics: engine.Physics, draw: Callable[[], np.ndarray]) -> np.ndarray:
    """A picture with soft shadows, which MuJoCo does not draw: the mean of many, for a sun as wide as a hazy one."""
    direction = physics.data.ptr.light_xdir[physics.model.ptr.light("sun").id]  # a view, which drawing looks at
    middle = direction.copy()
    pictures = []
    for i in range(_SUNS):
        # Evenly over a disc, by the golden angle.
        angle, radius = i * np.pi * (3 - np.sqrt(5)), _SUN_RADIUS * np.sqrt((i + 0.5) / _SUNS)
        direction[:2] = middle[:2] + radius * np.array([np.cos(angle), np.sin(angle)])
        pictures.append(draw().astype(float))  # drawing writes into the same array again
    direction[:] = middle
    return np.mean(pictures, axis=0).round().astype(np.uint8)


def _from_middle(look_at: Sequence[float], distance: float, azimuth: float) -> float:
    """How far from the house's middle a camera stands, in metres on the ground."""
    angle = np.deg2rad(azimuth)
    return float(np.hypot(look_at[0] - distance * np.cos(angle), look_at[1] - distance * np.sin(angle)))
