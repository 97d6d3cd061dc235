"""Check that pip finds wheels of all dependencies, including extras, in the versions of `constraints.txt`.

The check is for the oldest and the newest supported Python, or for the versions given as arguments. It installs
nothing.
"""

import pathlib
import subprocess
import sys
import tempfile
import tomllib

from packaging.requirements import Requirement

ROOT = pathlib.Path(__file__).parents[1]
PYTHONS = ("3.11.2", "3.14")  # the oldest, of Debian 12, and the newest
_LINES = 12  # last lines of pip's output to print


def requirements(python):
    """Return the requirements for a version of Python; pip itself evaluates markers for the running version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    everything = map(Requirement, [*project["dependencies"], *(needed for extra in extras for needed in extra)])
    version = {"python_version": ".".join(python.split(".")[:2])}
    needed = [one for one in everything if not one.marker or one.marker.evaluate(version)]
    return sorted({str(one).partition(";")[0] for one in needed})


def resolve(python, constraints=ROOT / "constraints.txt", wanted=None):
    """Return pip's errors for a version of Python, or ""."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--dry-run"]
        command += ["--ignore-installed", "--only-binary=:all:", "--python-version", python, "--target", folder]
        command += ["-c", str(constraints), *(wanted or requirements(python))]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        lines = [*done.stdout.splitlines(), *done.stderr.splitlines()]
        return "\n".join(lines[-_LINES:]) if done.returncode else ""


def main():
    failed = {python: errors for python in sys.argv[1:] or PYTHONS if (errors := resolve(python))}
    for python, errors in failed.items():
        print(f"constraints.txt does not resolve on Python {python}:\n{errors}", file=sys.stderr)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
