"""Evaluation: what its rows depend on, what survives a kill, and statistics worked out by hand."""

import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import psutil
import pytest

from caregiver_mj.caregivers.caregiver import CAREGIVERS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import evaluation, statistics, workers
from caregiver_mj.experiments.evaluation import Settings, evaluate
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.plans.floor_plan import FloorPlan

# Columns of the contract, written out once more.
COLUMNS = ["world", "house", "caregiver", "epsilon", "episode", "seed"]
MEASURES = ["damage", "damage_stairwell", "damage_candle", "damage_table", "timesteps_to_threshold", "cells_visited"]
MEASURES += ["toys_reached", "moves_blocked", "interventions", "interventions_done", "candles_dropped", "strikes"]
MEASURES += ["sim_seconds", "wall_seconds"]
WORLDS = {"grid": (6, (1.0, 0.5)), "house": (2, (1.0,))}  # world: episodes, epsilons
PAPER = FloorPlan.load("paper")


# Grouped, so that the results of a world are shared and not worked out by every test process.
@pytest.fixture(params=[pytest.param(w, marks=pytest.mark.xdist_group(w)) for w in WORLDS], scope="module")
def settings(request):
    episodes, epsilons = WORLDS[request.param]
    return Settings(PAPER, request.param, ("none", "paper"), epsilons, episodes, seed=3)


@pytest.fixture(scope="module")
def result(settings):
    return evaluate(settings)


def rows(result):
    """The rows less the one column that depends on the machine."""
    return result.episodes.drop(columns="wall_seconds").reset_index(drop=True)


def same(result, other):
    pd.testing.assert_frame_equal(rows(result), rows(other), check_exact=True)
    pd.testing.assert_frame_equal(result.maps, other.maps, check_exact=True)


def without_times(summary):
    return [{k: v for k, v in row.items() if "wall_seconds" not in k} for row in summary["rows"]]


# -- Rows --------------------------------------------------------------------------------------------


def test_contract(settings, result, tmp_path):
    RunFolder(tmp_path, settings.record()).finish(result.episodes, result.summary, result.maps)
    episodes = pd.read_parquet(tmp_path / "episodes.parquet")
    assert list(episodes.columns) == COLUMNS + MEASURES
    combinations = [(epsilon, caregiver) for epsilon in settings.epsilons for caregiver in ("none", "paper")]
    assert len(episodes) == len(combinations) * settings.episodes
    assert not episodes.isna().any(axis=None)
    parts = episodes[["damage_stairwell", "damage_candle", "damage_table"]].sum(axis=1)
    assert (episodes.damage == parts).all()
    assert episodes.timesteps_to_threshold.between(1, 200).all()
    assert (episodes.interventions_done <= episodes.interventions).all()
    alone = episodes[episodes.caregiver == "none"]
    assert (alone[["moves_blocked", "interventions", "interventions_done", "strikes"]] == 0).all(axis=None)
    # 200 timesteps of 0.75 m at 1.6 km/h are 337.5 s
    assert episodes.sim_seconds.to_numpy() == pytest.approx(337.5, abs=2.0)

    summary = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert [(r["epsilon"], r["caregiver"]) for r in summary["rows"]] == combinations
    for row in summary["rows"]:
        assert row["world"] == settings.world
        assert row["house"] == "paper"
        assert row["episodes"] == settings.episodes
        for column in ["damage_normalised", *MEASURES]:
            assert row[f"{column}_ci_low"] - 1e-9 <= row[f"{column}_mean"] <= row[f"{column}_ci_high"] + 1e-9
            assert row[f"{column}_sd"] >= 0
    assert summary["seed"] == 3
    wanted = {"caregiver_mj", "python", "numpy", "mujoco", "dm_control", "mink", "ruckig"}
    assert set(summary["versions"]) == wanted
    none, paper = (summary["rows"][i::2] for i in (0, 1))
    for row, alone, guarded in zip(summary["comparisons"], none, paper, strict=True):
        assert (row["caregiver"], row["baseline"], row["epsilon"]) == ("paper", "none", alone["epsilon"])
        assert row["damage_left"] == pytest.approx(guarded["damage_mean"] / alone["damage_mean"])


