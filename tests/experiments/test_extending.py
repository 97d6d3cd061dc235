"""Runs that get more episodes or caregivers, that are compared, and that are put together."""

import dataclasses
import json
import shutil
import subprocess
import sys

import pandas as pd
import pytest
from comparing import same

from caregiver_mj import CaregiverError, FloorPlan, cli
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.finished import compare_runs, read_finished
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Settings

TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
RUN = Settings(TINY, "grid", ("none", "nearest"), (1.0, 0.5), 5)


def run(folder, settings=RUN, grid_block=6, **changes):
    settings = dataclasses.replace(settings, **changes)
    return evaluate(settings, RunFolder(folder, settings.record(), resume=True), grid_block=grid_block)


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first")
    run(folder)
    return folder


@pytest.fixture
def begun(first, tmp_path):
    return shutil.copytree(first, tmp_path / "begun")


def files(folder):
    return {path: path.stat().st_mtime_ns for path in folder.glob("episodes/*.json")}


def test_more_episodes_and_caregivers_are_added_and_nothing_is_run_again(begun):
    wanted = RUN
    for changes in ({"episodes": 7}, {"caregivers": ("none", "guard", "nearest"), "episodes": 8}):
        before = files(begun)
        wanted = dataclasses.replace(wanted, **changes)
        at_once = evaluate(wanted)
        same(run(begun, wanted), at_once)
        assert before.items() < files(begun).items()
    record = json.loads((begun / "run.json").read_text())
    assert (record["episodes"], record["extended_at"]) == (8, [5, 7])
    assert record["caregivers"] == ["none", "guard", "nearest"]
    before = files(begun)
    same(run(begun, wanted), at_once)  # the same again is nothing new
    assert before == files(begun)
    assert read_finished(begun).settings == wanted


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"episodes": 4}, "episodes is 5 there and 4 here; a run can be added to, but not cut"),
        ({"caregivers": ("none", "guard")}, r"caregivers is \['none', 'nearest'\] there and .*; a run can be added to"),
        ({"seed": 3, "episodes": 9}, "seed is 0 there and 3 here$"),
        ({"families": (1.0,)}, r"families is \['1', '0.5'\] there and \['1'\] here"),
    ],
)
def test_nothing_else_is_added(begun, changes, words):
    before = (begun / "run.json").read_bytes()
    with pytest.raises(CaregiverError, match=words):
        run(begun, **changes)
    assert (begun / "run.json").read_bytes() == before
    assert (begun / "summary.json").exists()


CODE = """\
from beside_it import WHICH
from caregiver_mj.caregivers import TargetPolicy

class Mine(TargetPolicy):
    files = ("weights.txt",)

    def act(self, observations, masks):
        return masks.argmax(axis=1) * WHICH
"""


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    folder = tmp_path / "code"
    folder.mkdir()
    (folder / "a_plugin.py").write_text(CODE)
    (folder / "beside_it.py").write_text("WHICH = 1\n")
    (folder / "weights.txt").write_text("0.5\n")
    (folder / "unrelated.py").write_text("\n")
    monkeypatch.syspath_prepend(folder)
    yield folder
    for name in ("a_plugin", "beside_it"):
        sys.modules.pop(name, None)


