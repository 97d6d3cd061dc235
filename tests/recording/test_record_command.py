"""The command `record`: both formats, policies of one's own, and what it refuses."""

import pathlib
import sys

import minari
import numpy as np
import pandas as pd
import pytest

from caregiver_mj import cli

GRID = ["record", "--format", "minari", "--task", "targets", "--world", "grid", "--caregiver", "random-actions"]
HOUSE = ["record", "--seconds", "0.2", "--episodes", "2", "--epsilon", "1"]


def load(root, name, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    return minari.load_dataset(name)


def same(one, other):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.actions, b.actions)
        np.testing.assert_array_equal(a.rewards, b.rewards)
        for key, values in a.observations.items():
            np.testing.assert_array_equal(values, b.observations[key])


def test_a_data_set_of_ones_own_house_is_recovered_in_another_folder(tmp_path, monkeypatch):
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    house = pathlib.Path("tiny.txt")
    house.write_text("######\n#B.S.#\n#....#\n#C..T#\n######\n")
    assert cli.main([*GRID, "--house", str(house), "--episodes", "1", "--name", "mine-v0", "--out", str(tmp_path)]) == 0
    house.unlink()  # as on another machine
    monkeypatch.chdir(tmp_path / "there")
    found = load(tmp_path, "mine-v0", monkeypatch)
    env = found.recover_environment()
    assert env.observation_space == found.observation_space
    assert env.unwrapped.world.world.plan.name == "tiny"
    assert str(tmp_path) not in found.spec.env_spec.to_json()


OWN = """
import numpy as np
from caregiver_mj.caregivers import TargetPolicy


class First(TargetPolicy):
    def act(self, observations, masks):
        return masks[:, 1:].any(axis=1) * (1 + masks[:, 1:].argmax(axis=1))


class Slow:
    def __init__(self, env):
        self.shape = env.action_spec().shape

    def reset(self, seed):
        self.drawn = np.random.RandomState(seed)

    def __call__(self, timestep):
        return self.drawn.uniform(-0.1, 0.1, self.shape)


def slow(env):
    return Slow(env)
"""
STOP = """class Slow:
    begun = 0

    def _interrupted(self):
        import pathlib

        self.begun += 1
        if self.begun == 2 and not pathlib.Path("go on").exists():
            raise KeyboardInterrupt
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "of_my_own.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    yield "of_my_own"
    sys.modules.pop("of_my_own", None)


def test_policies_of_ones_own_are_recorded(own, tmp_path, monkeypatch):
    for i, jobs in enumerate(("1", "2")):
        command = [*HOUSE, "--format", "minari", "--caregiver", f"{own}:slow", "--name", "a-v0", "--jobs", jobs]
        assert cli.main([*command, "--out", str(tmp_path / str(i))]) == 0
    one, other = (load(tmp_path / str(i), "a-v0", monkeypatch) for i in range(2))
    same(one, other)
    first, second = (episode.actions for episode in one)
    assert (np.abs(first) <= 0.1).all()
    assert (first != second).any()  # it was told another seed
    assert first.std() > 0.01
    assert "'of_my_own:slow'" in one.storage.metadata["description"]


def test_a_recorded_policy_of_targets_does_what_it_does_in_an_evaluation(own, tmp_path, monkeypatch):
    argv = ["--world", "grid", "--epsilon", "1", "--caregiver", f"{own}:First", "--episodes", "2"]
    assert cli.main(["record", "--format", "minari", "--task", "targets", *argv, "--name", "a-v0", "--out", "d"]) == 0
    assert cli.main(["evaluate", *argv, "--out", "run"]) == 0
    rewards = [-episode.rewards.sum() for episode in load(tmp_path / "d", "a-v0", monkeypatch)]
    assert rewards == pytest.approx(list(pd.read_parquet("run/episodes.parquet").damage))


def test_a_recording_does_not_go_on_with_code_that_was_edited(own, tmp_path, capsys):
    module = tmp_path / f"{own}.py"
    module.write_text(OWN.replace("self.drawn =", "self.drawn = self._interrupted() or").replace("class Slow:", STOP))
    command = [*HOUSE, "--format", "lerobot", "--caregiver", f"{own}:slow", "--out", "set"]
    assert cli.main(command) == 1
    assert "; 1 of 2 episodes are kept" in capsys.readouterr().err
    sys.modules.pop(own)
    text = module.read_text()
    module.write_text(f"{text}# edited\n")
    assert cli.main([*command, "--resume"]) == 2
    assert "caregiver of_my_own:slow has changed, from of_my_own.py, sha256 " in capsys.readouterr().err
    sys.modules.pop(own)
    module.write_text(text)
    asked = tmp_path / ".set.episodes" / "run.json"
    kept = asked.read_text()
    for wrong in ("{", "[]", "null3"):
        asked.write_text(wrong)
        assert cli.main([*command, "--resume"]) == 2
        assert "the record of a run" in capsys.readouterr().err
    asked.write_text(kept)
    (tmp_path / "go on").touch()
    assert cli.main([*command, "--resume"]) == 0