def test_maps_agree_with_the_rows(settings, result):
    maps = result.maps
    assert list(maps.columns) == ["world", "house", "caregiver", "epsilon", "row", "column", "visits", "damage"]
    harmless = [all(PAPER[n] in ".#B" for n in around(cell)) for cell in PAPER.free_cells]
    damage = result.episodes.groupby(["caregiver", "epsilon"]).damage.sum()
    for key, cells in maps.groupby(["caregiver", "epsilon"]):
        assert list(zip(cells.row, cells.column, strict=True)) == list(PAPER.free_cells)
        assert cells.visits.sum() == 200 * settings.episodes
        assert cells.damage.sum() == damage[key] > 0
        assert (cells.damage[harmless] == 0).all()


def around(cell):
    return [(cell[0] + down, cell[1] + right) for down, right in ((-1, 0), (0, 1), (1, 0), (0, -1))]


def test_rows_do_not_depend_on_jobs(settings, result):
    same(evaluate(settings, jobs=2), result)


def test_rows_do_not_depend_on_company(settings, result):
    everything = rows(result)
    epsilon = settings.epsilons[-1]
    few = settings.episodes // 2
    alone = Settings(PAPER, settings.world, ("paper",), (epsilon,), few, seed=3)
    wanted = everything[(everything.caregiver == "paper") & (everything.epsilon == epsilon)][:few]
    pd.testing.assert_frame_equal(rows(evaluate(alone)), wanted.reset_index(drop=True), check_exact=True)


@pytest.mark.parametrize("caregiver", CAREGIVERS)
def test_rows_do_not_depend_on_blocks(monkeypatch, caregiver):
    settings = Settings(PAPER, "grid", (caregiver,), (1.0,), 20)
    whole = evaluate(settings)
    monkeypatch.setattr(evaluation, "_GRID_BLOCK", 7)
    assert len(settings.blocks()) == 3
    same(evaluate(settings), whole)


def test_the_same_seeds_everywhere(settings, result):
    episodes = result.episodes
    for _, group in episodes.groupby("episode"):
        assert group.seed.nunique() == 1
    assert episodes.seed.nunique() == settings.episodes
    assert evaluation.episode_seed(3, 1) != evaluation.episode_seed(4, 1)


def test_seed_changes_the_rows():
    damages = [evaluate(Settings(PAPER, "grid", ("none",), (1.0,), 5, seed)).episodes.damage for seed in (0, 1)]
    assert not damages[0].equals(damages[1])


def test_bad_settings_are_refused():
    for wrong in (
        Settings(PAPER, "mars"),
        Settings(PAPER, caregivers=("nanny",)),
        Settings(PAPER, caregivers=()),
        Settings(PAPER, epsilons=(0.5, 0.5)),
        Settings(PAPER, epsilons=(float("nan"),)),
        Settings(PAPER, episodes=0),
        Settings(PAPER, seed=-1),
    ):
        with pytest.raises(CaregiverError):
            evaluate(wrong)
    with pytest.raises(CaregiverError, match="jobs"):
        evaluate(Settings(PAPER, "grid"), jobs=0)


# -- Runs that are killed ----------------------------------------------------------------------------

LONG = Settings(PAPER, "grid", ("none", "paper"), (1.0,), 2000)  # long enough to be killed in the middle of it
BLOCKS = 4


@pytest.fixture(scope="module")
def undisturbed():
    return evaluate(LONG)


def start(folder, *more, **options):
    """Starts the run `LONG` as a real process."""
    command = [sys.executable, "-m", "caregiver_mj", "evaluate", "--world", "grid", "--epsilon", "1"]
    command += ["--episodes", "2000", "--out", str(folder), *more]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **options)


def blocks_on_disk(folder):
    return {path: path.stat().st_mtime_ns for path in pathlib.Path(folder).glob("episodes/*.json")}


def wait_for_blocks(folder, count, process):
    for _ in range(3000):
        if len(blocks_on_disk(folder)) >= count:
            return
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    pytest.fail("the run makes no progress")


