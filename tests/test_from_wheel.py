"""Each thing that a new user does, from the installed wheel, in an empty folder, with what the documentation says.

`scripts/from_wheel.py` has them done in an environment into which pip has put the wheel and nothing of the checkout,
and says with `CAREGIVER_PYTHON` where that is. Without it they are left out: they take a minute.
"""

import os
import pathlib
import re
import subprocess

import pytest
from wheels import ROOT

ALL = [ROOT / "README.md", *ROOT.glob("docs/**/*.md")]
PAGES = sorted(path for path in ALL if "```python" in path.read_text("utf-8"))
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)
FILE = re.compile(r"# (\w+\.py)\n")  # in the first line of a block: the file that it is of
TINY = "######\n#B.S.#\n#....#\n#C..T#\n######\n"
GRID = ["--world", "grid", "--house", "tiny.txt", "--epsilon", "1", "--episodes", "3"]
INTERPRETER = os.environ.get("CAREGIVER_PYTHON")
pytestmark = pytest.mark.skipif(not INTERPRETER, reason="scripts/from_wheel.py does these")


@pytest.fixture
def python():
    return pathlib.Path(INTERPRETER)


@pytest.fixture(autouse=True)
def _home(tmp_path, monkeypatch):
    """An empty folder, but for a house and for the files that the documentation has."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    pathlib.Path("tiny.txt").write_text(TINY)
    for page in PAGES:
        for block in BLOCK.findall(page.read_text("utf-8")):
            if file := FILE.match(block):
                pathlib.Path(file[1]).write_text(block)


def done(command, **variables):
    """Runs a command, which must go well and without warnings; what it has printed."""
    found = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
    assert not re.search("Traceback|Warning", found.stderr), found.stderr
    return found.stdout


@pytest.fixture
def ours(python):
    return lambda *words: done([python.parent / "caregiver-mj", *words])


def test_it_is_the_wheel(python, tmp_path):
    code = "import caregiver_mj, caregiver_mj.tasks, caregiver_mj.models as m; print(caregiver_mj.__file__, m.__file__)"
    for file in done([python, "-c", code]).split():
        assert pathlib.Path(file).is_relative_to(python.parents[1])
    code = "import importlib.util as u; print([u.find_spec(n) for n in ('tasks', 'models', 'tests', 'scripts')])"
    assert done([python, "-I", "-c", code]) == f"{[None] * 4}\n"


def test_import_brings_nothing_that_takes_long(python):
    code = "import sys, caregiver_mj; print({'mujoco', 'OpenGL', 'dm_control', 'scipy'} & sys.modules.keys())"
    assert done([python, "-c", code]) == "set()\n"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_page(python, page):
    blocks = [block for block in BLOCK.findall(page.read_text("utf-8")) if not FILE.match(block)]
    pathlib.Path("page.py").write_text("\n".join(blocks))
    done([python, "page.py"])


def test_policies_of_ones_own_are_evaluated_compared_and_reported(ours):
    mine = "my_policies:NearestToMe"
    assert mine in ours("evaluate", *GRID, "--caregiver", "none", "paper", mine, "--out", "runs/mine")
    ours("evaluate", *GRID, "--caregiver", "none", "--jobs", "2", "--out", "runs/none")
    ours("evaluate", *GRID, "--caregiver", "none", "paper", mine, "--seed", "1", "--out", "runs/more")
    assert mine in ours("compare", "runs/mine", "runs/mine", "--caregiver", "paper", mine)
    assert "+0.00" in ours("compare", "runs/mine", "runs/none")
    assert "6 episodes a row, seeds 0, 1" in ours("pool", "runs/mine", "runs/more", "--out", "runs/both")
    assert ours("report", "runs/mine") == "runs/mine/report.html\n"
    assert mine in pathlib.Path("runs/mine/report.html").read_text("utf-8")
    told = ours("evaluate", *GRID[2:4], "--epsilon", "1", "--episodes", "1", "--caregiver", "my_policies:roundabout")
    rows = [line for line in told.splitlines() if line.split()[:2] == ["1", "my_policies:roundabout"]]
    assert len(rows) == 1  # the verdicts on harm name it, too


def test_film(ours, python):
    ours("render", "--caregiver", "my_policies:roundabout", "--seconds", ".2", "--out", "film.mp4", "--still", "a.png")
    code = "import imageio.v3 as iio; print(iio.imread('film.mp4').shape, iio.imread('a.png').std() > 10)"
    assert done([python, "-c", code]) == "(6, 720, 1280, 3) True\n"
