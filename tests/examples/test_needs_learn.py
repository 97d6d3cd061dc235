"""The extra `learn` is missing: a line says so, and nothing is trained."""

import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", ["block_stairs", "hazard_policy", "sb3_vector", "supervise_targets"])
def test_a_line_says_what_is_missing(name):
    code = f"import sys; sys.modules['sb3_contrib'] = None; sys.path.insert(0, {str(EXAMPLES)!r}); import {name}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("this needs the extra 'learn' (")
    assert line.endswith("pip install -e '.[learn]' -c constraints.txt")
