"""The table in a terminal: whole words and numbers, whatever the width."""

import io

import pytest
import rich.console
from made_runs import write_run

from caregiver_mj.cli.runs import print_table
from caregiver_mj.viz import report

COLUMNS = ["damage", "normalised", "left", "timesteps", "cells", "toys", "blocked", "done"]


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    summary = dict(report.read_run(write_run(tmp_path_factory.mktemp("run"))).summary, seed=0)
    for row in [*summary["rows"], *summary["comparisons"]]:
        row["caregiver"] = row["caregiver"].replace("guard", "a-policy-of-ours")  # as long as any name
    return summary


def printed(summary, width, encoding="utf-8"):
    stream = io.TextIOWrapper(io.BytesIO(), encoding)
    print_table(summary, rich.console.Console(file=stream, width=width))
    stream.flush()
    return stream.buffer.getvalue().decode(encoding)


@pytest.mark.parametrize(("width", "head", "gone"), [
    (80, ["damage", "norm.", "left", "steps", "cells", "toys", "block.", "done"], []),
    (60, ["damage", "norm.", "left", "steps"], COLUMNS[4:]),
])  # fmt: skip
def test_nothing_is_cut_short(summary, width, head, gone):
    text = printed(summary, width)
    assert "…" not in text
    lines = [line.split() for line in text.splitlines()]
    assert ["epsilon", "caregiver", *head] in lines
    assert any(line[:5] == ["1", "a-policy-of-ours", "49.1", "±", "7.4"] for line in lines)
    assert ("no room for" in " ".join(text.split())) == bool(gone)
    assert " ".join(text.split()).endswith(", ".join(gone))
    assert max(map(len, text.splitlines())) <= width
    assert "49.1 +- 7.4" in printed(summary, width, "ascii")