def test_a_run_is_not_gone_on_with_by_code_that_has_changed(tmp_path, plugin, capsys):
    argv = ["evaluate", "--world", "grid", "--caregiver", "none", "a_plugin:Mine", "--epsilon", "1", "--episodes", "2"]
    argv += ["--out", str(tmp_path / "run")]
    assert cli.main(argv) == 0
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    assert list(record["code"]) == ["caregiver a_plugin:Mine"]
    (plugin / "unrelated.py").write_text("edited\n")
    assert cli.main([*argv, "--resume"]) == 0
    capsys.readouterr()
    for file in (plugin / "a_plugin.py", plugin / "beside_it.py", plugin / "weights.txt"):
        text = file.read_text()
        file.write_text(f"{text}\n# edited\n")
        for more in ([], ["--episodes", "3"]):
            assert cli.main([*argv, "--resume", *more]) == 2
            out, err = capsys.readouterr()
            assert (out, err.count("\n")) == ("", 1)
            assert "the caregiver a_plugin:Mine has changed, from a_plugin.py, sha256 " in err
        file.write_text(text)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Runs of two seeds, and one with more episodes and caregivers."""
    folder = tmp_path_factory.mktemp("runs")
    for name, changes in (
        ("seed0", {"episodes": 8}),
        ("seed1", {"episodes": 8, "seed": 1}),
        ("more", {"episodes": 10, "caregivers": ("guard", "nearest", "none")}),
        ("other", {"families": (0.25,)}),
    ):
        run(folder / name, grid_block=10, **changes)
    return folder


def finished(runs, *names):
    return [read_finished(runs / name) for name in names]


def test_runs_are_compared_in_the_episodes_that_both_have(runs):
    found = compare_runs(*finished(runs, "seed0", "more"))
    wanted = [(name, family, 8) for name in ("none", "nearest") for family in ("1", "0.5")]
    assert [(row["baseline"], row["family"], row["episodes"]) for row in found["rows"]] == wanted
    assert all(row["first"] == row["second"] and row["damage_difference_mean"] == 0 for row in found["rows"])
    assert found["settings"] == {"caregivers": [["none", "nearest"], ["guard", "nearest", "none"]], "episodes": [8, 10]}


def test_one_caregiver_against_another(runs):
    first, second = finished(runs, "seed0", "more")
    found = compare_runs(first, second, ["nearest", "guard"])
    for row in found["rows"]:
        ours, theirs = (
            side[(side.caregiver == name) & (side.family == row["family"]) & (side.episode < 8)].damage.to_numpy()
            for side, name in ((first.episodes, "nearest"), (second.episodes, "guard"))
        )
        assert row["damage_difference_mean"] == pytest.approx((theirs - ours).mean())
        assert (row["first"], row["second"]) == pytest.approx((ours.mean(), theirs.mean()))
        assert (row["baseline"], row["caregiver"]) == ("nearest", "guard")


def test_two_episodes_of_one_seed_count_once(runs):
    """In runs of 60,000 some seeds come up twice by chance; they make the same episode."""
    first, second = finished(runs, "seed0", "more")
    twice = [dataclasses.replace(run, episodes=pd.concat([run.episodes] * 2)) for run in (first, second)]
    assert compare_runs(*twice) == compare_runs(first, second)


def test_houses_of_other_sizes_are_no_pair(runs):
    first, second = finished(runs, "seed0", "more")
    larger = dataclasses.replace(second.settings.plan, cell_size=1.5)
    second = dataclasses.replace(second, settings=dataclasses.replace(second.settings, plans=(larger,)))
    with pytest.raises(CaregiverError, match="must be the same in both runs, got two floor plans"):
        compare_runs(first, second)


@pytest.mark.parametrize(
    ("names", "who", "words"),
    [
        (("seed0", "seed1"), (), "no episode of 'none' in common: seed 0 in the first, 1 in the second"),
        (("seed0", "other"), (), "no episode of 'none' in common: epsilon|no episode of .* in common"),
        (("seed0", "more"), ("nanny",), "no caregiver 'nanny' in the run: there are none, nearest"),
        (("seed0", "more"), ("guard", "none"), "no caregiver 'guard' in the run"),
        (("seed0", "more"), ("none", "none", "none"), "caregivers to compare must be 1 or 2, got 3"),
    ],
)
def test_runs_that_cannot_be_compared(runs, names, who, words):
    with pytest.raises(CaregiverError, match=words):
        compare_runs(*finished(runs, *names), who)


def test_seeds_are_pooled(runs, tmp_path, capsys):
    out = tmp_path / "pooled"
    assert cli.main(["pool", str(runs / "seed0"), str(runs / "seed1"), "--out", str(out)]) == 0
    assert "16 episodes a row, seeds 0, 1" in capsys.readouterr().out
    pooled, (first, second) = read_finished(out), finished(runs, "seed0", "seed1")
    assert (pooled.settings.episodes, pooled.seeds) == (16, [(0, 8), (1, 8)])
    keys = ["caregiver", "family", "seed"]
    both = pd.concat([first.episodes, second.episodes]).sort_values(keys, ignore_index=True)
    together = pooled.episodes.sort_values(keys, ignore_index=True)
    pd.testing.assert_frame_equal(together.drop(columns="episode"), both.drop(columns="episode"))
    assert pooled.maps.visits.sum() == first.maps.visits.sum() + second.maps.visits.sum()
    assert len(pooled.maps) == len(first.maps)
    for row in pooled.summary["rows"]:
        chosen = both[(both.caregiver == row["caregiver"]) & (both.family == row["family"])]
        assert (row["episodes"], row["damage_mean"]) == (16, pytest.approx(chosen.damage.mean()))
    assert compare_runs(second, pooled)["rows"][0]["damage_difference_mean"] == 0
    assert cli.main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert "--seed 0\n" in page
    assert "--episodes 8 --seed 1" in page
    with pytest.raises(CaregiverError, match="holds pooled runs: resume each of them"):
        run(out, dataclasses.replace(pooled.settings, episodes=20))


def test_a_long_table_is_read_in_a_process_that_has_no_threads_yet(tmp_path):
    """Where memory is limited a library cannot launch any."""
    path, rows = tmp_path / "episodes.parquet", 8_000
    pd.DataFrame({f"column {i}": [float(i % 7), 0.0] * (rows // 2) for i in range(70)}).to_parquet(path)
    code = "import pathlib, sys; from caregiver_mj.experiments.finished import _table as read"
    subprocess.run([sys.executable, "-c", f"{code}; read(pathlib.Path(sys.argv[1]), {rows})", path], check=True)
