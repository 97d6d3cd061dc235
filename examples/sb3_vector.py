"""Learn with Stable-Baselines3 in the batched grid: MaskablePPO, or PPO without masks, in the house `paper`.

    python examples/sb3_vector.py                      # 32,000 steps
    python examples/sb3_vector.py --steps 250000
    python examples/sb3_vector.py --no-masks

It prints the damage of an episode before and after: alone, with bare tables only, and of the policy in the same 64
episodes, with its score.
"""

from __future__ import annotations

import argparse
import time

import needs_learn  # noqa: F401 (says so if it is missing)

# isort: split
import gymnasium
import numpy as np
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3 import PPO

import caregiver_mj
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.envs.sb3 import BatchVecEnv
from caregiver_mj.experiments.score import expected_damage
from caregiver_mj.plans.floor_plan import FloorPlan

NAME = "caregiver_mj/Supervise-Targets-v0"
JUDGED, FIRST_SEED = 64, 1_000_000  # episodes, none of them trained in


def judge(model: PPO | MaskablePPO, masked: bool, observation: str) -> tuple[float, float]:
    """Return the mean damage and the mean score of a policy in episodes that are always the same."""
    envs = BatchVecEnv(gymnasium.make_vec(NAME, JUDGED, observation=observation))
    envs.seed(FIRST_SEED)
    seen, ended = envs.reset(), np.zeros(JUDGED, bool)
    while not ended.all():
        masks = {"action_masks": np.stack(envs.env_method("action_masks"))} if masked else {}
        actions, _ = model.predict(seen, deterministic=True, **masks)
        seen, _, ended, infos = envs.step(actions)
    damage = np.mean([info["outcome"]["damage"] for info in infos])
    return float(damage), float(np.mean([info["episode_score"] for info in infos]))


def main() -> None:
    """Train, and judge before and after."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=32_000, help="default: %(default)s")
    parser.add_argument("--num-envs", type=int, default=32, help="episodes at once (default: %(default)s)")
    parser.add_argument("--observation", default="flat", choices=("flat", "numbers", "map", "graph"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--no-masks", action="store_true", help="PPO instead of MaskablePPO")
    options = parser.parse_args()
    torch.set_num_threads(1)
    gymnasium.register_envs(caregiver_mj)
    masked, kind = not options.no_masks, PPO if options.no_masks else MaskablePPO
    policy = "MlpPolicy" if options.observation == "flat" else "MultiInputPolicy"
    envs = BatchVecEnv(gymnasium.make_vec(NAME, options.num_envs, observation=options.observation))
    model = kind(policy, envs, n_steps=100, batch_size=400, seed=options.seed, device="cpu")
    none, bare_tables = (curve[-1] for curve in expected_damage(FloorPlan.load("paper"), ChildGroup.of(0.5)))
    print(f"alone: damage {none:.1f}, score 0.00; bare tables only: damage {bare_tables:.1f}, score 1.00")
    print("before: damage {:.1f}, score {:.2f}".format(*judge(model, masked, options.observation)))
    start = time.perf_counter()
    model.learn(options.steps)
    rate = model.num_timesteps / (time.perf_counter() - start)
    found = judge(model, masked, options.observation)
    print("after {:,} steps: damage {:.1f}, score {:.2f}; {:.0f} steps/s".format(model.num_timesteps, *found, rate))


if __name__ == "__main__":
    main()
