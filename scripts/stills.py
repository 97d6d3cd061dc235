"""Takes the pictures in docs/: the robot picks a candle up, carries it past the toddler, and blocks a stairwell."""

from __future__ import annotations

import argparse
import pathlib

import imageio.v3 as imageio
import numpy as np

import caregiver_mj
from caregiver_mj.interventions.intervention import BLOCK, RELOCATE
from caregiver_mj.viz.portrait import take_portrait

_NEAR = 1.3  # metres from the toddler


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
        for name, where in _views(env.physics, policy).items():
            if name in wanted:
                options.out.mkdir(parents=True, exist_ok=True)
                imageio.imwrite(options.out / f"{name}.jpg", take_portrait(env.physics, *where), quality=92)
                print(options.out / f"{name}.jpg")
                wanted.discard(name)
    if wanted:
        print(f"not seen in this episode: {', '.join(sorted(wanted))}")


def _views(physics, policy: caregiver_mj.CaregiverPolicy) -> dict[str, tuple]:
    """What is to be seen now, and how: where to look, from how far, the robot's heading, and degrees aside and down."""
    x, y, yaw = physics.base_position()
    near = float(np.hypot(*(physics.base_position() - physics.toddler_position())[:2])) < _NEAR
    speed = float(np.hypot(*physics.base_velocity()[:2]))
    gripping, verb = physics.is_gripping(), policy.intervention.verb if policy.intervention else ""
    views: dict[str, tuple] = {}
    if verb == RELOCATE and gripping:
        if policy.activity.startswith("fetch"):
            candle = physics.candle_poses()[policy.plan.hazards.candle(policy.target)]
            views["picking"] = [*candle[:2], 0.6], 1.5, yaw, 115, -24
        elif policy.activity.startswith("carry") and near and speed > 0.5:
            views["carrying"] = [x, y, 0.45], 2.3, yaw, 140, -34
    if verb == BLOCK and near and speed < 0.01:
        views["blocking"] = [x, y, 0.4], 2.4, yaw, 120, -33
    return views


if __name__ == "__main__":
    main()
