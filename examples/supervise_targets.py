"""MaskablePPO on the target-level grid of `train-100`: which hazard to see to, in any house.

    python examples/supervise_targets.py --seeds 0 1 2 --out runs/targets
    python examples/judge_targets.py --runs runs/targets

Episodes are in eight houses at once, others every time. The folder has, of each seed, the policy and its curve. After
every so many steps both are written, and what is there is gone on with. A seed takes some three core-minutes.
"""

from __future__ import annotations

import argparse
import pathlib
import time

import pandas as pd
import torch
from hazard_policy import HazardPolicy
from sb3_contrib import MaskablePPO
from sb3_vector import FromGymnasium
from stable_baselines3.common.callbacks import BaseCallback
from targets_vector import Remembering

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.plans.sets import house_set

FAMILIES = (0.75, 0.5, 0.25)  # the children to learn with
SLOTS = (4, 5)  # stairwells and candles that a policy has places for: as generated houses have at most


class Curve(BaseCallback):
    """Keeps a row of the episodes that end together: their mean damage."""

    def __init__(self, used: float):
        """Begins at a number of core-seconds."""
        super().__init__()
        self.rows: list[dict[str, float]] = []
        self._start = time.process_time() - used

    def _on_step(self) -> bool:
        damage = [info["damage"] for info in self.locals["infos"] if "damage" in info]
        if damage:
            used = time.process_time() - self._start
            self.rows.append({"steps": self.num_timesteps, "core_seconds": used, "damage": sum(damage) / len(damage)})
        return True


def train(seed: int, steps: int, folder: pathlib.Path, houses: str, episodes: int, at_once: int) -> None:
    """Trains one seed, or goes on with it; writes its policy and its curve."""
    policy, table = folder / f"seed-{seed}.zip", folder / f"seed-{seed}-curve.csv"
    vector = GridHousesVector(house_set(houses), episodes, at_once, FAMILIES, slots=SLOTS)
    env = FromGymnasium(Remembering(vector))
    if policy.is_file():
        model, rows = MaskablePPO.load(policy, env, device="cpu"), pd.read_csv(table)
        env.seed(seed + model.num_timesteps)  # houses and episodes that have not been yet
    else:
        model, rows = new_model(seed, env), pd.DataFrame()
    while model.num_timesteps < steps:
        curve = Curve(rows.core_seconds.max() if len(rows) else 0.0)
        model.learn(4 * EPISODE_TIMESTEPS * episodes, callback=curve, reset_num_timesteps=False)
        rows = pd.concat([rows, pd.DataFrame(curve.rows)], ignore_index=True)
        rows.to_csv(table, index=False)
        model.save(policy)
        print(f"seed {seed}: {model.num_timesteps} steps, damage {rows.damage.tail(4).mean():.2f}", flush=True)


def new_model(seed: int, env: FromGymnasium, length: int = 100, batch: int = 2400) -> MaskablePPO:
    """A policy that has learnt nothing yet; it learns from so many timesteps of every episode at a time."""
    return MaskablePPO(
        HazardPolicy,
        env,
        seed=seed,
        n_steps=length,
        batch_size=batch,
        n_epochs=4,
        learning_rate=7e-4,
        gamma=0.97,
        gae_lambda=0.9,
        ent_coef=0.002,
        device="cpu",
    )


def main() -> None:
    """Trains."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--steps", type=int, default=1_500_000, help="to train each seed for (default: %(default)s)")
    parser.add_argument("--houses", default="train-100", metavar="SET", help="default: %(default)s")
    parser.add_argument("--episodes", type=int, default=240, help="at once (default: %(default)s)")
    parser.add_argument("--at-once", type=int, default=8, metavar="N", help="houses at once (default: %(default)s)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/targets"), metavar="DIR")
    options = parser.parse_args()
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    for seed in options.seeds:
        train(seed, options.steps, options.out, options.houses, options.episodes, options.at_once)


if __name__ == "__main__":
    main()
