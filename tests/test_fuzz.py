"""Plans, command lines and run folders as nobody would write them: a line that says what is wrong, never a traceback.

`CAREGIVER_FUZZ=10000 pytest tests/test_fuzz.py` tries so many in all instead of 120.
"""

import contextlib
import io
import os
import pathlib
import shutil
import tempfile

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from caregiver_mj import cli
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan

ALL = int(os.environ.get("CAREGIVER_FUZZ", "120"))
TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######\n"


def fuzz(share):
    """Tries a share of all examples."""
    slow = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
    return settings(max_examples=max(1, round(share * ALL)), deadline=None, suppress_health_check=slow)


def status(argv):
    """The exit status of the command, which must not print a traceback, and must say what is wrong if anything is."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            found = cli.main([str(part) for part in argv])
        except SystemExit as stop:  # as of --help
            found = stop.code
    text = err.getvalue()
    assert found in (0, 1, 2)
    assert "Traceback" not in text
    if found:
        (*_, last) = (line for line in text.splitlines() if not line.startswith("  "))  # below it, a plan's line
        assert last.startswith("caregiver-mj: ")
        assert len(last) > len("caregiver-mj: ")
    if found == 2:
        assert out.getvalue() == ""
    return found


# -- Floor plans -------------------------------------------------------------------------------------


@st.composite
def plan_texts(draw):
    """A plan with some characters changed, or any text, or any bytes."""
    if draw(st.integers(0, 4)) == 0:
        return draw(st.one_of(st.binary(max_size=60), st.text(max_size=60).map(lambda t: t.encode("utf-8", "replace"))))
    text = list(draw(st.sampled_from([TEXT, "###\n#B#\n###\n"])))
    for _ in range(draw(st.integers(0, 6))):
        place = draw(st.integers(0, len(text) - 1)) if text else 0
        text[place : place + draw(st.integers(0, 2))] = draw(st.text("#.SCTBX \n\r\t\0é", max_size=2))
    return "".join(text).encode()


@fuzz(1 / 3)
@given(plan_texts())
def test_plans(content):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "any.txt"
        file.write_bytes(content)
        found = status(["house", "check", file])
        if found == 0:
            assert status(["house", "show", file]) == 0
            plan = FloorPlan.load(file)
            assert FloorPlan.parse(plan.text).rows == plan.rows
            stream = RandomStream.draw_group(np.random.RandomState(0), 1, timesteps=30)
            assert GridWorld(plan, 1.0, None).run([stream]).timestep == 30
        else:
            with pytest.raises(CaregiverError):
                FloorPlan.load(file)


# -- Command lines -----------------------------------------------------------------------------------

ODD = ["", " ", "-1", "0", "1", "1e3", "nan", "inf", "-0", "9" * 30, "0x10", "é", "\0", "a\nb", ":", "a:b", "a:", ","]
ODD += ["1,", "*", "--", "-", "~", "/", "/dev/null", "..", "%s", "{}", "none", "True", "²", "٣", "1_0", "\ud800"]
VALUES = {
    "--world": ["grid", "mars"],  # the house takes seconds an episode
    "--house": ["paper", "house-3", "house-3-8x8", "train-3/1", "train-3/9", "house-", "test-1/0/0", "house-1-2x2"],
    "--houses": ["test-2", "test-0", "test-1001", "train-", "paper"],
    "--caregiver": ["guard", "nearest", "floor", "none", "json:loads", "json:dumps.x", "os.path:join", "json", "a.b:c"],
    "--epsilon": ["1", ".5,1", "expert:1", "adversary:0,1", "1:1", "novice:", "-0", "1e-9", "2"],
    "--children": ["1", "2", "1.5"],
    "--child": ["seeker", "angel"],
    "--damage": ["5:4:1", "1:1", "0:0:0", "1e308:1e308:1e308", "-1:0:0", "a:b:c", "1:2:3:4"],
    "--embodiment": ["mobile_fr3", "butler"],
    "--episodes": ["1", "2", "1e9", "10000001"],
    "--seed": ["3", "99999999999999999999"],
    "--jobs": ["1", "x"],
    "--resume": [None],
    "--json": [None],
    "--task": ["supervise", "fly"],
    "--seconds": ["0", "-1", "x"],
    "--overlay": ["danger", "rain"],
    "--size": ["8x8", "9x7", "3x3", "x", "8x", "8x8x8", "-8x8"],
    "--rooms": ["1", "2", "40"],
    "--bins": ["1", "2"],
    "--stairwells": ["0", "1"],
    "--candles": ["0", "1"],
    "--tables": ["1"],
    "--format": ["lerobot", "csv"],
    "--camera": ["wrist", "hall"],
    "--port": ["0", "65536"],
}
_SAFE = {option: VALUES[option] for option in ("--jobs", "--size", "--world")}  # no odd one that is large


@st.composite
def lines(draw):  # noqa: C901 a branch for each option
    """A command with options that belong to it or do not."""
    folders = st.sampled_from(["RUN", "NOWHERE", "EMPTY", "FILE", "", "\0"])
    commands = ["evaluate", "render", "view", "record", "house", "report", "compare", "pool", "completion", "fly", ""]
    command = draw(st.sampled_from(["evaluate", *commands]))
    argv = [command]
    if command == "evaluate":  # so that a run is short unless it is refused
        argv += ["--world", "grid", "--house", "TINY", "--epsilon", "1", "--caregiver", "none", "--episodes", "1"]
    if command == "render":
        argv += ["--out", draw(st.sampled_from(["film.avi", "EMPTY", "FILE/film.mp4"])), "--seconds", "1"]
    if command == "record":
        argv += ["--format", "minari", "--task", "targets", "--world", "grid", "--house", "TINY", "--episodes", "1"]
    if command == "completion":
        argv += draw(st.lists(st.sampled_from(["bash", "zsh", *ODD]), max_size=2))
    if command == "house":
        argv += [draw(st.sampled_from(["make", "show", "check", "sell"]))]
        argv += draw(st.lists(st.sampled_from([*ODD, "paper", "house-5", "FILE"]), max_size=2))
    if command in ("compare", "pool"):
        argv += draw(st.lists(folders, max_size=3))
    if command == "report":
        argv += draw(st.lists(folders.filter(lambda folder: folder != "RUN"), max_size=2))
    for option in draw(st.lists(st.sampled_from(list(VALUES)), max_size=4)):
        values = _SAFE.get(option) or [*VALUES[option], *VALUES[option], *ODD]
        chosen = draw(st.lists(st.sampled_from(values), min_size=1, max_size=2))
        argv += [option, *(value for value in chosen if value is not None)]
    if draw(st.booleans()) and command in ("evaluate", "pool"):
        argv += ["--out", draw(folders.filter(lambda folder: folder != "RUN"))]
    if command == "record":
        argv += ["--out", "FILE"]  # refused after all else that is said, and so is
    if command == "view":
        argv += ["--rate", "0"]
    return argv


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A finished run, an empty folder, a file and a house."""
    folder = tmp_path_factory.mktemp("fuzz")
    (folder / "EMPTY").mkdir()
    (folder / "FILE").write_text("text")
    (folder / "TINY").write_text(TEXT)
    argv = ["evaluate", "--world", "grid", "--house", folder / "TINY", "--epsilon", "1", "--episodes", "2"]
    assert status([*argv, "--caregiver", "none", "guard", "--out", folder / "RUN"]) == 0
    return folder


@fuzz(1 / 3)
@given(lines())
@example(["evaluate", "--out", "\0"])
def test_command_lines(run, argv):
    places = {name: str(run / name) for name in ("RUN", "NOWHERE", "EMPTY", "FILE", "TINY", "FILE/film.mp4")}
    try:
        status([places.get(part, part) for part in argv])
    finally:
        shutil.rmtree(run / "NOWHERE", ignore_errors=True)
        shutil.rmtree(run / "EMPTY")
        (run / "EMPTY").mkdir()


# -- Run folders -------------------------------------------------------------------------------------
