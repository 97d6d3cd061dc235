"""A run is of one program: it is not gone on with by one whose own source, as far as rows depend on it, is another."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

from caregiver_mj.experiments.provenance import difference, fingerprint, origin, source_digest

ROOT = pathlib.Path(__file__).parents[2]
RUN = ("--world", "grid", "--epsilon", "1", "--out", "run")
CAREGIVERS = ("none", "nearest", "mine:Nothing")
MINE = """\
from caregiver_mj.caregivers import TargetPolicy

class Nothing(TargetPolicy):
    def act(self, observations, masks):
        return masks.argmax(axis=1)
"""
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
    options = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(folder)}}
    return subprocess.run([sys.executable, *said], **options, capture_output=True, text=True, check=False)


def run(folder, *more):
    return python(folder, "-m", "caregiver_mj", "evaluate", *RUN, *more)


def digests(folder):
    """Of all files, of those that decide rows in the house, and in the grid."""
    code = "from caregiver_mj.experiments.provenance import fingerprint as all, source_digest as f; "
    return python(folder, "-c", code + "print(all()['source'], f(), f('grid'))").stdout.split()


def edit(folder, file, old, new):
    path = folder / "caregiver_mj" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def files(folder):
    return {path: path.read_bytes() for path in (folder / "run").rglob("*") if path.is_file()}


def test_a_run_is_not_gone_on_with_by_another_program(checkout):
    (checkout / "mine.py").write_text(MINE)
    assert run(checkout, "--caregiver", *CAREGIVERS, "--episodes", "2").returncode == 0
    before = files(checkout)
    for file, old, new in (
        ("caregivers/baselines.py", '"""', '"""Edited. '),
        ("caregivers/target_observation.py", '"""', '"""Edited. '),  # what `mine` is made of
        ("recording/record.py", "    sim_seconds: float", NEW_COLUMN),
    ):
        source = (checkout / "caregiver_mj" / file).read_text()
        edit(checkout, file, old, new)
        done = run(checkout, "--caregiver", *CAREGIVERS, "--episodes", "4", "--resume")
        assert done.returncode == 2
        (line,) = done.stderr.strip().splitlines()
        assert WORDS in line
        assert line.endswith("; put it back, or take another folder")
        assert files(checkout) == before
        (checkout / "caregiver_mj" / file).write_text(source)
    for file in ("viz/colours.py", "cli/runs.py", "experiments/statistics.py", "robot/driver.py", "house/physics.py"):
        edit(checkout, file, '"""', '"""Edited. ')  # none of which decides a row
    done = run(checkout, "--caregiver", *CAREGIVERS, "--episodes", "4", "--resume")
    assert done.returncode == 0, done.stderr


def test_a_copy_has_the_digests_of_its_checkout_until_it_is_edited(checkout):
    first = digests(checkout)
    assert first == [fingerprint()["source"], source_digest(), source_digest("grid")]
    for file, old in (("robot/driver.py", '"""'), ("models/candle.xml", "<mujoco"), ("tasks/supervise.py", '"""')):
        edit(checkout, file, old, f"{old}  " if old != "<mujoco" else "<!-- edited -->\n<mujoco")
        now = digests(checkout)
        assert now[0] != first[0]
        assert now[1] != first[1]
        assert now[2] == first[2]  # the grid has neither robot nor models
        first = now


def test_differences_are_told_by_name():
    here = fingerprint()
    assert difference(here, here) == ""
    assert difference(here | {"numpy": "1.0"}, here) == f"numpy 1.0 and not {here['numpy']}"
    assert difference({}, {"source": "abc"}) == "source None and not abc"


@pytest.mark.parametrize("files", [["weights.txt"], "weights.txt", pathlib.PurePath("weights.txt")])
def test_files_beside_the_code_count_one_or_several(tmp_path, monkeypatch, files):
    (tmp_path / "with_weights.py").write_text(f"from pathlib import *\nclass Mine:\n    files = {files!r}\n")
    monkeypatch.syspath_prepend(tmp_path)
    hashes = []
    for content in ("0.5", "0.5", "0.6"):
        (tmp_path / "weights.txt").write_text(content)
        sys.modules.pop("with_weights", None)
        hashes.append(origin(__import__("with_weights").Mine))
    sys.modules.pop("with_weights")
    assert hashes[0] == hashes[1] != hashes[2]
    assert hashes[0].startswith("with_weights.py, sha256 ")
