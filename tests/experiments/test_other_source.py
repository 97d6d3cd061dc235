"""A run is of one program: it is not gone on with by one whose own source, as far as rows depend on it, is another."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

from caregiver_mj.experiments.provenance import source_digest

ROOT = pathlib.Path(__file__).parents[2]
RUN = ("--world", "grid", "--epsilon", "1", "--caregiver", "none", "nearest", "--out", "run")
WORDS = "the source of caregiver_mj that decides rows has changed, from "
NEW_COLUMN = '    sighs: int = _column("", "sighs", "how often somebody sighed", "count")\n\n    sim_seconds: float'


@pytest.fixture
def checkout(tmp_path):
    """A copy of the package, to be edited."""
    ignored = shutil.ignore_patterns("__pycache__")
    for source, target in (("caregiver_mj", "."), ("tasks", "tasks"), ("models", "models")):
        shutil.copytree(ROOT / source, tmp_path / "caregiver_mj" / target, ignore=ignored)
    return tmp_path


def python(folder, *said):
    environment = os.environ | {"PYTHONPATH": str(folder)}
    return subprocess.run(
        [sys.executable, *said], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def run(folder, *more):
    return python(folder, "-m", "caregiver_mj", *more)


def edit(folder, file, old, new):
    path = folder / "caregiver_mj" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def files(folder):
    return {path: path.read_bytes() for path in (folder / "run").rglob("*") if path.is_file()}


def test_a_run_is_not_gone_on_with_by_another_program(checkout):
    assert run(checkout, "evaluate", *RUN, "--episodes", "2").returncode == 0
    before = files(checkout)
    for file, old, new in (
        ("caregivers/baselines.py", '"""', '"""Edited. '),
        ("recording/record.py", "    sim_seconds: float", NEW_COLUMN),
    ):
        source = (checkout / "caregiver_mj" / file).read_text()
        edit(checkout, file, old, new)
        for episodes in ("2", "4"):
            done = run(checkout, "evaluate", *RUN, "--episodes", episodes, "--resume")
            assert done.returncode == 2
            (line,) = done.stderr.strip().splitlines()
            assert WORDS in line
            assert line.endswith("; put it back, or take another folder")
            assert files(checkout) == before
        (checkout / "caregiver_mj" / file).write_text(source)
    done = run(checkout, "evaluate", *RUN, "--episodes", "4", "--resume")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "file", ["viz/colours.py", "cli/runs.py", "experiments/statistics.py", "robot/driver.py", "house/physics.py"]
)
def test_what_decides_no_row_may_change(checkout, file):
    assert run(checkout, "evaluate", *RUN, "--episodes", "2").returncode == 0
    edit(checkout, file, '"""', '"""Edited. ')
    done = run(checkout, "evaluate", *RUN, "--episodes", "4", "--resume")
    assert done.returncode == 0, done.stderr


def digests(folder):
    """Of the house and of the grid."""
    code = "from caregiver_mj.experiments.provenance import source_digest as f; print(f(), f('grid'))"
    return python(folder, "-c", code).stdout.split()


def test_in_the_house_robot_and_models_count_too(checkout):
    first = digests(checkout)
    assert first == [source_digest(), source_digest("grid")]
    for file, old in (("robot/driver.py", '"""'), ("models/candle.xml", "<mujoco"), ("tasks/supervise.py", '"""')):
        edit(checkout, file, old, f"{old}  " if old != "<mujoco" else "<!-- edited -->\n<mujoco")
        now = digests(checkout)
        assert now[0] != first[0]
        assert now[1] == first[1]
        first = now


def test_what_somebodys_policy_is_made_of_counts(checkout):
    (checkout / "mine.py").write_text(
        "from caregiver_mj.caregivers import TargetPolicy\n"
        "class Nothing(TargetPolicy):\n"
        "    def act(self, observations, masks):\n"
        "        return masks.argmax(axis=1)\n"
    )
    said = ("evaluate", *RUN, "--caregiver", "mine:Nothing", "--episodes", "2")
    assert run(checkout, *said).returncode == 0
    edit(checkout, "caregivers/target_observation.py", '"""', '"""Edited. ')
    done = run(checkout, *said, "--resume")
    assert done.returncode == 2
    assert WORDS in done.stderr