def check_finished(folder, undisturbed):
    episodes = pd.read_parquet(folder / "episodes.parquet").drop(columns="wall_seconds")
    pd.testing.assert_frame_equal(episodes, rows(undisturbed), check_exact=True)
    pd.testing.assert_frame_equal(pd.read_parquet(folder / "maps.parquet"), undisturbed.maps, check_exact=True)
    summary = json.loads((folder / "summary.json").read_text())
    assert without_times(summary) == without_times(undisturbed.summary)
    assert summary["comparisons"] == undisturbed.summary["comparisons"]
    assert not list(folder.rglob("*.tmp"))


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_killed_run_is_continued(tmp_path, undisturbed, jobs):
    process = start(tmp_path, "--jobs", jobs)
    wait_for_blocks(tmp_path, 2, process)
    children = psutil.Process(process.pid).children()
    process.kill()
    process.communicate()
    assert not psutil.wait_procs(children, timeout=20)[1]  # workers notice and end
    assert not (tmp_path / "summary.json").exists()
    (tmp_path / "episodes" / "half.json.1.tmp").write_text("[")  # as a kill in the middle of a write leaves
    before = blocks_on_disk(tmp_path)
    assert 2 <= len(before) < BLOCKS

    process = start(tmp_path, "--jobs", jobs, "--resume")
    _, err = process.communicate()
    assert process.returncode == 0, err
    assert before.items() <= blocks_on_disk(tmp_path).items()  # not run again
    check_finished(tmp_path, undisturbed)


def test_killed_worker_is_replaced(tmp_path, undisturbed):
    process = start(tmp_path, "--jobs", "2")
    wait_for_blocks(tmp_path, 1, process)
    victims = [p for p in psutil.Process(process.pid).children() if "spawn_main" in " ".join(p.cmdline())]
    assert len(victims) == 2
    for victim in victims:
        victim.kill()
    _, err = process.communicate()
    assert process.returncode == 0, err
    check_finished(tmp_path, undisturbed)


def test_interrupted_run_says_how_to_go_on(tmp_path, undisturbed):
    process = start(tmp_path, "--jobs", "2")
    wait_for_blocks(tmp_path, 1, process)
    children = psutil.Process(process.pid).children()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 1
    last = err.splitlines()[-1]
    assert "interrupted" in last
    assert "Traceback" not in err
    assert not psutil.wait_procs(children, timeout=5)[1]
    command = last.split("go on with: caregiver-mj ")[1].split()
    again = subprocess.run([sys.executable, "-m", "caregiver_mj", *command], capture_output=True, check=False)
    assert again.returncode == 0
    check_finished(tmp_path, undisturbed)


def test_full_disk_is_an_error(tmp_path, undisturbed):
    def limit():  # the size of a file: like a full disk, a write comes back short
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))

    process = start(tmp_path, preexec_fn=limit)
    _, err = process.communicate()
    assert process.returncode == 1
    assert "cannot be written: File too large" in err.splitlines()[-1]
    assert "Traceback" not in err
    assert blocks_on_disk(tmp_path) == {}
    assert not list(tmp_path.rglob("*.tmp"))
    process = start(tmp_path, "--resume")
    process.communicate()
    check_finished(tmp_path, undisturbed)


def test_damaged_block_is_run_again(tmp_path):
    settings = Settings(PAPER, "grid", ("paper",), (1.0,), 3)
    first = evaluate(settings, RunFolder(tmp_path, settings.record()))
    (block,) = blocks_on_disk(tmp_path)
    block.write_text(block.read_text()[:-20])
    same(evaluate(settings, RunFolder(tmp_path, settings.record(), resume=True)), first)


def test_finished_run_is_not_run_again(tmp_path, monkeypatch):
    settings = Settings(PAPER, "grid", ("paper",), (1.0,), 3)
    first = evaluate(settings, RunFolder(tmp_path, settings.record()))
    monkeypatch.setattr(evaluation, "run_block", lambda *_: pytest.fail("run again"))
    same(evaluate(settings, RunFolder(tmp_path, settings.record(), resume=True)), first)


def _square(job):
    if job == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "wrong":
        raise ValueError("job is wrong")
    return job**2


