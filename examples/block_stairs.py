"""PPO on `caregiver_mj/BlockStairs-v0`: the robot learns to drive into the stairwell that is asked for.

    python examples/block_stairs.py --seeds 0 1 2 --out runs/block_stairs

Every seed is trained in turn and then judged on episodes that none was trained on. The folder has, of each seed, the
policy, its curve and its episodes, and those of the scripted robot. After every so many decisions all of it is written,
and what is there is gone on with. A seed takes some four core-minutes.
"""

from __future__ import annotations

import argparse
import pathlib
import time

import needs_learn  # noqa: F401 (says so if it is missing)

# isort: split
import caregiver_mj

# isort: split
import gymnasium
import numpy as np
import pandas as pd
import torch
from decisions import Drive, Repeat
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecMonitor, VecNormalize

SEEN = ["base_position", "base_velocity", "base_to_goal", "goal_stairwell", "toddler_position", "toddler_velocity"]
NAME = "caregiver_mj:caregiver_mj/BlockStairs-v0"
REPEAT = 20  # control steps a decision, 0.4 s
ENVS = 8
CHUNK = 8 * 64 * 10  # decisions between files
JUDGED_FROM = 1_000_000  # seed of the first episode to be judged on


def make_env(house: str = "paper", task_kwargs: dict | None = None) -> gymnasium.Env:
    """A task of 150 decisions an episode, observed as one array."""
    env = Drive(gymnasium.make(NAME, house=house, task_kwargs=task_kwargs))
    seen = gymnasium.wrappers.FilterObservation(Repeat(env, REPEAT), SEEN)
    return gymnasium.wrappers.FlattenObservation(seen)


class Curve(BaseCallback):
    """Keeps a row for every episode that ends in training.

    Attributes:
        rows: After how many decisions and core-seconds it ended, and its mean reward a control step, 0 to 1.
    """

    def __init__(self, used: float):
        """Begins at a number of core-seconds."""
        super().__init__()
        self.rows: list[dict[str, float]] = []
        self._start = time.process_time() - used

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                mean, used = info["episode"]["r"] / info["episode"]["l"], time.process_time() - self._start
                self.rows.append({"decisions": self.num_timesteps, "core_seconds": used, "reward": mean})
        return True


def train(seed: int, decisions: int, folder: pathlib.Path, house: str, task_kwargs: dict | None = None) -> None:
    """Trains one seed, or goes on with it; writes its policy, what its observations are scaled by, and its curve."""
    policy, scale, table = (folder / f"seed-{seed}{end}" for end in (".zip", "-scale.pkl", "-curve.csv"))
    envs: VecEnv = VecMonitor(DummyVecEnv([lambda: make_env(house, task_kwargs)] * ENVS))
    if policy.is_file():
        model, rows = PPO.load(policy, VecNormalize.load(scale, envs), device="cpu"), pd.read_csv(table)
    else:
        model, rows = new_model(seed, VecNormalize(envs, norm_reward=False)), pd.DataFrame()
    model.get_env().seed(seed + model.num_timesteps)  # episodes that have not been yet
    while model.num_timesteps < decisions:
        curve = Curve(rows.core_seconds.max() if len(rows) else 0.0)
        model.learn(CHUNK, callback=curve, reset_num_timesteps=False)
        rows = pd.concat([rows, pd.DataFrame(curve.rows)], ignore_index=True)
        rows.to_csv(table, index=False)
        model.get_vec_normalize_env().save(scale)
        model.save(policy)
        print(f"seed {seed}: {model.num_timesteps} decisions, {rows.reward.tail(16).mean():.2f}", flush=True)
    envs.close()


def new_model(seed: int, envs: VecEnv) -> PPO:
    """A policy that has learnt nothing yet."""
    return PPO(
        "MlpPolicy",
        envs,
        seed=seed,
        n_steps=64,
        batch_size=128,
        n_epochs=8,
        learning_rate=7e-4,
        gamma=0.97,
        policy_kwargs={"log_std_init": -0.5},
        device="cpu",
    )


def judge(seed: int, episodes: int, folder: pathlib.Path, house: str, task_kwargs: dict | None = None) -> pd.DataFrame:
    """The episodes of a trained seed, without noise: the mean reward a control step, 0 to 1, and the cost."""
    env = make_env(house, task_kwargs)
    scale = VecNormalize.load(folder / f"seed-{seed}-scale.pkl", DummyVecEnv([lambda: env]))
    model = PPO.load(folder / f"seed-{seed}", device="cpu")
    rows = []
    for episode in range(episodes):
        observation, _ = env.reset(seed=JUDGED_FROM + episode)
        rewards, costs, ended = [], 0.0, False
        while not ended:
            action, _ = model.predict(scale.normalize_obs(observation), deterministic=True)
            observation, reward, terminated, truncated, info = env.step(action)
            rewards.append(reward)
            costs += info["cost"]
            ended = terminated or truncated
        rows.append({"episode": episode, "reward": np.mean(rewards), "cost": costs})
    env.close()
    return pd.DataFrame(rows).assign(who=f"PPO, seed {seed}")


def scripted(episodes: int, house: str, robot: bool = True) -> pd.DataFrame:
    """The same episodes of the scripted robot, or of one that stands still."""
    env = gymnasium.make(NAME, house=house).unwrapped
    policy, rows = caregiver_mj.CaregiverPolicy(env.dm_env), []
    for episode in range(episodes):
        env.dm_env.task.reseed(JUDGED_FROM + episode)
        timestep, rewards = env.dm_env.reset(), []
        still = env.action_space.low * 0
        still[env.dm_env.task.embodiment.layout.arm] = timestep.observation["arm_position"]
        while not timestep.last():
            timestep = env.dm_env.step(policy(timestep) if robot else still)
            rewards.append(timestep.reward)
        task = env.dm_env.task
        rows.append({"episode": episode, "reward": np.mean(rewards), "cost": task.damage + task.strikes})
    env.close()
    return pd.DataFrame(rows).assign(who="scripted" if robot else "stands still")


def main() -> None:
    """Trains and judges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--decisions", type=int, default=40_000, help="to train each seed for (default: %(default)s)")
    parser.add_argument("--episodes", type=int, default=10, help="to judge each by (default: %(default)s)")
    parser.add_argument("--house", default="paper", help="default: %(default)s")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/block_stairs"), metavar="DIR")
    options = parser.parse_args()
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    for seed in options.seeds:
        train(seed, options.decisions, options.out, options.house)
        judged = judge(seed, options.episodes, options.out, options.house)
        judged.to_csv(options.out / f"seed-{seed}-judged.csv", index=False)
        print(f"seed {seed}: mean reward {judged.reward.mean():.2f}", flush=True)
    for robot, name in ((True, "scripted"), (False, "still")):
        if not (options.out / f"{name}-judged.csv").is_file():
            scripted(options.episodes, options.house, robot).to_csv(options.out / f"{name}-judged.csv", index=False)


if __name__ == "__main__":
    main()
