"""Minari data sets, read back by Minari."""

import gymnasium
import minari
import numpy as np
import pytest

from caregiver_mj.envs.recipe import Recording, collect
from caregiver_mj.experiments.spec import EpisodeSpec, episode_seed
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.minari_dataset import write_minari
from caregiver_mj.recording.steps import Store

NAME = "toddlers/short-v0"
SEEDS = (episode_seed(11, 0), episode_seed(11, 1))
HOME = "home-2-10x9-rooms1-stairwells0-candles0-tables2-bins2-gates1-mugs1-batteries1"
RECORDING = Recording(EpisodeSpec(HOME, 0.5, seed=11, task_kwargs={"time_limit": 1.0}), ("wrist",), (64, 48))


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("recorded") / "store")
    for number in range(2):
        collect(RECORDING, store.path, number)
    return store


@pytest.fixture(scope="module")
def root(store, tmp_path_factory):
    root = tmp_path_factory.mktemp("minari")
    episodes = (store.load(i) for i in range(len(SEEDS)))
    write_minari(root, NAME, episodes, RECORDING.about(), RECORDING.spaces(), RECORDING.env_spec(HOME))
    return root


@pytest.fixture
def dataset(root, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    return minari.load_dataset(NAME)


def test_the_task_is_told_in_its_own_words():
    assert "harm" in RECORDING.about().task


def test_episodes_are_those_that_were_recorded(dataset, store):
    seeds = [data["seed"] for data in dataset.storage.get_episode_metadata([0, 1])]
    assert seeds == list(SEEDS)
    for number, found in enumerate(dataset):
        wanted = store.load(number)
        assert set(found.observations) == {*wanted.observations, "wrist"}
        for key, values in wanted.observations.items():
            np.testing.assert_array_equal(found.observations[key], values)
        np.testing.assert_array_equal(found.actions, wanted.actions)
        np.testing.assert_array_equal(found.rewards, wanted.rewards)
        assert not found.terminations.any()
        assert found.truncations.tolist() == [False] * 49 + [True]
        for key, values in (("cost", wanted.costs), ("intervention", wanted.interventions)):
            np.testing.assert_array_equal(found.infos[key][1:], values)
        assert found.infos["intervention"][0] == -1
        difference = found.observations["wrist"].astype(float) - wanted.frames["wrist"]
        assert np.abs(difference).mean() < 8.0  # of 255: they are JPEG
        assert all(dataset.action_space.contains(action) for action in found.actions)
        last = {key: np.asarray(seen[50]) for key, seen in found.observations.items()}
        assert dataset.observation_space.contains(last)


def test_its_environment_gives_the_same_episode_again(dataset):
    env = dataset.recover_environment()
    episode = dataset[1]
    observation, _ = env.reset(seed=SEEDS[1])
    for i, action in enumerate(episode.actions):
        for key, seen in observation.items():
            np.testing.assert_allclose(seen, episode.observations[key][i], atol=1e-3)
        observation, reward, _, truncated, _ = env.step(action)
        assert reward == pytest.approx(episode.rewards[i])
    assert truncated
    env.close()


def test_in_the_grid_actions_are_discrete_and_its_environment_has_the_same_damage(tmp_path, monkeypatch):
    plan = FloorPlan.load("paper", damage=DamageWeights(9.0, 4.0, 1.0))
    recording = Recording(EpisodeSpec(plan, 0.5, "random-actions", world="grid", task="targets"))
    store = Store(tmp_path / "store")
    collect(recording, store.path, 0)
    about = recording.about(), recording.spaces(), recording.env_spec("paper")
    write_minari(tmp_path, "dear-v0", [store.load(0)], *about)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset("dear-v0")
    env = dataset.recover_environment()
    assert env.unwrapped.world.world.plan == plan
    env.reset(seed=episode_seed(0, 0))
    (episode,) = dataset
    np.testing.assert_array_equal([env.step(action)[1] for action in episode.actions], episode.rewards)
    assert len(episode) == 200
    assert isinstance(dataset.action_space, gymnasium.spaces.Discrete)
    assert episode.rewards.sum() == -episode.infos["cost"].sum()
    np.testing.assert_array_equal(episode.infos["intervention"][1:], episode.actions - 1)
