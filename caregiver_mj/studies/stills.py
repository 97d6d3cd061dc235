"""Takes the pictures in docs/: the robot picks a candle up, carries it past the toddler, and blocks a stairwell."""

from __future__ import annotations

import argparse
import math
import pathlib
from typing import Any

import imageio.v3 as imageio

from caregiver_mj.house.physics import Physics
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from caregiver_mj.viz.portrait import take_portrait

_NEAR = 1.3  # metres from the toddler
_DRIVES, _RESTS = 0.5, 0.01  # m/s above which the base is on its way, and below which it stands
_QUALITY = 92  # of JPEG, of 100


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
            candle = physics.candle_poses()[policy.plan.hazards.candle(policy.target)]
            found["picking"] = [*candle[:2], 0.6], 1.5, yaw, 115, -24
        elif policy.activity.startswith("carry") and near and speed > _DRIVES:
            found["carrying"] = [x, y, 0.45], 2.3, yaw, 140, -34
    if verb == BLOCK and near and speed < _RESTS:
        found["blocking"] = [x, y, 0.4], 2.4, yaw, 120, -33
    return found


def main(arguments: list[str] | None = None) -> None:
    """Runs an episode until it has shown all three."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs"), help="folder (default: docs)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    env = load("supervise", house="paper", epsilon=1.0, random=options.seed)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    wanted = {"picking", "carrying", "blocking"}
    while wanted and not timestep.last():
        timestep = env.step(policy(timestep))
        for name, view in views(env.physics, policy).items():
            if name in wanted:
                path = options.out / f"{name}.jpg"
                imageio.imwrite(path, take_portrait(env.physics, *view), quality=_QUALITY)
                print(path)
                wanted.discard(name)
    if wanted:
        print(f"not seen in this episode: {', '.join(sorted(wanted))}")
