"""Takes the pictures in docs/: the robot picks a candle up, carries it past the toddler, and blocks a stairwell."""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Callable

import imageio.v3 as imageio
import numpy as np

import caregiver_mj
from caregiver_mj.house.rendering import OffscreenRendering  # noqa: F401 (comes before dm_control)

# isort: split
from dm_control.mujoco import engine

_SIZE = (1280, 720)
_SUNS, _SUN_RADIUS = 24, np.deg2rad(1.5)  # pictures of which one is made, and how wide the sun looks, from its middle


def main() -> None:
    """Runs an episode until it has shown all three."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs"), help="folder (default: docs)")
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    env = caregiver_mj.load("supervise", house="paper", epsilon=1.0, random=options.seed)
    policy = caregiver_mj.CaregiverPolicy(env)
    timestep = env.reset()
    wanted = {"picking", "carrying", "blocking"}
    while wanted and not timestep.last():
        timestep = env.step(policy(timestep))
        base = env.physics.base_position()
        near = float(np.hypot(*(base - env.physics.toddler_position())[:2]))
        gripping = env.physics.is_gripping()
        moving = float(np.hypot(*env.physics.base_velocity()[:2]))
        if "picking" in wanted and policy.activity.startswith("fetch") and gripping:
            candle = env.physics.candle_poses()[policy.target - len(env.task.plan.stairwells)]
            _shoot(env, options.out / "picking.jpg", [*candle[:2], 0.6], 1.5, base[2], 115, -24)
            wanted.discard("picking")
        if "carrying" in wanted and policy.activity.startswith("carry") and gripping and moving > 0.5 and near < 1.3:
            _shoot(env, options.out / "carrying.jpg", [*base[:2], 0.45], 2.3, base[2], 140, -34)
            wanted.discard("carrying")
        if "blocking" in wanted and policy.activity.startswith("block") and moving < 0.01 and near < 1.3:
            _shoot(env, options.out / "blocking.jpg", [*base[:2], 0.4], 2.4, base[2], 120, -33)
            wanted.discard("blocking")
    if wanted:
        print(f"not seen in this episode: {', '.join(sorted(wanted))}")


def _shoot(
    env, path: pathlib.Path, look_at: list[float], distance: float, yaw: float, side: float, down: float
) -> None:
    """Takes a picture from one side of the robot or the other, whichever is farther inside of the house.

    Args:
        env: The environment.
        path: Where the picture goes.
        look_at: The point in its middle, metres.
        distance: Metres from there to the camera.
        yaw: Heading of the robot, radians.
        side: Degrees between that and the camera's line of sight.
        down: The line of sight's elevation, degrees.
    """
    azimuth = min((np.rad2deg(yaw) + sign * side for sign in (1, -1)), key=lambda a: _from_middle(look_at, distance, a))
    width, height = _SIZE
    camera = engine.MovableCamera(env.physics, height, width)
    camera.set_pose(look_at, distance, azimuth, down)
    path.parent.mkdir(parents=True, exist_ok=True)
    imageio.imwrite(path, _in_soft_light(env.physics, camera.render), quality=92)
    print(path)


def _in_soft_light(physics, draw: Callable[[], np.ndarray]) -> np.ndarray:
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


def _from_middle(look_at: list[float], distance: float, azimuth: float) -> float:
    """How far from the house's middle a camera stands, in metres on the ground."""
    angle = np.deg2rad(azimuth)
    return float(np.hypot(look_at[0] - distance * np.cos(angle), look_at[1] - distance * np.sin(angle)))


if __name__ == "__main__":
    main()
