"""MaskablePPO on the target-level grid of `train-100`: which hazard to see to, in any house.

    python examples/supervise_targets.py --seeds 0 1 2 --out runs/targets
    python examples/judge_targets.py --run runs/targets

Episodes are in five houses at once, others every time. All seeds are trained in turn, for so many steps at a time; then
policy and curve are written, and what is there is gone on with.
"""

from __future__ import annotations

import argparse
import pathlib
import time

import needs_learn  # noqa: F401 (says so if it is missing)

# isort: split
import numpy as np
import pandas as pd
import torch
from hazard_policy import HazardPolicy
from judge_targets import SLOTS
from sb3_contrib import MaskablePPO
from stable_baselines3.common.callbacks import BaseCallback
from targets_vector import Remembering

from caregiver_mj.children.child_group import ChildGroup, side_by_side
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.sb3 import BatchVecEnv
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import house_set

FAMILIES = (0.75, 0.5, 0.25)  # the children to learn with


class Curve(BaseCallback):
    """Keeps a row of the episodes that end together.

    Attributes:
        rows: After how many steps and core-seconds they ended, their mean damage, and that of children alone in the
            same houses.
    """

    def __init__(self, used: float, alone: np.ndarray):
        """Begins at a number of core-seconds, with the mean damage to children alone in each house."""
        super().__init__()
        self.rows: list[dict[str, float]] = []
        self._start, self._alone = time.process_time() - used, alone

    def _on_step(self) -> bool:
        ended = [info for info in self.locals["infos"] if "outcome" in info]
        if ended:
            used = time.process_time() - self._start
            damage = np.mean([info["outcome"]["damage"] for info in ended])
            alone = np.mean([self._alone[info["house"]] for info in ended])
            self.rows.append({"steps": self.num_timesteps, "core_seconds": used, "damage": damage, "alone": alone})
        return True


def train(seed: int, steps: int, folder: pathlib.Path, vector: GridHousesVector, alone: np.ndarray) -> None:
    """Trains one seed up to so many steps, from where it is; writes its policy and its curve."""
    policy, table = folder / f"seed-{seed}.zip", folder / f"seed-{seed}-curve.csv"
    env = BatchVecEnv(Remembering(vector))
    if policy.is_file():
        model, rows = MaskablePPO.load(policy, env, device="cpu"), pd.read_csv(table)
        env.seed(seed + model.num_timesteps)  # houses and episodes that have not been yet
    else:
        model, rows = new_model(seed, env), pd.DataFrame()
    if model.num_timesteps >= steps:
        return
    curve = Curve(rows.core_seconds.max() if len(rows) else 0.0, alone)
    model.learn(steps - model.num_timesteps, callback=curve, reset_num_timesteps=False)
    rows = pd.concat([rows, pd.DataFrame(curve.rows)], ignore_index=True)
    rows.to_csv(table, index=False)
    model.save(policy)
    left = rows.damage.tail(4).sum() / rows.alone.tail(4).sum()
    print(f"seed {seed}: {model.num_timesteps} steps, {left:.2f} of the damage left", flush=True)


def damage_alone(plan: FloorPlan, episodes: int = 10) -> float:
    """Mean damage to all of `FAMILIES` alone in a house."""
    children = side_by_side(plan, [ChildGroup.of(epsilon) for epsilon in FAMILIES], episodes)
    return float(run_episodes(plan, children, None, [*range(episodes)] * len(FAMILIES)).damage.mean())


def new_model(seed: int, env: BatchVecEnv, length: int = 100, batch: int = 2400) -> MaskablePPO:
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
    parser.add_argument("--steps", type=int, default=2_016_000, help="to train each seed for (default: %(default)s)")
    parser.add_argument(
        "--chunk", type=int, default=2, help="episodes, of all at once, at a time (default: %(default)s)"
    )
    parser.add_argument("--houses", default="train-100", metavar="SET", help="default: %(default)s")
    parser.add_argument("--episodes", type=int, default=240, help="at once (default: %(default)s)")
    parser.add_argument("--at-once", type=int, default=5, metavar="N", help="houses at once (default: %(default)s)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/targets"), metavar="DIR")
    options = parser.parse_args()
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    plans = house_set(options.houses)
    alone = np.array([damage_alone(plan) for plan in plans])
    vector = GridHousesVector(plans, options.episodes, options.at_once, FAMILIES, slots=SLOTS)
    chunk = options.chunk * EPISODE_TIMESTEPS * options.episodes
    for steps in [*range(chunk, options.steps, chunk), options.steps]:
        for seed in options.seeds:
            train(seed, steps, options.out, vector, alone)


if __name__ == "__main__":
    main()
