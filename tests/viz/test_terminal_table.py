"""The table in a terminal: whole words and numbers, whatever the width."""

import io

import pytest
import rich.console
from made_runs import write_run

from caregiver_mj.cli.runs import output, print_table
from caregiver_mj.viz import report

COLUMNS = ["damage", "normalised", "left", "score", "timesteps", "cells", "toys", "blocked", "done"]
SHORT = ["damage", "norm", "left", "score", "steps", "cells", "toys", "block", "done"]


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


@pytest.mark.parametrize(("width", "heads"), [
    (120, [COLUMNS]),
    (80, [SHORT]),
    (60, [SHORT[:5], SHORT[5:]]),
    (42, [SHORT[:2], SHORT[2:5], SHORT[5:8], SHORT[8:]]),
])  # fmt: skip
def test_no_column_is_left_out_and_nothing_is_cut_short(summary, width, heads):
    text = printed(summary, width)
    assert "…" not in text
    lines = [line.split() for line in text.splitlines()]
    assert [line[2:] for line in lines if line[:2] == ["epsilon", "caregiver"]] == heads
    assert any(line[:5] == ["1", "a-policy-of-ours", "49.1", "±", "7.4"] for line in lines)
    # Every part has the rows of both children.
    assert len([line for line in lines if line[1:2] == ["a-policy-of-ours"]]) == 2 * len(heads)
    assert max(map(len, text.splitlines())) <= width
    assert "49.1 +- 7.4" in printed(summary, width, "ascii")


def test_a_legend_below_says_what_the_columns_are(summary):
    *_, legend = printed(summary, 1000).splitlines()
    assert all(column in legend for column in COLUMNS)


@pytest.mark.parametrize("columns", ["40", "200"])
def test_a_pipe_has_all_columns_and_a_legend_of_one_line(summary, capsys, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)  # of the terminal, which is not what is written to
    print_table(summary, output(aside=False))
    *lines, legend = capsys.readouterr().out.splitlines()
    assert ["epsilon", "caregiver", *COLUMNS] in [line.split() for line in lines]
    assert all(column in legend for column in COLUMNS)
