"""MuJoCo's own viewer: what stands in the window's corner, and the window itself where there can be one."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import ImageGrab
from test_hud import PLAN, state
from test_session import Clock, Reel

from caregiver_mj.viz.viewers.session import Session, Watched
from caregiver_mj.viz.viewers.window import texts

PATIENCE = 90  # seconds
SIZE = "640x480x24"  # of the display


@pytest.fixture
def session():
    return Session(Watched(), begin=lambda watched: Reel(), clock=Clock())


def rows(shown, session):
    names, values = (column.split("\n") for column in texts(shown, session))
    assert len(names) == len(values)
    return dict(zip(names, values, strict=True))


def test_what_stands_in_the_corner(session):
    shown = rows(state(damage=5.0, danger=np.array([0.0, 0.5, 2.0]), target=2), session)
    assert (shown["caregiver"], shown["timestep"]) == ("carry candle 2 to table 1", "50")
    assert shown["damage"] == "5"
    assert shown["P(safe)"].startswith("0.50 ||")
    bars = [shown[str(hazard)] for hazard in PLAN.hazards]
    assert bars[0] == "0.00 "
    assert bars[2].count("|") == 4 * bars[1].count("|") > 0  # the greatest fills its bar
    assert [bar.endswith("<") for bar in bars] == [False, False, True]
    session.pause()
    assert rows(state(), session)["speed"] == "paused"


@pytest.fixture
def display():
    """A display that nobody sees."""
    program = shutil.which("Xvfb")
    if not program:
        pytest.skip("there is no Xvfb here: apt-get install xvfb")
    read, write = os.pipe()
    command = [program, "-displayfd", str(write), "-screen", "0", SIZE]
    with subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL) as server:
        os.close(write)
        with os.fdopen(read) as number:
            name = number.readline().strip()
        yield f":{name}"
        server.terminate()


def test_the_window(display, tmp_path):
    house = tmp_path / "small.txt"
    house.write_text("########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########")
    command = [sys.executable, "-m", "caregiver_mj", "view", "--house", str(house), "--caregiver", "none"]
    environment = os.environ | {"DISPLAY": display}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and process.poll() is None and colours(display) < 500:
            time.sleep(0.5)
        seen = colours(display)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=PATIENCE)
    if "GLX" in err or "GL context" in err:
        pytest.skip(f"the display has no OpenGL: {err}")
    assert seen >= 500
    assert (process.returncode, out, err) == (0, "", "closed\n")


def colours(display):
    """How many colours the display shows."""
    picture = np.asarray(ImageGrab.grab(xdisplay=display).convert("RGB"))
    return len(np.unique(picture.reshape(-1, 3), axis=0))
