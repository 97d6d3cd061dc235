"""Gymnasium is an extra: without it all else works, and what needs it says so."""

import subprocess
import sys

import pytest

WITHOUT = "import sys; sys.modules['gymnasium'] = None\n"


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_the_package_works_without_it():
    done = run(WITHOUT + "import caregiver_mj; print(caregiver_mj.FloorPlan.load('paper').name)")
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "paper", "")


@pytest.mark.parametrize("module", ["caregiver_mj.envs", "caregiver_mj.envs.spaces"])
def test_what_needs_it_says_so_in_a_line(module):
    done = run(WITHOUT + f"import {module}")
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert "MissingExtraError: caregiver_mj.envs needs gymnasium" in last
    assert "pip install 'caregiver_mj[gym]'" in last


def test_importing_the_package_imports_neither_gymnasium_nor_numpy():
    done = run("import sys, caregiver_mj; print(sorted({'gymnasium', 'numpy'} & sys.modules.keys()))")
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


@pytest.mark.parametrize(
    "imports",
    [
        "import caregiver_mj, gymnasium",
        "import gymnasium; gymnasium.make('caregiver_mj:caregiver_mj/Supervise-v0')",
        "import caregiver_mj.tasks; from gymnasium.envs.registration import register; import gymnasium",
        "import caregiver_mj, importlib.util; importlib.util.find_spec('gymnasium'); import gymnasium",
    ],
)
def test_environments_are_registered_once_whatever_is_imported_first(imports):
    made = "import warnings; warnings.simplefilter('error')  # as where one is registered twice\n" + imports
    done = run(made + "\nprint(sum(name.startswith('caregiver_mj/') for name in gymnasium.registry))")
    assert (done.stdout.strip(), done.stderr) == ("4", "")
