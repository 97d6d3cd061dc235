"""The command line: every bad input is exit status 2 and one line that says what and where."""

import json
import os
import re
import shlex
import subprocess
import sys

import pytest

from caregiver_mj import FloorPlan, cli
from caregiver_mj.viz.report import read_run

GRID = ["evaluate", "--world", "grid"]
RECORD = ["record", "--out", "set", "--format"]
CLUSTER = [*GRID, "--out", "run", "--executor", "dask"]
PLAN = """\
#####
#B.S#
#...#
#C.T#
#####
"""


def fails(capsys, argv):
    """Runs the command, which must refuse its input; returns its one line, without a floor plan's line below it."""
    assert cli.main([str(a) for a in argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("caregiver-mj: ")
    assert err.endswith("\n")
    message, *excerpt = err.splitlines(keepends=True)
    assert len(excerpt) in (0, 2)
    assert all(re.match(r"  +(\d+ )?\| ", line) for line in excerpt)
    return message


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["fly"], ["fly"]),
        ([*GRID, "--wrong"], ["--wrong"]),
        ([*GRID, "--epsilon", "1,half"], ["--epsilon", "1,half"]),
        ([*GRID, "--epsilon", "1,.5,.25", "--children", "2"], ["1,.5,.25", "3 children", "2", "--children"]),
        ([*GRID, "--children", "0"], ["--children", "0"]),
        ([*GRID, "--epsilon", ",".join(["1"] * 101)], ["children must be at most 100, got 101"]),
        ([*GRID, "--house", "apartment", "--houses", "test-2"], ["--houses: not allowed with argument --house"]),
        ([*GRID, "--episodes", "99999999999999"], ["999,999,999,999,990", "10,000,000"]),
        ([*GRID, "--caregiver", "nanny"], ["nanny", "none", "paper"]),
        ([*GRID, "--resume"], ["--resume", "--out"]),
        (["render", "--out", "film.avi"], ["film.avi", ".mp4", ".gif"]),
        (["render", "--out", f"{'x' * 300}.mp4"], ["cannot be written", "too long"]),
        (["render", "--out", "film.mp4", "--child", "adversary:0"], ["a name alone", "use --epsilon adversary:0"]),
        (["render", "--out", "film.mp4", "--overlay", "rain"], ["--overlay", "rain", "danger"]),
        ([*GRID, "--frames"], ["--frames requires", "http://ADDRESS or chat:MODEL", "got none expected-danger"]),
        ([*GRID, "--caregiver", "http://127.0.0.1:9", "--base-url", "http://127.0.0.1:9/v1"], ["requires", "chat:"]),
        (["render", "--out", "film.mp4", "--patience", "5"], ["--patience requires", "got expected-danger"]),
        (["view", "--caregiver", "none", "--thinking", "real-time"], ["--thinking requires", "got none"]),
        (["record", "--format", "minari", "--out", "sets", "--max-tokens", "5"], ["--max-tokens requires"]),
        (["compare", "a"], ["required: SECOND"]),
        (["house", "show", "two\nlines"], ["two lines"]),
        (["paper", "--episodes", "0"], ["at least 1, got 0"]),
        (["house", "make", "--size", "10"], ["--size", "14x12", "'10'"]),
        (["house", "make", "--size", "8x8", "--rooms", "12"], ["house-0-8x8-rooms12", "rooms 12", "8 x 8"]),
        ([*RECORD, "lerobot", "--task", "targets", "--world", "grid"], ["--format must be minari with --task targets"]),
        ([*RECORD, "minari", "--name", "x/y-v0"], ["(two or more in a group), got 'x/y-v0'"]),
        ([*RECORD, "lerobot", "--name", "a-v0"], ["--name must be left out with --format lerobot"]),
        ([*RECORD, "lerobot", "--camera", "hall"], ["no camera 'hall'"]),
        ([*RECORD, "lerobot", "--size", "33x40"], ["must be even"]),
        ([*RECORD, "lerobot", "--episodes", "99999999999999"], ["episodes must be an integer from 1 to 1000000"]),
        ([*RECORD, "minari", "--world", "grid", "--task", "targets", "--embodiment", "butler"], ["no robot 'butler'"]),
        ([*RECORD, "minari", "--out", ""], ["--out must be a folder, got an empty name"]),
        ([*RECORD, "lerobot", "--caregiver", "person"], ["requires --answers DIR"]),
        (["view", "--caregiver", "person", "--sight", "walls"], ["sight must be all with a person"]),
        (["view", "--caregiver", "person", "--out", "run", "--episode", "2"], ["--out requires --caregiver person"]),
        (["view", "--out", "run"], ["--out requires --caregiver person or driver"]),
        ([*GRID, "--caregiver", "none", "person", "--out", "run"], ["acts by itself: a person plays"]),
        (["render", "--caregiver", "person", "--out", "film.mp4"], ["acts by itself: a person plays"]),
        ([*GRID, "--out", "run", "--scheduler", "tcp://127.0.0.1:9"], ["--scheduler requires --executor dask"]),
        (CLUSTER, ["--executor dask requires --scheduler ADDRESS"]),
        ([*CLUSTER, "--scheduler", "tcp://127.0.0.1:9", "--jobs", "2"], ["--jobs must be left out with --executor"]),
        ([*CLUSTER, "--scheduler", "no-scheme://x:1"], ["no scheduler at 'no-scheme://x:1': "]),
    ],
)
def test_bad_arguments_are_refused_and_leave_nothing(capsys, tmp_path, monkeypatch, argv, words):
    monkeypatch.chdir(tmp_path)
    message = fails(capsys, argv)
    assert not [*tmp_path.iterdir()]
    for word in words:
        assert word in message


