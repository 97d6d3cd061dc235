"""The wheel, and a fresh environment with it."""

import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[1]
FOLDERS = {"caregiver_mj": "caregiver_mj", "tasks": "caregiver_mj.tasks", "models": "caregiver_mj.models"}


def build_wheel(folder):
    """Builds the wheel, by way of the source distribution, into a folder; its path."""
    # From a copy: in the checkout, a build/ of old would lend the wheel modules that are gone.
    source = folder / "source"
    for name in FOLDERS:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, source)
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source]
    subprocess.run(build, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


def environment_with(wheel, folder):
    """The interpreter of a fresh environment that has the wheel, and the libraries of this one."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run(pip, check=True, capture_output=True)
    # Folders added in this way do not have their own .pth files read, so the editable checkout stays out.
    (site,) = folder.glob("lib/python*/site-packages")
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    (site / "libraries.pth").write_text("\n".join(libraries) + "\n")
    return python
