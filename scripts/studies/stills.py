"""Takes the pictures in docs/: the robot picks up a candle and a mug, carries one past the toddler, blocks, closes.

Another one is of the grid: one of what each environment looks like.
"""

from __future__ import annotations

import argparse
import math
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import imageio.v3 as imageio
import numpy as np

import caregiver_mj
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.rendering import engine
from caregiver_mj.interventions.verb import BLOCK, CLOSE, RELOCATE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import CANDLE, MUG, Where
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from study import Parser

_NEAR = 1.3  # metres from the toddler
_DRIVES, _RESTS = 0.5, 0.01  # m/s above which the base is on its way, and below which it stands
_SHUTS = 0.5, 0.9  # radians between which a gate is seen to swing
_QUALITY = 92  # of JPEG, of 100
DEFAULT_SIZE = 1280, 720  # pixels
_EPISODES = 4  # in which a picture is looked for
_GRID_TIMESTEPS = 12  # after which the grid is shown
_SUNS, _SUN_RADIUS = 24, np.deg2rad(1.5)  # pictures of which one is made, and how wide the sun looks, from its middle


def views(physics: Physics, policy: CaregiverPolicy) -> dict[str, tuple[Any, ...]]:
    """Pictures that can be taken now, by name: where to look, from how far, the robot's heading, degrees aside, down.

    These are the arguments of `take_portrait`.
    """
    x, y, yaw = physics.base_position()
    near = math.dist((x, y), physics.toddler_position()[:2]) < _NEAR
    speed = math.hypot(*physics.base_velocity()[:2])
    verb = policy.intervention.verb if policy.intervention else ""
    found: dict[str, tuple[Any, ...]] = {}
    if verb == RELOCATE and physics.is_gripping():
        if policy.activity.startswith("fetch"):
            candle = policy.plan.hazards.among(Where.ON_TABLE, policy.target)
            name = "picking" if physics.carried[candle] is CANDLE else f"picking_{physics.carried[candle]}"
            found[name] = [*physics.candle_poses()[candle, :2], 0.6], 1.5, yaw, 115, -24
        elif policy.activity.startswith("carry") and near and speed > _DRIVES:
            middle = (np.array([x, y]) + physics.toddler_position()[:2]) / 2
            found["carrying"] = [*middle, 0.45], 2.3, yaw, 140, -34
    if verb == BLOCK and near and speed < _RESTS:
        found["blocking"] = [x, y, 0.4], 2.4, yaw, 120, -33
    if verb == CLOSE and _SHUTS[0] < physics.gate_positions().min() < _SHUTS[1]:
        landing = policy.plan.position(policy.plan.stairwells[policy.target])
        found["closing"] = [*(0.5 * (landing + np.array([x, y]))), 0.4], 2.2, yaw, 100, -62
    return found


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("out", pathlib.Path("docs"), "folder", type=pathlib.Path)
    parser.add("seed", 0)


def run(options: argparse.Namespace) -> None:
    """Run episodes in three houses until they have shown all there is, and the beginning of one in the grid."""
    options.out.mkdir(parents=True, exist_ok=True)
    imageio.imwrite(options.out / "grid.png", show_grid(options.seed))
    print(options.out / "grid.png")
    look_on(options, "paper", "expected-danger", {"picking", "carrying", "blocking"})
    look_on(options, "home", "childproof", {"closing"})
    with_drinks = FloorPlan.load("home").text.replace(CANDLE.symbol, MUG.symbol)
    look_on(options, FloorPlan.parse(with_drinks), "expected-danger", {f"picking_{MUG}"})


def look_on(options: argparse.Namespace, house: str | FloorPlan, caregiver: str, wanted: set[str]) -> None:
    """Run episodes, a few at most, until all pictures that are wanted of them have been taken."""
    env = load("supervise", house=house, epsilon=1.0, random=options.seed)
    policy = CaregiverPolicy(env, caregiver)
    timestep, left = env.reset(), _EPISODES
    while wanted and left:
        timestep = env.step(policy(timestep))
        left -= timestep.last()
        for name, view in views(env.physics, policy).items():
            if name in wanted:
                path = options.out / f"{name}.jpg"
                imageio.imwrite(path, take_portrait(env.physics, *view), quality=_QUALITY)
                print(path)
                wanted.discard(name)
    if wanted:
        print(f"not seen in {_EPISODES} episodes: {', '.join(sorted(wanted))}")


def show_grid(seed: int) -> np.ndarray:
    """The grid as its environment of targets draws it, (height, width, 3), while the last candle is protected."""
    gymnasium.register_envs(caregiver_mj)
    env = gymnasium.make("caregiver_mj/Supervise-Targets-v0", house="paper", epsilon=1.0, render_mode="rgb_array")
    _, info = env.reset(seed=seed)
    for _ in range(_GRID_TIMESTEPS):
        *_, info = env.step(np.flatnonzero(info["action_mask"])[-1])
    return np.asarray(env.render())


# -- Portraits: pictures from close by, in a soft light ----------------------------------------------


def take_portrait(
    physics: engine.Physics,
    look_at: Sequence[float],
    distance: float,
    yaw: float,
    side: float,
    down: float,
    size: tuple[int, int] = DEFAULT_SIZE,
) -> np.ndarray:
    """Take a picture from one side of the robot or the other, whichever is farther inside the house.

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