@pytest.mark.parametrize("side", [3_000, 200])
def test_a_plan_of_too_many_cells(capsys, tmp_path, side):
    (tmp_path / "huge.txt").write_text("\n".join(["#" * side] * side))
    assert "must have at most 10,000 cells, got" in fails(capsys, ["house", "check", tmp_path / "huge.txt"])


def test_files_of_odd_bytes(capsys, tmp_path):
    (tmp_path / "marked.txt").write_bytes(b"\xef\xbb\xbf" + PLAN.replace("\n", "\r\n").encode())
    assert cli.main(["house", "check", str(tmp_path / "marked.txt")]) == 0
    assert capsys.readouterr().out.startswith("OK: marked, 5 x 5 cells")
    assert "not a regular file" in fails(capsys, ["house", "check", "/dev/zero"])
    (tmp_path / "noise.txt").write_bytes(b"\xff\xfe\x00")
    assert "noise.txt" in fails(capsys, ["house", "check", tmp_path / "noise.txt"])
    assert str(tmp_path) in fails(capsys, ["house", "check", tmp_path])


@pytest.mark.parametrize("below", ["", "/run"])
def test_output_that_cannot_be_written(capsys, tmp_path, below):
    # Also where the tests run as root, who may write anywhere, there is no folder below or at a regular file.
    (tmp_path / "file").touch()
    folder = f"{tmp_path}/file{below}"
    assert folder in fails(capsys, [*GRID, "--out", folder])
    assert folder in fails(capsys, ["render", "--out", f"{folder}/film.mp4"])


def test_table_and_json(capsys):
    argv = [*GRID, "--episodes", "3", "--epsilon", "1", "0.5"]
    assert cli.main([*argv, "--json"]) == 0
    out, err = capsys.readouterr()
    rows = json.loads(out, parse_constant=pytest.fail)["rows"]  # NaN is no JSON
    names = ("none", "expected-danger")
    assert [(row["epsilon"], row["caregiver"]) for row in rows] == [(e, name) for e in (1.0, 0.5) for name in names]
    assert "normalised" in err  # the table beside it
    assert cli.main(argv) == 0
    none, paper = (line.split() for line in capsys.readouterr().out.splitlines() if line.split()[:1] == ["1"])
    assert (none[1], paper[1]) == names
    assert none[6] == "1.00"  # left: epsilon, name, mean, ±, sd, normalised, left
    assert float(paper[6]) == pytest.approx(float(paper[2]) / float(none[2]), abs=0.01)


def test_damage_is_what_was_asked_for(capsys, tmp_path):
    argv = [*GRID, "--caregiver", "none", "--episodes", "3", "--epsilon", "1", "--json"]
    means = []
    for damage in ("5:4:1", "10:8:2", "0:0:0"):
        folder = tmp_path / damage.replace(":", "_")
        assert cli.main([*argv, "--damage", damage, "--out", str(folder)]) == 0
        means.append(json.loads(capsys.readouterr().out)["rows"][0]["damage_mean"])
        assert json.loads((folder / "run.json").read_text())["damage"] == damage
    assert means[0] > 0
    assert means == [means[0], 2 * means[0], 0]
    message = fails(capsys, [*argv, "--damage", "1:1:1", "--out", tmp_path / "5_4_1", "--resume"])
    assert "damage is 5:4:1 there and 1:1:1 here" in message


