"""The fingerprint of the package: the same wherever it is the same code, and another one wherever it is not."""

import os
import pathlib
import shutil
import subprocess
import sys

from caregiver_mj.experiments.provenance import difference, fingerprint

ROOT = pathlib.Path(__file__).parents[2]


def fingerprint_in(folder):
    code = "from caregiver_mj.experiments.provenance import fingerprint; print(fingerprint()['source'])"
    options = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(folder)}}
    done = subprocess.run([sys.executable, "-c", code], **options, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_an_installed_package_has_that_of_its_checkout_until_it_is_edited(tmp_path):
    ignored = shutil.ignore_patterns("__pycache__")
    for source, target in (("caregiver_mj", "."), ("tasks", "tasks"), ("models", "models")):
        shutil.copytree(ROOT / source, tmp_path / "caregiver_mj" / target, ignore=ignored)
    assert fingerprint_in(tmp_path) == fingerprint()["source"]
    with open(tmp_path / "caregiver_mj" / "tasks" / "supervise.py", "a") as file:
        file.write("\n# edited\n")
    assert fingerprint_in(tmp_path) != fingerprint()["source"]


def test_differences_are_told_by_name():
    here = fingerprint()
    assert difference(here, here) == ""
    assert difference(here | {"numpy": "1.0"}, here) == f"numpy 1.0 and not {here['numpy']}"
    assert difference({}, {"source": "abc"}) == "source None and not abc"
