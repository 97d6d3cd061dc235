"""The wheel, built from a copy of the checkout."""

import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[1]
FOLDERS = {"caregiver_mj": "caregiver_mj", "tasks": "caregiver_mj.tasks", "models": "caregiver_mj.models"}
# What is made in a checkout, and must not lie in what is built from it, such as modules of old in build/.
MADE = (".git", ".*_cache", ".hypothesis", ".venv*", "__pycache__", "*.egg-info", "_build", "build", "runs")


def build_wheel(folder):
    """Builds the wheel, by way of the source distribution beside it, into a folder; its path."""
    source = folder / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*MADE))
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source]
    subprocess.run(build, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path
