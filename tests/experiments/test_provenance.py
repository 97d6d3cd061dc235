"""A run is of one program: it is not gone on with by one whose own source, as far as rows depend on it, is another."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

from caregiver_mj.experiments.provenance import code

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
LAST = '    _time("sim_seconds"'
FUTURE = "from __future__ import annotations\n"
NEW_COLUMN = f'    _count("sighs", "int", "", "sighs", "how often somebody sighed"),\n{LAST}'


def run(folder, *more):
    command = [sys.executable, "-m", "caregiver_mj", "evaluate", *RUN, *more]
    there = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(folder)}}
    return subprocess.run(command, **there, capture_output=True, text=True, check=False)


def edit(folder, file, old, new):
    path = folder / "caregiver_mj" / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def files(folder):
    return {path: path.read_bytes() for path in (folder / "run").rglob("*") if path.is_file()}


def test_words_are_no_code(tmp_path):
    bare, worded = tmp_path / "bare.py", tmp_path / "worded.py"
    bare.write_text('class Robot:\n    name = "#1"\n    def speed(self):\n        return 2\n')
    worded.write_text(
        '"""A robot.\n\n# With a head.\n"""\n\nclass Robot:\n    """One."""\n    name = "#1"  # the first\n\n'
        '    def speed(self):\n        """Return it, m/s."""\n        # as it says in the leaflet\n        return 2\n'
    )
    assert code(worded) == code(bare)
    worded.write_text(worded.read_text().replace("return 2", "return 3"))
    assert code(worded) != code(bare)


def test_every_change_of_a_string_is_one_of_the_code(tmp_path):
    module = tmp_path / "module.py"

    def of(text):
        module.write_text(text)
        return code(module)

    assert of('TEXT = "a"  # one\n') == of("TEXT = (  # two\n\n    'a'\n)\n")
    strings = ("a", "", "None", "a\n\nb", "a\nb", "a\n \nb", "a \nb", "a\n# c\nb", "a\n\n\nb")
    texts = [*(f'TEXT = """{string}"""\n' for string in strings), "TEXT = None\n"]
    texts += [f'class Text:\n    "what it is"\n    text = f"""{{A}}{string}"""\n' for string in strings]
    assert len({of(text) for text in texts}) == len(texts)
    assert of('class One: "A robot."\n') != of('class Two: "A robot."\n')


@pytest.mark.slow
def test_a_run_is_not_gone_on_with_by_another_program(tmp_path):
    checkout, ignored = tmp_path, shutil.ignore_patterns("__pycache__")
    for source, target in (("caregiver_mj", "."), ("tasks", "tasks"), ("models", "models")):
        shutil.copytree(ROOT / source, checkout / "caregiver_mj" / target, ignore=ignored)
    (checkout / "mine.py").write_text(MINE)
    assert run(checkout, "--caregiver", *CAREGIVERS, "--episodes", "2").returncode == 0
    before = files(checkout)
    for file, old, new in (
        ("caregivers/baselines.py", FUTURE, f"{FUTURE}EDITED = True\n"),
        ("caregivers/target_observation.py", FUTURE, f"{FUTURE}EDITED = True\n"),  # what `mine` is made of
        ("recording/record.py", LAST, NEW_COLUMN),
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
        edit(checkout, file, FUTURE, f"{FUTURE}EDITED = True\n")  # none of which decides a row
    edit(checkout, "caregivers/baselines.py", '"""', '"""Edited. ')  # no more do words
    done = run(checkout, "--caregiver", *CAREGIVERS, "--episodes", "4", "--resume")
    assert done.returncode == 0, done.stderr
