"""Files from strangers, with checksums that fit: nothing that they name is run or asked, and they cost little.

`CAREGIVER_FUZZ=500 pytest -m slow tests/test_strangers.py -s` prints what came of so many mutations a reader.
"""

import base64
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pandas as pd
import pytest
from submissions import parts_of, run, write

from caregiver_mj import cli

COUNT = int(os.environ.get("CAREGIVER_FUZZ", "20"))
TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######\n"


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """A run, its submission, and a run of the next seed."""
    folder = tmp_path_factory.mktemp("strangers")
    (folder / "tiny.txt").write_text(TEXT)
    argv = ["evaluate", "--world", "grid", "--house", folder / "tiny.txt", "--epsilon", 1, "--episodes", 2]
    assert not run(*argv, "--caregiver", "none", "nearest", "--out", folder / "run")
    assert not run(*argv, "--caregiver", "none", "nearest", "--seed", 1, "--out", folder / "other")
    assert not run("submit", folder / "run", "--out", folder / "a.submission")
    return folder


@pytest.fixture(scope="module")
def acted(given):
    """A run of the robot in MuJoCo, whose answers can be given again."""
    argv = ["evaluate", "--world", "house", "--house", given / "tiny.txt", "--epsilon", 1, "--episodes", 1]
    assert not run(*argv, "--caregiver", "nearest", "--out", given / "acted")


NONE, NEAREST = "episodes/000000.json", "episodes/000001.json"


def renamed(parts, old, new):
    """A run of another caregiver, with its rows."""
    parts["run.json"]["caregivers"] = [new if name == old else name for name in parts["run.json"]["caregivers"]]
    for name in (NONE, NEAREST):
        for row in parts[name]["rows"]:
            row["caregiver"] = new if row["caregiver"] == old else row["caregiver"]


def with_family(family):
    def edit(parts):
        parts["run.json"]["families"] = [family]
        for name in (NONE, NEAREST):
            parts[name]["maps"] = {family: parts[name]["maps"]["1"]}
            for row in parts[name]["rows"]:
                row["family"] = family

    return edit


def empty(caregiver):
    def edit(parts):
        renamed(parts, "nearest", caregiver)
        parts[NEAREST]["answers"] = ""

    return edit


def bomb(shape, dtype="|u1", size=0):
    def edit(parts):
        header, content = io.BytesIO(), io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"shape": shape, "fortran_order": False, "descr": dtype})
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("decide.npy", header.getvalue() + bytes(size))
        parts[NEAREST]["answers"] = base64.b64encode(content.getvalue()).decode()

    return edit


def _change(file, **values):
    file.write_text(json.dumps(json.loads(file.read_text()) | values))


def _harm(folder, **values):
    (row,) = json.loads((folder / "summary.json").read_text())["harm"]
    _change(folder / "summary.json", harm=[row | values])


def _table(folder, file, **columns):
    pd.read_parquet(folder / file).assign(**columns).to_parquet(folder / file)


def _without(folder, column):
    file = folder / "episodes.parquet"
    pd.read_parquet(file).drop(columns=column).to_parquet(file)


def _rows(folder, which):
    file = folder / "episodes.parquet"
    pd.read_parquet(file).iloc[which].to_parquet(file)


def _twice(folder):
    file = folder / "run.json"
    file.write_text(file.read_text().replace('"seed"', '"seed": 1, "seed"'))


def called(name):
    return lambda parts: parts["run.json"].update(houses=name)


