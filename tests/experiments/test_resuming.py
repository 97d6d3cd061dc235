"""Runs that are killed or interrupted: what is kept, and that they end as if nothing had happened."""

import functools
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import pandas as pd
import psutil
import pytest
from comparing import comparable, rows, same, square, without_times

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import workers
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.finished import read_finished
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Block, Settings
from caregiver_mj.plans.floor_plan import FloorPlan

PAPER = FloorPlan.load("paper")
TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
# Long enough to be killed in the middle of it: of both caregivers, a block of 1,000 episodes and one of two.
LONG = Settings(TINY, "grid", ("none", "guard"), (1.0,), 1002)
BLOCKS = 4
SHORT = Settings(PAPER, "grid", ("none",), (1.0,), 3)


@pytest.fixture(scope="module")
def undisturbed():
    return evaluate(LONG)


def start(folder, *more, **options):
    house = folder.parent / "tiny.txt"
    house.write_text(TINY.text)
    command = [sys.executable, "-m", "caregiver_mj", "evaluate", "--world", "grid", "--epsilon", "1"]
    command += ["--house", str(house), "--caregiver", *LONG.caregivers, "--episodes", str(LONG.episodes)]
    command += ["--out", str(folder), *more]
    # Tests that run in the background of a script have been told to ignore Ctrl-C, and so would their children.
    options = {"preexec_fn": functools.partial(signal.signal, signal.SIGINT, signal.default_int_handler)} | options
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **options)


def blocks_on_disk(folder):
    return {path: path.stat().st_mtime_ns for path in pathlib.Path(folder).glob("episodes/*.json")}


def wait_for_blocks(folder, count, process):
    for _ in range(30_000):
        if len(blocks_on_disk(folder)) >= count:
            return
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    pytest.fail("the run makes no progress")


def check_finished(folder, undisturbed):
    episodes = comparable(pd.read_parquet(folder / "episodes.parquet"))
    pd.testing.assert_frame_equal(episodes, rows(undisturbed), check_exact=True)
    pd.testing.assert_frame_equal(pd.read_parquet(folder / "maps.parquet"), undisturbed.maps, check_exact=True)
    summary = json.loads((folder / "summary.json").read_text())
    assert without_times(summary) == without_times(undisturbed.summary)
    assert summary["comparisons"] == undisturbed.summary["comparisons"]
    assert not list(folder.rglob("*.tmp"))


@pytest.mark.slow
def test_killed_run_is_continued(tmp_path, undisturbed):
    process = start(tmp_path, "--jobs", "2")
    wait_for_blocks(tmp_path, 2, process)
    children = psutil.Process(process.pid).children()
    process.kill()
    process.communicate()
    assert not psutil.wait_procs(children, timeout=120)[1]  # workers notice and end
    assert not (tmp_path / "summary.json").exists()
    (tmp_path / "episodes" / "half.json.1.tmp").write_text("[")  # as a kill in the middle of a write leaves
    before = blocks_on_disk(tmp_path)
    assert 2 <= len(before) < BLOCKS

    process = start(tmp_path, "--jobs", "2", "--resume")
    _, err = process.communicate()
    assert process.returncode == 0, err
    assert before.items() <= blocks_on_disk(tmp_path).items()  # not run again
    check_finished(tmp_path, undisturbed)


@pytest.mark.parametrize(
    ("number", "word"),
    [pytest.param(signal.SIGINT, "interrupted", marks=pytest.mark.slow), (signal.SIGTERM, "terminated")],
)
def test_interrupted_run_says_how_to_go_on(tmp_path, undisturbed, number, word):
    process = start(tmp_path, "--jobs", "2")
    wait_for_blocks(tmp_path, 1, process)
    children = psutil.Process(process.pid).children()
    process.send_signal(number)
    _, err = process.communicate()
    assert process.returncode == 1
    last = err.splitlines()[-1]
    assert last.startswith(f"caregiver-mj: {word}; ")
    assert "Traceback" not in err
    assert not psutil.wait_procs(children, timeout=120)[1]
    if number == signal.SIGTERM:  # from here on it is the same
        return
    command = last.split("go on with: caregiver-mj ")[1].split()
    again = subprocess.run([sys.executable, "-m", "caregiver_mj", *command], capture_output=True, check=False)
    assert again.returncode == 0
    check_finished(tmp_path, undisturbed)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """The run `SHORT`, finished: its folder, and what came out."""
    folder = tmp_path_factory.mktemp("short")
    return folder, evaluate(SHORT, RunFolder(folder, SHORT.record()))


@pytest.fixture
def first(short, tmp_path):
    """What came out of that run, a copy of whose folder is there to be changed."""
    shutil.copytree(short[0], tmp_path, dirs_exist_ok=True)
    return short[1]


def with_rows(**changes):
    return lambda block: block | {"rows": [row | changes for row in block["rows"]]}


FOREIGN = {
    "nothing": lambda block: {},
    "half of it": lambda block: json.dumps(block)[:-20],
    "no rows": lambda block: block | {"rows": []},
    "another seed": with_rows(seed=5),
    **{f"{value} candles": with_rows(candles_dropped=value) for value in (False, None, -1, 0.5)},
    "no maps": lambda block: block | {"maps": {}},
    "another house's maps": lambda block: block | {"maps": {"1": {"visits": [0], "damage": [0]}}},
}


@pytest.mark.parametrize("change", FOREIGN.values(), ids=FOREIGN)
def test_block_that_is_not_of_the_run_is_run_again(tmp_path, first, change):
    (block,) = blocks_on_disk(tmp_path)
    changed = change(json.loads(block.read_text()))
    block.write_text(changed if isinstance(changed, str) else json.dumps(changed))
    same(evaluate(SHORT, RunFolder(tmp_path, SHORT.record(), resume=True)), first)


@pytest.mark.parametrize("name", ["run.json", ".lock", "episodes", "episodes.parquet", "a block"])
def test_nothing_is_read_or_written_through_a_link(tmp_path, first, name):
    there = tmp_path / name if name != "a block" else next(iter(blocks_on_disk(tmp_path)))
    there.rename(tmp_path / "elsewhere")
    there.symlink_to(tmp_path / "elsewhere")
    for open_it in (lambda: RunFolder(tmp_path, SHORT.record(), resume=True), lambda: read_finished(tmp_path)):
        with pytest.raises(CaregiverError, match=r"must be a (file|folder), got another thing or a link"):
            open_it()


def _where(block):
    time.sleep(0.02)
    return os.getpid()


def test_a_worker_goes_on_with_the_house_that_it_knows():
    novice = (ChildGroup.of(0.5),)
    blocks = [Block(house, who, novice, 0, 1) for house in "abcdef" for who in ("none", "guard", "foresight")]
    done = list(workers.run_jobs(_where, blocks, 2))
    assert {block for block, _ in done} == set(blocks)
    # With the last house one may help the other.
    assert len({(block.house, worker) for block, worker in done}) <= 7


@pytest.mark.slow
def test_workers_do_every_job_or_say_which_they_do_not():
    assert dict(workers.run_jobs(square, range(7), 2)) == {job: job**2 for job in range(7)}
    with pytest.raises(workers.WorkerError, match="deadly: its worker process died 2 times"):
        list(workers.run_jobs(square, [1, "deadly", 2], 2, deaths=2))
    with pytest.raises(workers.WorkerError, match="ValueError: job is wrong"):
        list(workers.run_jobs(square, [1, "wrong"], 2))
