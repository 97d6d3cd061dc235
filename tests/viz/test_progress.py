"""The progress bar in a terminal and in notebooks."""

import builtins
import warnings

import pytest

from caregiver_mj.viz import progress_bar

LINES = [f"episodes {done}/20" for done in range(2, 20, 2)]  # a line for each tenth, and then the bar


class ZMQInteractiveShell:
    """What a notebook's kernel has as its shell."""


@pytest.mark.parametrize("quiet", [False, True])
def test_in_a_kernel(capsys, monkeypatch, quiet):
    monkeypatch.setattr(builtins, "get_ipython", ZMQInteractiveShell, raising=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # as of rich, which asks for ipywidgets
        with progress_bar(quiet) as bar:
            task = bar.add_task("episodes", total=20)
            for _ in range(20):
                bar.advance(task)
    out, err = capsys.readouterr()
    assert out == ""
    *lines, last = err.splitlines() or [""]
    assert lines == ([] if quiet else LINES)
    assert ("20/20" in last) != quiet
    assert "\x1b" not in err
