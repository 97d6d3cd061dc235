"""MuJoCo's own viewer, where there can be a window."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import ImageGrab

PATIENCE = 90  # seconds
SIZE = "640x480x24"  # of the display


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


def test_the_window(display, house):
    command = [sys.executable, "-m", "caregiver_mj", "view", "--house", house, "--caregiver", "none"]
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
    assert (process.returncode, out) == (0, "")
    prepares = f"preparing house {house}, children 0.5, caregiver none, for a window ..."
    assert err.splitlines() == [prepares, "closed"]


def colours(display):
    """How many colours the display shows."""
    picture = np.asarray(ImageGrab.grab(xdisplay=display).convert("RGB"))
    return len(np.unique(picture.reshape(-1, 3), axis=0))
