"""Install the wheel in a fresh environment, and test it as a new user would.

A fresh virtual environment gets the wheel alone, and each part that needs an extra must name it in one line. Then it
gets the extras, and runs `tests/test_from_wheel.py`. This takes a minute beside pip.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from wheels import build_wheel  # noqa: E402

GRID = ["evaluate", "--world", "grid", "--epsilon", "1", "--episodes", "1"]
WITHOUT = {  # commands that need an extra, by extra
    "dask": [*GRID, "--executor", "dask", "--scheduler", "tcp://127.0.0.1:9"],
    "gym": ["record", "--format", "lerobot", "--out", "data"],
    "web": ["view", "--web"],
}
EXTRAS = "dask,gym,minari,web"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pytest", nargs="*", help="arguments for pytest")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        home = pathlib.Path(folder, "home")
        home.mkdir()
        wheel = build_wheel(home)
        subprocess.run([sys.executable, "-m", "venv", home / "venv"], check=True)
        python = home / "venv" / "bin" / "python"
        install(python, str(wheel))
        look_without_dm_control(python, home)
        install(python, "--no-deps", "dm_control")
        look_without_extras(python, home)
        install(python, f"{wheel}[{EXTRAS}]")
        pytest = [sys.executable, "-m", "pytest", "-q", "-n", "0", *arguments.pytest]
        command = [*pytest, ROOT / "tests/test_from_wheel.py"]
        environment = os.environ | {"CAREGIVER_PYTHON": str(python)}
        sys.exit(subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode)


def install(python, *what):
    """Install packages by pip, in the versions of `constraints.txt`."""
    pip = [python, "-m", "pip", "install", "-qq", "--disable-pip-version-check"]
    subprocess.run([*pip, *what, "-c", ROOT / "constraints.txt"], check=True)


def look_without_dm_control(python, home):
    """Run the house, which must say how to install dm_control if pip alone does not, from Python 3.13 on."""
    if subprocess.run([python, "-c", "import dm_control"], cwd=home, capture_output=True, check=False).returncode:
        command = [python.parent / "caregiver-mj", "evaluate", "--world", "house"]
        found = subprocess.run(command, cwd=home, capture_output=True, text=True, check=False)
        (line,) = found.stderr.splitlines()
        if found.returncode != 2 or "pip install --no-deps dm_control==" not in line:
            sys.exit(f"the house does not say how to install dm_control, but: {found.stderr}")
        print(line)


def look_without_extras(python, home):
    """Run a command without extras, and commands that must name their extra."""
    command = python.parent / "caregiver-mj"
    subprocess.run([command, *GRID], cwd=home, check=True, capture_output=True)
    for extra, argv in WITHOUT.items():
        found = subprocess.run([command, *argv], cwd=home, capture_output=True, text=True, check=False)
        *before, last = found.stderr.splitlines()
        if (found.returncode, before) != (2, []) or not last.endswith(f"pip install 'caregiver_mj[{extra}]'"):
            sys.exit(f"{' '.join(argv)} does not ask for the extra {extra}, but says: {found.stderr}")
        print(last)


if __name__ == "__main__":
    main()
