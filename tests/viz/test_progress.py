"""The progress bar in a terminal and in notebooks."""

import builtins
import os
import subprocess
import sys
import warnings

import pytest

from caregiver_mj.viz import progress_bar

LINES = [f"episodes {done}/20" for done in range(2, 20, 2)]  # a line for each tenth, and then the bar
WORK = """
from caregiver_mj.viz import progress_bar
with progress_bar() as bar:
    task = bar.add_task("episodes", total=20)
    for _ in range(20):
        bar.advance(task)
"""


def work(quiet=False):
    with progress_bar(quiet) as bar:
        task = bar.add_task("episodes", total=20)
        for _ in range(20):
            bar.advance(task)


class ZMQInteractiveShell:
    """What a notebook's kernel has as its shell."""


@pytest.mark.parametrize("quiet", [False, True])
def test_in_a_kernel(capsys, monkeypatch, quiet):
    monkeypatch.setattr(builtins, "get_ipython", ZMQInteractiveShell, raising=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # as of rich, which asks for ipywidgets
        work(quiet)
    out, err = capsys.readouterr()
    assert out == ""
    *lines, last = err.splitlines() or [""]
    assert lines == ([] if quiet else LINES)
    assert ("20/20" in last) != quiet
    assert "\x1b" not in err


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize("notebook", [False, True])
def test_a_command_in_a_cell_which_has_a_terminal(monkeypatch, notebook):
    import pty

    monkeypatch.setenv("TERM", "xterm-color")
    monkeypatch.delenv("JPY_PARENT_PID", raising=False)
    if notebook:
        monkeypatch.setenv("JPY_PARENT_PID", "1")
    ours, theirs = pty.openpty()
    subprocess.run([sys.executable, "-c", WORK], stdout=theirs, stderr=theirs, check=True)
    os.close(theirs)
    shown = os.read(ours, 100_000).decode()
    os.close(ours)
    assert ("\x1b" in shown) != notebook  # it is written over in a terminal, and cannot be here
    assert (shown.splitlines()[:-1] == LINES) == notebook
    assert "20/20" in shown
