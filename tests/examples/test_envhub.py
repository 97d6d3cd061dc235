"""The environments of LeRobot's EnvHub: what its `make_env` calls, and what its evaluation asks of a vector."""

import importlib.util
import json
import pathlib
import types

import gymnasium
import numpy as np
import pandas as pd

from caregiver_mj import cli
from caregiver_mj.experiments.spec import episode_seed

HOUSE = "house-25-12x10"
# As LeRobot loads a file of its hub: no other module can import it.
SPEC = importlib.util.spec_from_file_location("hub_env", pathlib.Path(__file__).parents[2] / "examples/envhub/env.py")
hub = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(hub)


def test_vectors_of_a_task_reset_and_step():
    suites = hub.make_env(2, True, types.SimpleNamespace(task="block_stairs", house=HOUSE, size=(64, 48)))
    envs = suites["caregiver_mj"][0]
    try:
        observations, _ = envs.reset(seed=[3, 4])
        assert observations["pixels"]["overview"].shape == (2, 48, 64, 3)
        assert np.ptp(observations["pixels"]["overview"]) > 50
        stepped, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(stepped)
        assert not (terminated | truncated | infos["is_success"]).any()
        assert rewards.shape == (2,)
        assert envs.call("_max_episode_steps") == (3000, 3000)
        assert all("stairwell" in text for text in envs.call("task_description"))
    finally:
        envs.close()


def test_there_are_all_tasks_where_none_is_asked_for(monkeypatch):
    monkeypatch.setattr(hub, "ForLeRobot", lambda task, **options: gymnasium.make("CartPole-v1"))
    assert [*hub.make_env(n_envs=1, use_async_envs=True)["caregiver_mj"]] == [0, 1, 2]


def test_observations_are_those_of_the_data_sets_and_success_is_an_episode_without_harm(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    env = hub.ForLeRobot("supervise", ("overview", "wrist"), house=HOUSE, epsilon=1.0, task_kwargs={"time_limit": 0.2})
    arguments = ["record", "--format", "lerobot", "--house", HOUSE, "--epsilon", "1", "--caregiver", "random-actions"]
    arguments += ["--camera", "overview", "wrist", "--seconds", ".2", "--episodes", "1", "--out", "set"]
    assert cli.main(arguments) == 0
    assert capsys.readouterr().out == "set\n"
    rows = pd.read_parquet("set/data/chunk-000/file-000.parquet")
    info = json.loads(pathlib.Path("set/meta/info.json").read_text())
    cameras = [name.rpartition(".")[2] for name in info["features"] if name.startswith("observation.images.")]
    assert cameras == [*env.observation_space["pixels"]]
    assert (info["total_episodes"], info["total_frames"], info["robot_type"]) == (1, 10, "mobile_fr3")
    assert info["features"]["action"]["names"][:3] == ["base_x", "base_y", "base_yaw"]
    assert info["features"]["observation.images.wrist"]["shape"] == [*env.observation_space["pixels"]["wrist"].shape]
    observation, _ = env.reset(seed=episode_seed(0, 0))
    for _, row in rows.iterrows():
        np.testing.assert_array_equal(observation["agent_pos"].astype(np.float32), row["observation.state"])
        observation, _, _, truncated, info = env.step(np.array(row["action"], np.float32))
    assert truncated
    assert info["is_success"] == (info["outcome"]["damage"] == 0)
    env.close()
