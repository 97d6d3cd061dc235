"""The batch as Stable-Baselines3 takes it; where that is not installed, a base class stands for its own."""

import sys
import types

import gymnasium
import numpy as np
import pytest
from small import OTHER, PLAN, TARGETS, same

from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.errors import CaregiverError, MissingExtraError

MAKERS = {
    "batch": lambda **options: gymnasium.make_vec(TARGETS, 4, house=PLAN, **options),
    "houses": lambda **options: GridHousesVector((PLAN, OTHER), 4, **options),
}


class VecEnv:
    """What the adapter uses of Stable-Baselines3's class, as of its 2.9.2."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self._reset_seeds()

    def _reset_seeds(self):
        self._seeds = [None] * self.num_envs

    def seed(self, seed):
        self._seeds = [seed + i for i in range(self.num_envs)]
        return self._seeds

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()

    def _get_indices(self, indices):
        return range(self.num_envs) if indices is None else [indices] if isinstance(indices, int) else indices


@pytest.fixture
def adapter(monkeypatch):
    try:
        import stable_baselines3  # noqa: F401
    except ImportError:
        names = ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")
        for name in names:
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        sys.modules[names[-1]].VecEnv = VecEnv
    monkeypatch.delitem(sys.modules, "caregiver_mj.envs.sb3", raising=False)
    import caregiver_mj.envs.sb3

    yield caregiver_mj.envs.sb3.BatchVecEnv
    monkeypatch.delitem(sys.modules, "caregiver_mj.envs.sb3")


def of(observations, i):
    return (
        {key: values[i] for key, values in observations.items()} if isinstance(observations, dict) else observations[i]
    )


@pytest.mark.parametrize(("kind", "observation"), [("batch", "flat"), ("houses", "map")])
def test_it_is_the_batch(adapter, kind, observation):
    batch, envs = MAKERS[kind](observation=observation), adapter(MAKERS[kind](observation=observation))
    envs.seed(11)
    wanted, info = batch.reset(seed=11)
    assert same(envs.reset(), wanted)
    for step in range(1, 202):
        masks = np.stack(envs.env_method("action_masks"))
        np.testing.assert_array_equal(masks, info["action_mask"].astype(bool))
        actions = masks.argmax(axis=1)
        found, rewards, ended, infos = envs.step(actions)
        wanted, wants, *_, info = batch.step(actions)
        assert (rewards.dtype, ended.dtype) == (np.float32, bool)
        np.testing.assert_array_equal(rewards, wants.astype(np.float32))
        assert ended.all() == ended.any() == (step % 200 == 0)
        assert [one["cost"] for one in infos] == info["cost"].tolist()
        if ended.all():
            assert all(same(one["terminal_observation"], of(wanted, i)) for i, one in enumerate(infos))
            assert all(one["TimeLimit.truncated"] is True for one in infos)
            assert [one["outcome"]["damage"] for one in infos] == info["outcome"]["damage"].tolist()
            assert [one["episode_score"] for one in infos] == info["episode_score"].tolist()
            if kind == "houses":
                assert [one["house"] for one in infos] == info["house"].tolist()
            wanted, *_, info = batch.step(actions)  # which begins the next ones
            assert [one["seed"] for one in envs.reset_infos] == info["seed"].tolist()
        else:
            assert not any("terminal_observation" in one for one in infos)
        assert same(found, wanted)
        assert all(of(found, i) in envs.observation_space for i in range(4))


def test_masks_of_some_and_what_there_is_not(adapter):
    envs = adapter(MAKERS["batch"]())
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.env_method("action_masks")
    envs.reset()
    assert envs.has_attr("action_masks")
    assert len(envs.env_method("action_masks", indices=[1, 3])) == 2
    assert envs.get_attr("render_mode", indices=0) == [None]
    assert envs.env_is_wrapped(gymnasium.Wrapper) == [False] * 4
    with pytest.raises(AttributeError, match="no method 'fly'"):
        envs.env_method("fly")
    envs.close()


def test_bad_input_is_named(adapter):
    with pytest.raises(CaregiverError, match="must be a vector environment"):
        adapter(gymnasium.make(TARGETS))
    once = gymnasium.vector.SyncVectorEnv([lambda: gymnasium.make(TARGETS)], autoreset_mode="SameStep")
    with pytest.raises(CaregiverError, match="must be NEXT_STEP"):
        adapter(once)


def test_without_stable_baselines_there_is_a_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.delitem(sys.modules, "caregiver_mj.envs.sb3", raising=False)
    with pytest.raises(MissingExtraError, match=r"pip install 'caregiver_mj\[learn\]'"):
        import caregiver_mj.envs.sb3  # noqa: F401
