"""Command lines as nobody would write them: a line that says what is wrong, never a traceback.

`CAREGIVER_FUZZ=10000 pytest tests/test_fuzz.py` tries so many in all instead of 40.
"""

import contextlib
import io
import os
import shutil

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from caregiver_mj import cli

ALL = int(os.environ.get("CAREGIVER_FUZZ", "40"))
TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######\n"


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
    folder = tmp_path_factory.mktemp("fuzz")
    (folder / "EMPTY").mkdir()
    (folder / "FILE").write_text("text")
    (folder / "TINY").write_text(TEXT)
    argv = ["evaluate", "--world", "grid", "--house", folder / "TINY", "--epsilon", "1", "--episodes", "2"]
    assert status([*argv, "--caregiver", "none", "guard", "--out", folder / "RUN"]) == 0
    return folder


@settings(max_examples=ALL, deadline=None, suppress_health_check=[HealthCheck.too_slow])
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