def test_workers_do_every_job():
    assert dict(workers.run_jobs(_square, range(7), 2)) == {job: job**2 for job in range(7)}


def test_job_that_kills_its_workers_is_given_up(monkeypatch):
    monkeypatch.setattr(workers, "_DEATHS", 2)
    with pytest.raises(workers.WorkerError, match="deadly: its worker process died 2 times"):
        list(workers.run_jobs(_square, [1, "deadly", 2], 2))


def test_error_in_a_worker_is_passed_on():
    with pytest.raises(workers.WorkerError, match="ValueError: job is wrong"):
        list(workers.run_jobs(_square, [1, "wrong"], 2))


# -- Statistics --------------------------------------------------------------------------------------


def frame(**damages):
    """Episodes by hand: of each caregiver a list of damages."""
    return pd.DataFrame(
        {
            "world": "grid",
            "house": "h",
            "caregiver": name,
            "epsilon": 1.0,
            "episode": episode,
            "damage": damage,
            "timesteps_to_threshold": 200 - damage,
            "cells_visited": 1,
            "toys_reached": 0,
        }
        for name, values in damages.items()
        for episode, damage in enumerate(values)
    )


def test_summary_by_hand():
    none, paper = statistics.summarise(frame(none=[10, 20], paper=[6, 0]), ("damage", "cells_visited"))
    assert none["damage_mean"] == 15
    assert none["damage_sd"] == pytest.approx(50**0.5)  # ((10-15)² + (20-15)²) / (2-1)
    assert (none["damage_ci_low"], none["damage_ci_high"]) == (10, 20)  # a quarter of resamples are (10, 10)
    assert none["damage_normalised_mean"] == pytest.approx(0.75)
    assert paper["damage_normalised_mean"] == pytest.approx(0.15)
    assert paper["damage_normalised_sd"] == pytest.approx(18**0.5 / 20)
    assert (none["cells_visited_mean"], none["cells_visited_sd"]) == (1, 0)
    assert (none["cells_visited_ci_low"], none["cells_visited_ci_high"]) == (1, 1)


def test_summary_of_one_harmless_episode():
    (row,) = statistics.summarise(frame(none=[0]), ("damage",))
    assert (row["damage_mean"], row["damage_sd"], row["damage_normalised_mean"]) == (0, 0, 0)
    assert row["damage_ci_low"] is row["damage_ci_high"] is None


def test_comparison_by_hand():
    (row,) = statistics.compare(frame(none=[10, 20, 30, 40, 50], paper=[9, 18, 27, 36, 45]), "paper", "none")
    assert row["damage_left"] == pytest.approx(0.9)
    assert row["damage_left_ci_low"] == pytest.approx(0.9)  # the ratio is the same in every pair
    assert row["damage_left_ci_high"] == pytest.approx(0.9)
    assert row["damage_difference_mean"] == -3
    assert row["damage_p"] == pytest.approx(2 / 2**5)  # all five of one sign: two of the 32 assignments
    assert row["timesteps_to_threshold_difference_mean"] == 3
    assert row["toys_reached_p"] == 1  # no difference at all


def test_comparison_pairs_by_episode():
    episodes = frame(none=[10, 20, 30], paper=[9, 19, 29]).iloc[::-1]
    (row,) = statistics.compare(episodes, "paper", "none")
    assert row["damage_difference_ci_low"] == row["damage_difference_ci_high"] == -1


def test_comparison_without_any_damage():
    (row,) = statistics.compare(frame(none=[0, 0], paper=[0, 0]), "paper", "none")
    assert row["damage_left"] is row["damage_left_ci_low"] is None
    assert row["damage_p"] == 1


def test_interval_agrees_with_theory():
    data = np.random.default_rng(1).normal(5.0, 2.0, size=(400, 1))
    low, high = statistics.mean_interval(data)
    error = data.std(ddof=1) / 20
    assert low[0] == pytest.approx(data.mean() - 1.96 * error, abs=0.15 * error)
    assert high[0] == pytest.approx(data.mean() + 1.96 * error, abs=0.15 * error)
