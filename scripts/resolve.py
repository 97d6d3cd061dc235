"""Checks that pip finds a wheel of every package, all extras included, in the versions of `constraints.txt`.

It asks for the oldest and the newest Python that are supported, for one at hand does not tell, or for those that are
given as arguments. It installs nothing.
"""

import pathlib
import subprocess
import sys
import tempfile
import tomllib

from packaging.requirements import Requirement

ROOT = pathlib.Path(__file__).parents[1]
PYTHONS = ("3.11.2", "3.14")  # the oldest, which is Debian 12's, and the newest
_LINES = 12  # of what pip says last


def requirements(python):
    """What the package and its extras need with a version of Python; pip reads markers by the one that it runs on."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    everything = map(Requirement, [*project["dependencies"], *(needed for extra in extras for needed in extra)])
    version = {"python_version": ".".join(python.split(".")[:2])}
    needed = [one for one in everything if not one.marker or one.marker.evaluate(version)]
    return sorted({str(one).partition(";")[0] for one in needed})


def resolve(python, constraints=ROOT / "constraints.txt", wanted=None):
    """What pip has to say against it, for a version of Python; nothing if all is well."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--dry-run"]
        command += ["--ignore-installed", "--only-binary=:all:", "--python-version", python, "--target", folder]
        command += ["-c", str(constraints), *(wanted or requirements(python))]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        told = [*done.stdout.splitlines(), *done.stderr.splitlines()]
        return "\n".join(told[-_LINES:]) if done.returncode else ""


def main():
    failed = {python: told for python in sys.argv[1:] or PYTHONS if (told := resolve(python))}
    for python, told in failed.items():
        print(f"constraints.txt does not resolve on Python {python}:\n{told}", file=sys.stderr)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
