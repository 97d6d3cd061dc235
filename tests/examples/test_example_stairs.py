"""What makes BlockStairs easier to learn."""

import gymnasium
import numpy as np
import pytest
from decisions import Drive, Repeat


@pytest.fixture(scope="module")
def env():
    house = "caregiver_mj:caregiver_mj/BlockStairs-v0"
    env = gymnasium.make(house, task_kwargs={"time_limit": 1.0})
    yield env
    env.close()


def test_it_drives_and_keeps_its_arm_still(env):
    drive = Drive(env)
    first, _ = drive.reset(seed=1)
    assert drive.action_space.shape == (3,)
    for _ in range(40):
        observation, *_ = drive.step(np.array([0.4, 0.0, 0.0]))
    moved = observation["base_position"] - first["base_position"]
    assert np.hypot(*moved[:2]) > 0.1
    np.testing.assert_allclose(observation["arm_position"], first["arm_position"], atol=0.05)


def test_a_decision_is_so_many_steps(env):
    whole, decided = [], []
    for times, found in ((1, whole), (20, decided)):
        repeat = Repeat(Drive(env), times)
        repeat.reset(seed=2)
        truncated = False
        while not truncated:
            _, reward, terminated, truncated, info = repeat.step(np.array([0.2, 0.1, 0.0]))
            found.append((reward, info["cost"]))
            assert not terminated
    assert (len(whole), len(decided)) == (50, 3)  # the last decision is cut short by the end
    rewards, costs = np.array(whole).T
    assert decided[0] == pytest.approx((rewards[:20].mean(), costs[:20].sum()))
    assert decided[2] == pytest.approx((rewards[40:].mean(), costs[40:].sum()))


def test_it_trains_goes_on_and_is_judged(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    import block_stairs
    import torch

    torch.set_num_threads(1)
    monkeypatch.setattr(block_stairs, "CHUNK", 128)
    monkeypatch.setattr(block_stairs, "ENVS", 2)
    short = {"time_limit": 4.0}
    block_stairs.train(0, 128, tmp_path, "paper", short)
    block_stairs.train(0, 256, tmp_path, "paper", short)
    rows = block_stairs.judge(0, 2, tmp_path, "paper", short)
    assert rows.who.unique().tolist() == ["PPO, seed 0"]
    assert rows.reward.between(0, 1).all()