FILES = {
    "a plan named villa": (
        lambda parts: parts["run.json"]["plans"][0].update(name="villa"),
        "house 'villa' must be the package's, got another plan",
    ),
    "a set of another plan": (called("test-1"), "houses 'test-1' must be the package's, got other plans"),
    "a set of more": (called("test-10"), "houses 'test-10' must be the package's, got other plans"),
    "damage of a child that there is not": (
        lambda parts: parts[NEAREST]["rows"][0]["damage_by_child"].append(1.0),
        "must have rows, maps and answers of",
    ),
    "a child is code": (with_family("antigravity:x:1"), "its child must be one of novice"),
    "empty answers of a module": (empty("antigravity:x"), "the answers of 'antigravity:x' must be the text"),
    "empty answers of a server": (empty("http://127.0.0.1:9/steal"), "must be the text of its arrays, got ''"),
    "empty answers of a model": (empty("chat:X"), "must be the text of its arrays, got ''"),
    "answers of nobody": (
        lambda parts: parts[NONE].update(answers=parts[NEAREST]["answers"]),
        "the answers of 'none' must be none",
    ),
    "an array of 100 MB": (bomb((10**8,), size=10**8), "must come to at most 64,000,000 bytes"),
    "rows of nothing": (bomb((10**8, 0)), "at most 10,000,000 numbers"),
    "houses that are a number": (called(5), "houses must be a str, got 5"),
    "a map more": (
        lambda parts: parts[NEAREST]["maps"].update({"0.5": parts[NEAREST]["maps"]["1"]}),
        "must have rows, maps and answers of",
    ),
}


def test_files_of_strangers_are_refused_and_the_others_are_on_the_board(given, tmp_path, capsys):
    (tmp_path / "good.submission").write_bytes((given / "a.submission").read_bytes())
    for what, (edit, _) in FILES.items():
        parts = parts_of(given / "a.submission")
        edit(parts)
        write(tmp_path / f"{what}.submission", parts)
    assert run("leaderboard", tmp_path) == 2
    told = capsys.readouterr()
    assert "| `nearest` |" in told.out
    for what, (_, words) in FILES.items():
        (line,) = (line for line in told.err.splitlines() if f"{what}.submission" in line)
        assert words in line
    assert "antigravity" not in sys.modules


def test_a_robot_is_not_imported_either(given, tmp_path, capsys):
    from caregiver_mj.experiments.provenance import source_digest
    from caregiver_mj.experiments.settings import Settings

    parts = parts_of(given / "a.submission")
    parts["run.json"].update(world="house", embodiment="antigravity:x", source=source_digest("house"))
    with pytest.raises(cli.CaregiverError, match="its robot must be one of mobile_fr3, mobile_ur5e"):
        Settings.of_record(parts["run.json"]).check_installed()


def test_the_robot_of_a_run_in_the_grid_is_not_imported_for_a_film(given, tmp_path, capsys):
    """The film of a report is of the house, whatever world the run is of."""
    folder = shutil.copytree(given / "run", tmp_path / "run")
    _change(folder / "run.json", embodiment="antigravity:x")
    assert run("report", folder, "--render") == 2
    assert "its robot must be one of mobile_fr3, mobile_ur5e" in capsys.readouterr().err
    assert "antigravity" not in sys.modules


