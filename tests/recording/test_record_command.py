"""The command `record`: both formats, recordings that break off, and what it refuses."""

import functools
import json
import pathlib
import signal
import subprocess
import sys
import time

import minari
import numpy as np
import pandas as pd
import pytest

from caregiver_mj import cli

GRID = ["record", "--format", "minari", "--task", "targets", "--world", "grid", "--caregiver", "random-actions"]
NAME = "caregiver_mj/grid-targets-paper-random-actions-0_5-v0"
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


def test_lerobot(tmp_path, capsys):
    out = tmp_path / "set"
    assert cli.main([*HOUSE, "--format", "lerobot", "--camera", "wrist", "--size", "64x48", "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
    info = json.loads((out / "meta/info.json").read_text())
    assert (info["total_episodes"], info["total_frames"], info["robot_type"]) == (2, 20, "mobile_fr3")
    assert info["features"]["action"]["names"][:3] == ["base_x", "base_y", "base_yaw"]
    assert (out / "videos/observation.images.wrist/chunk-000/file-000.mp4").stat().st_size > 1000
    assert len(pd.read_parquet(out / "data/chunk-000/file-000.parquet")) == 20


def test_minari_in_two_processes_is_minari_in_one(tmp_path, monkeypatch):
    command = [*GRID, "--episodes", "3", "--name", "mine-v1"]
    assert cli.main([*command, "--out", str(tmp_path / "one")]) == 0
    assert cli.main([*command, "--out", str(tmp_path / "two"), "--jobs", "2"]) == 0
    one = load(tmp_path / "one", "mine-v1", monkeypatch)
    assert len(one) == 3
    same(one, load(tmp_path / "two", "mine-v1", monkeypatch))


@pytest.mark.parametrize("house", ["tiny.txt", "house-3"])
def test_a_data_set_of_ones_own_house_is_recovered_in_another_folder(house, tmp_path, monkeypatch):
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    if house != "house-3":
        pathlib.Path(house).write_text("######\n#B.S.#\n#....#\n#C..T#\n######\n")
    assert cli.main([*GRID, "--house", house, "--episodes", "1", "--name", "mine-v0", "--out", str(tmp_path)]) == 0
    pathlib.Path(house).unlink(missing_ok=True)  # as on another machine
    monkeypatch.chdir(tmp_path / "there")
    found = load(tmp_path, "mine-v0", monkeypatch)
    env = found.recover_environment()
    assert env.observation_space == found.observation_space
    assert env.unwrapped.world.world.plan.name == house.removesuffix(".txt")
    assert str(tmp_path) not in found.spec.env_spec.to_json()


def test_a_recording_that_breaks_off_is_gone_on_with(tmp_path, monkeypatch, capsys):
    command = [*GRID, "--episodes", "4000", "--out", str(tmp_path)]  # more than it can do before it is stopped
    # Tests that run in the background of a script have been told to ignore Ctrl-C, and so would their children.
    options = {"preexec_fn": functools.partial(signal.signal, signal.SIGINT, signal.default_int_handler)}
    process = subprocess.Popen(
        [sys.executable, "-m", "caregiver_mj", *command], stderr=subprocess.PIPE, text=True, **options
    )
    store = pathlib.Path(tmp_path, "caregiver_mj", f".{NAME.partition('/')[2]}.episodes")
    for _ in range(3000):
        if len(list(store.glob("*/episode.json"))) >= 2:
            break
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate()
    assert process.returncode == 1
    last = error.splitlines()[-1]
    assert last.startswith("caregiver-mj: interrupted; ")
    assert last.endswith(f"--out {tmp_path} --resume")
    assert not (tmp_path / NAME).exists()
    kept = {path: path.stat().st_mtime_ns for path in store.glob("0*/episode.json")}
    assert 2 <= len(kept) < 4000

    assert cli.main(command) == 2
    assert "interrupted recording: use --resume, or remove it" in capsys.readouterr().err
    assert cli.main([*command, "--resume", "--seed", "1"]) == 2
    assert "seed is 0 there and 1 here" in capsys.readouterr().err
    assert cli.main([*GRID, "--episodes", "1", "--out", str(tmp_path), "--resume"]) == 2
    assert f"holds {len(kept) - 1} episodes beyond --episodes" in capsys.readouterr().err
    few = str(max(3, len(kept)))  # how many is asked anew
    assert cli.main([*GRID, "--episodes", few, "--out", str(tmp_path), "--resume"]) == 0
    assert not store.exists()
    whole = tmp_path / "whole"
    assert cli.main([*GRID, "--episodes", few, "--out", str(whole)]) == 0
    found = load(tmp_path, NAME, monkeypatch)
    assert len(found) == int(few)
    same(found, load(whole, NAME, monkeypatch))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--format", "minari", "--name", "short"], "must be NAME-vNUMBER or GROUP/NAME-vNUMBER, of letters"),
        (["--format", "minari", "--name", "x/y-v0"], "(two or more in a group), got 'x/y-v0'"),
        (["--format", "lerobot", "--name", "a-v0"], "--name must be left out with --format lerobot"),
        (["--format", "lerobot", "--camera", "hall"], "no camera 'hall'"),
        (["--format", "lerobot", "--size", "big"], "--size must be WIDTHxHEIGHT"),
        (["--format", "lerobot", "--size", "33x40"], "must be even"),
        (
            ["--format", "lerobot", "--episodes", "99999999999999"],
            "episodes must be 1 to 1,000,000, got 99999999999999",
        ),
        (["--format", "lerobot", "--seconds", "1e9"], "at most 3600, got 1000000000.0"),
        (["--format", "lerobot", "--seed", "-1"], "seed must be at least 0"),
        (["--format", "lerobot", "--caregiver", "nanny"], "no caregiver 'nanny'"),
        (["--format", "lerobot", "--caregiver", "none"], "caregiver must be one that acts, got 'none'"),
        (["--format", "minari", "--world", "grid", "--task", "targets", "--embodiment", "butler"], "no robot 'butler'"),
        (["--format", "csv"], "invalid choice: 'csv'"),
        (["--format", "minari", "--out", ""], "--out must be a folder, got an empty name"),
        (["--format", "lerobot", "--caregiver", "json:x"], "'json:x' cannot be loaded"),
    ],
)
def test_what_is_refused(options, message, tmp_path, capsys):
    assert cli.main([*HOUSE, "--out", str(tmp_path / "set"), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


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
    """A module with policies of one's own in the present folder."""
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
    assert "code is {'caregiver of_my_own:slow': 'of_my_own.py, sha256 " in capsys.readouterr().err
    sys.modules.pop(own)
    module.write_text(text)
    asked = tmp_path / ".set.episodes" / "asked.json"
    kept = asked.read_text()
    for wrong in ("{", "[]", "null3"):
        asked.write_text(wrong)
        assert cli.main([*command, "--resume"]) == 2
        assert "asked.json' does not say what was recorded" in capsys.readouterr().err
    asked.write_text(kept)
    (tmp_path / "go on").touch()
    assert cli.main([*command, "--resume"]) == 0


def test_a_recording_that_fails_before_there_is_an_episode_leaves_nothing(own, tmp_path, capsys):
    module = tmp_path / f"{own}.py"
    command = [*HOUSE, "--format", "lerobot", "--out", "set"]
    for seed, error in enumerate(("ValueError", "KeyboardInterrupt", "OSError"), start=20):  # a prepared policy is kept
        module.write_text(OWN.replace("return self.drawn", f"raise {error}\n        return self.drawn"))
        status = cli.main([*command, "--caregiver", f"{own}:slow", "--seed", str(seed)])
        told = (
            "; there is no episode yet\n"
            if error == "KeyboardInterrupt"
            else f"failed in house 'paper' (is it a policy for another one?): {error}:"
        )
        assert status == (1 if error == "KeyboardInterrupt" else 2)
        assert told in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir() if "set" in path.name] == []
        sys.modules.pop(own)
    assert cli.main([*command, "--caregiver", "paper"]) == 0


def test_a_recording_killed_before_there_is_an_episode_is_resumed_with_other_code(own, tmp_path, capsys):
    command = [*HOUSE, "--format", "lerobot", "--caregiver", f"{own}:slow", "--out", "set", "--resume"]
    left = tmp_path / ".set.episodes"
    (left / "000000.tmp").mkdir(parents=True)
    (left / "000000.tmp" / "episode.json").touch()
    (left / "asked.json").write_text('{"code": "of before"}')
    assert cli.main(command[:-1]) == 2
    assert "interrupted recording: use --resume, or remove it" in capsys.readouterr().err
    assert cli.main(command) == 0
    assert not left.exists()


def test_a_policy_of_actions_chooses_no_targets(own, tmp_path, capsys):
    argv = ["record", "--format", "minari", "--task", "targets", "--caregiver", f"{own}:slow", "--out", "set"]
    assert cli.main(argv) == 2
    assert "must choose targets, got 'of_my_own:slow', a policy of the robot's actions" in capsys.readouterr().err
    assert not (tmp_path / "set").exists()


def test_decisions_are_too_rare_for_lerobot_and_nothing_is_written_over(tmp_path, capsys):
    assert cli.main([*GRID[:2], "lerobot", *GRID[3:], "--out", str(tmp_path / "set")]) == 2
    assert "steps a second must be a whole number for LeRobot" in capsys.readouterr().err
    (tmp_path / "set").mkdir()
    assert cli.main([*HOUSE, "--format", "lerobot", "--out", str(tmp_path / "set")]) == 2
    assert "which exists" in capsys.readouterr().err


@pytest.mark.parametrize(("module", "extra"), [("minari", "minari"), ("h5py", "minari"), ("gymnasium", "gym")])
def test_without_an_extra_it_says_which(module, extra, tmp_path):
    code = f"import sys; sys.modules['{module}'] = None; from caregiver_mj.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", code, *GRID, "--out", str(tmp_path / "set")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.endswith(f"pip install 'caregiver_mj[{extra}]'\n")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "set").exists()