def test_a_house_is_made_again_from_its_seed_its_name_and_its_file(capsys, tmp_path):
    assert cli.main(["house", "make", "--seed", "17"]) == 0
    text = capsys.readouterr().out
    assert text == f"{FloorPlan.load('house-17').text}\n"
    file = tmp_path / "ours.txt"
    assert cli.main(["house", "make", "--seed", "17", "--out", str(file)]) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert file.read_text() == text
    assert cli.main(["house", "check", str(file)]) == 0
    assert capsys.readouterr().out.startswith("OK: ours, ")


def test_as_a_process(tmp_path):
    # No library that is imported on the way has anything to add, least of all about a missing display.
    command = [sys.executable, "-m", "caregiver_mj", *GRID, "--episodes", "0"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr == "caregiver-mj: episodes must be an integer of at least 1, got 0\n"


def test_a_full_disk_below_standard_output():
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}  # that is -u
    with open("/dev/full", "w") as full:
        options = {"stdout": full, "stderr": subprocess.PIPE, "text": True, "check": False}
        run = subprocess.run(
            [sys.executable, "-m", "caregiver_mj", *GRID, "--episodes", "1", "--epsilon", "1"],
            env=environment,
            **options,
        )
    assert run.returncode == 1
    assert run.stderr.splitlines()[-1] == "caregiver-mj: the output cannot be written: No space left on device"
    assert "Traceback" not in run.stderr


def test_too_few_files_for_worker_processes():
    command = f"ulimit -n 14; {shlex.quote(sys.executable)} -m caregiver_mj evaluate --world grid --epsilon 1 --jobs 2"
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "Traceback" not in run.stderr
    assert "no worker process can be started: Too many open files" in run.stderr.splitlines()[-1]


def test_houses_whose_names_have_spaces(capsys, tmp_path):
    files = [tmp_path / "our house.txt", tmp_path / "it's theirs.txt"]
    for file in files:
        file.write_text(PLAN)
    argv = [*GRID, "--houses", *map(str, files), "--epsilon", "1", "--episodes", "2", "--out", str(tmp_path / "a run")]
    assert cli.main(argv) == 0
    again = shlex.split(read_run(tmp_path / "a run").command())
    assert again[again.index("--houses") + 1 :][:2] == [str(file) for file in files]
    assert cli.main([*again[1:], "--out", str(tmp_path / "a run"), "--resume"]) == 0


def test_the_papers_tables_beside_ours(capsys):
    which = ["--episodes", "4", "--seed", "3", "--json"]
    assert cli.main(["paper", *which]) == 0
    out, err = capsys.readouterr()
    tables = json.loads(out, parse_constant=pytest.fail)  # NaN is no JSON
    assert cli.main(["evaluate", "--world", "grid", "--house", "paper", *which]) == 0
    summary = json.loads(capsys.readouterr().out)
    damage, timesteps = ({(r["epsilon"], r["quantity"]): r for r in rows} for rows in tables.values())
    # Of five novices: damage without, with, and the share that is left; timesteps without and with.
    assert (len(damage), len(timesteps)) == (15, 10)
    rows = {(row["family"], {"none": "without"}.get(row["caregiver"], "with")): row for row in summary["rows"]}
    for found, column in ((damage, "damage_normalised"), (timesteps, "timesteps_to_threshold")):
        for key, row in rows.items():
            assert found[key]["here"] == row[f"{column}_mean"]
            assert [found[key]["low"], found[key]["high"]] == [row[f"{column}_ci_low"], row[f"{column}_ci_high"]]
    assert damage["0.5", "with"]["paper"] == 0.1106  # as printed in its Table I
    assert damage["0.5", "left"]["paper"] == pytest.approx(0.3886, abs=1e-4)  # 0.1106 / 0.2846
    assert timesteps["0.75", "without"]["paper"] == 41.05  # Table II
    for row in (*damage.values(), *timesteps.values()):
        assert row["deviation"] == pytest.approx(row["here"] - row["paper"])
    assert damage["1", "left"]["here"] == pytest.approx(damage["1", "with"]["here"] / damage["1", "without"]["here"])
    printed = [line.split() for line in err.splitlines()]  # the tables beside it
    assert [line[-2] for line in printed if line[:2] == ["0.5", "with"]] == ["0.111", "171.5"]
    assert "It is the one of many plans that came closest" in err