def test_names_of_a_run_folder_are_only_shown(given, tmp_path, capsys):
    folder = shutil.copytree(given / "run", tmp_path / "run")
    _change(folder / "run.json", families=["antigravity:x:1"])
    for argv in (
        ["report", folder],
        ["compare", folder, folder],
        ["submit", folder, "--out", tmp_path / "b.submission"],
    ):
        assert run(*argv) == 2
    assert "antigravity" not in sys.modules
    with zipfile.ZipFile(tmp_path / "c.submission", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("sha256.json", bytes(10**8))
    assert run("verify", tmp_path / "c.submission") == 2
    assert "must have at most" in capsys.readouterr().err


def test_workers_import_nothing_from_the_working_folder(given, tmp_path, monkeypatch, capsys):
    (tmp_path / "multiprocessing.py").write_text("import pathlib\npathlib.Path('imported').touch()\n")
    monkeypatch.chdir(tmp_path)
    assert not run("verify", given / "a.submission", "--jobs", 2)
    assert not (tmp_path / "imported").exists()


@pytest.mark.parametrize("command", [["render", "--out", "a.mp4"], ["record", "--format", "minari", "--out", "set"]])
def test_the_answers_of_a_run_take_no_plug_in_from_the_working_folder(given, tmp_path, monkeypatch, capsys, command):
    folder = shutil.copytree(given / "run", tmp_path / "run")
    _change(folder / "run.json", families=["evil:1"])
    for file in ("episodes.parquet", "maps.parquet"):
        _table(folder, file, family="evil:1")
    summary = (folder / "summary.json").read_text()
    (folder / "summary.json").write_text(summary.replace('"family": "1"', '"family": "evil:1"'))
    (tmp_path / "evil-1.0.dist-info").mkdir()
    (tmp_path / "evil-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    (tmp_path / "evil-1.0.dist-info" / "entry_points.txt").write_text("[caregiver_mj.children]\nevil = evil:Evil\n")
    monkeypatch.chdir(tmp_path)
    assert run(*command, "--answers", folder, "--caregiver", "nearest") == 2
    assert "its child must be one of novice" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["report.html", "tables.md", "figures"])
def test_a_report_is_not_written_through_a_link(given, tmp_path, capsys, name):
    folder, outside = shutil.copytree(given / "run", tmp_path / "run"), tmp_path / "outside"
    if name == "figures":
        outside.mkdir()
    else:
        outside.write_text("mine")
    (folder / name).symlink_to(outside)
    assert run("report", folder) == (2 if name == "figures" else 0)
    assert [*outside.iterdir()] == [] if name == "figures" else outside.read_text() == "mine"


@pytest.mark.parametrize("name", ["episodes", ".lock", "exchanges", "exchanges/calls"])
@pytest.mark.parametrize("make", [lambda there, outside: there.symlink_to(outside), lambda there, _: os.mkfifo(there)])
def test_a_run_is_not_resumed_through_a_link(given, tmp_path, capsys, name, make):
    folder, outside = shutil.copytree(given / "run", tmp_path / "run"), tmp_path / "outside"
    outside.mkdir()
    there = folder / name
    if there.is_dir():
        shutil.rmtree(there)
    there.unlink(missing_ok=True)
    there.parent.mkdir(exist_ok=True)
    make(there, outside)
    argv = ["evaluate", "--world", "grid", "--house", given / "tiny.txt", "--epsilon", 1, "--episodes", 3]
    assert run(*argv, "--caregiver", "none", "nearest", "--out", folder, "--resume") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"'{there}' must be a " in line
    assert not [*outside.iterdir()]


def test_what_is_no_file_does_not_hang(given, tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe.submission")
    (tmp_path / "link.submission").symlink_to("/dev/zero")
    assert run("house", "check", tmp_path / "pipe.submission") == 2
    assert run("leaderboard", tmp_path) == 2
    assert capsys.readouterr().err.count("not a regular file") == 3


def test_a_page_shows_text_of_a_stranger_as_text(given, tmp_path, capsys):
    parts = parts_of(given / "a.submission")
    parts["card.json"] = {"title": "![x](http://a/b.png)\x1b[31m\u202e", "authors": "[x](javascript:alert(1))<script>"}
    write(tmp_path / "a.submission", parts)
    assert not run("leaderboard", tmp_path)
    page = capsys.readouterr().out
    for text in ("](", "<script", "\x1b", "\u202e", "http://a"):
        assert text not in page


def test_a_refusal_is_one_short_line(given, tmp_path, capsys):
    parts = parts_of(given / "a.submission")
    parts["run.json"]["houses"] = ["\x1b[31m" * 10**5]
    write(tmp_path / "a.submission", parts)
    assert run("verify", tmp_path / "a.submission") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert len(line) < 1100
    assert line.isprintable()


HOLD = """
import sys
from caregiver_mj.experiments.run_folder import RunFolder
folder = RunFolder(sys.argv[1], {"a": 1}, resume=True)
print("held", flush=True)
sys.stdin.read()
"""


def test_a_second_start_in_a_folder_touches_nothing(tmp_path):
    from caregiver_mj.experiments.run_folder import RunFolder

    held = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert held.stdout.readline() == "held\n"
        (tmp_path / "episodes" / "x.json.1.tmp").write_text("half")
        with pytest.raises(cli.CaregiverError, match="in use by another process"):
            RunFolder(tmp_path, {"a": 1}, resume=True)
        assert (tmp_path / "episodes" / "x.json.1.tmp").exists()
    finally:
        held.communicate("")
    RunFolder(tmp_path, {"a": 1}, resume=True)
    assert not (tmp_path / "episodes" / "x.json.1.tmp").exists()


def test_runs_of_different_columns_are_not_pooled(given, tmp_path, capsys):
    _without(shutil.copytree(given / "run", tmp_path / "run"), "damage_gate")
    assert run("pool", tmp_path / "run", given / "other", "--out", tmp_path / "out") == 2
    assert "must have the same columns, got 'damage_gate' in one" in capsys.readouterr().err


def test_a_part_of_an_options_name_is_none(capsys):
    assert run("house", "make", "--see", 3) == 2
    assert "--see" in capsys.readouterr().err


def test_figures_take_no_style_from_the_working_folder(tmp_path):
    (tmp_path / "matplotlibrc").write_text("text.usetex: true\n")
    script = "from caregiver_mj.viz import figure_style; assert not figure_style.mpl.rcParams['text.usetex']"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, timeout=100)


def test_verdicts_of_a_comparison_are_those_of_the_rows(given, tmp_path, capsys):
    folder = shutil.copytree(given / "run", tmp_path / "run")
    _harm(folder, cells_harmed=1, cells_decidable=1)
    assert not run("compare", given / "run", folder, "--json")
    first, second = json.loads(capsys.readouterr().out)["verdicts"]
    assert first["parts"] == second["parts"]


@pytest.mark.parametrize("name", ["a.submission/b.submission", "a" * 300 + ".submission"])
def test_a_submission_that_cannot_be_written_is_told_in_a_line(given, tmp_path, capsys, name):
    (tmp_path / "a.submission").touch()
    assert run("submit", given / "run", "--out", tmp_path / name) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be written: " in line


@pytest.mark.parametrize(
    ("change", "file"),
    [
        (lambda folder: _table(folder, "maps.parquet", family=7), "maps.parquet"),
        (lambda folder: _table(folder, "episodes.parquet", children="\x1b[31m"), "episodes.parquet"),
        (lambda folder: _change(folder / "summary.json", versions="none"), "versions must be"),
        (lambda folder: _change(folder / "run.json", versions=5), "versions in run.json must be"),
        (lambda folder: _change(folder / "run.json", code=5), "code in run.json must be"),
        (lambda folder: _harm(folder, cells=None), "cells of a summary must be a number"),
        (lambda folder: _table(folder, "episodes.parquet", damage=np.inf), "column 'damage' must have"),
        (lambda folder: _table(folder, "episodes.parquet", stopped=0.5), "column 'stopped' must have whole numbers"),
        (lambda folder: _table(folder, "episodes.parquet", sight=1.0), "column 'sight' must have texts"),
        (lambda folder: _table(folder, "episodes.parquet", toys_by_child=1.0), "column 'toys_by_child' must have"),
        (lambda folder: _without(folder, "toys_reached"), "must have a column 'toys_reached'"),
        (lambda folder: _table(folder, "episodes.parquet", seed=7), "episodes.parquet is that of another run"),
        (lambda folder: _rows(folder, [0, 0, 2, 3]), "episodes.parquet is that of another run"),
        (lambda folder: _twice(folder), "each of its keys must be there once, got 'seed' twice"),
    ],
)
@pytest.mark.parametrize("reader", ["report", "pool", "compare"])
def test_what_is_of_another_type_is_refused(given, tmp_path, capsys, reader, change, file):
    shutil.copytree(given / "run", tmp_path / "run")
    change(tmp_path / "run")
    more = {"report": (), "pool": (given / "other", "--out", tmp_path / "out"), "compare": (given / "run",)}
    rest = more[reader]
    assert run(reader, tmp_path / "run", *rest) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"the run in '{tmp_path / 'run'}' cannot be read: " in line
    assert file in line


READERS = ("verify", "leaderboard", "report", "compare", "pool", "submit", "resume", "house", "answers")


@pytest.mark.parametrize(
    ("readers", "count"),
    [
        ("verify,leaderboard,compare,pool,submit,resume,house", 2),
        *(pytest.param(reader, COUNT, marks=pytest.mark.slow) for reader in READERS),
    ],
)
def test_readers_refuse_in_a_line_or_read(readers, count, given, tmp_path, request):
    if readers == "answers":
        request.getfixturevalue("acted")
    script = pathlib.Path(__file__).parent / "fuzz_reader.py"
    done = subprocess.run(
        [sys.executable, script, readers, str(count), str(given), str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60 * count + 600,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
    for line in done.stdout.splitlines():
        print(line)
        told = json.loads(line)
        assert told["tried"] == count
        assert told["seen"] == []
        assert told["megabytes"] < 1000
        assert told["seconds"] < 20
