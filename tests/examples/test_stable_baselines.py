"""Stable-Baselines3 takes the environments by their names; it needs the extra `learn`."""

import gymnasium
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

import caregiver_mj

torch.set_num_threads(1)
gymnasium.register_envs(caregiver_mj)
NAME = "caregiver_mj/Supervise-Targets-v0"


def test_environments_of_a_name_have_pictures():
    envs = make_vec_env(NAME, 2, seed=0)
    envs.reset()
    assert envs.render_mode == "rgb_array"
    assert [picture.shape for picture in envs.get_images()] == [(480, 640, 3)] * 2


@pytest.mark.parametrize(
    ("policy", "options"),
    [
        ("MultiInputPolicy", {}),
        ("MlpPolicy", {"observation": "flat"}),
        *(("MultiInputPolicy", {"observation": drawn}) for drawn in ("map", "graph")),
    ],
)
def test_a_model_learns(policy, options):
    envs = make_vec_env(NAME, 2, seed=0, env_kwargs=options)
    before = PPO(policy, envs, n_steps=16, batch_size=16, n_epochs=1, device="cpu").learn(32)
    assert before.num_timesteps == 32


def test_a_model_makes_its_environment_of_a_name():
    model = PPO("MultiInputPolicy", NAME, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    assert model.learn(16).get_env().render_mode == "rgb_array"
