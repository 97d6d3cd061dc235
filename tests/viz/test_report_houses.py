"""The report of runs over several houses, the order of runs, and what is told beside the numbers."""

import re

import pandas as pd
import pytest
from made_runs import PAPER, TINY, drawn_once, undrawn, write_run
from test_report import words

from caregiver_mj import cli
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import figures, report
from caregiver_mj.viz.report.child import child_table, why_all_timesteps
from caregiver_mj.viz.report.left import kinds_table, left_table, short_table, wins_table
from caregiver_mj.viz.report.page import disclosures

CAREGIVERS = ("none", "guard", "nearest", "paper", "floor")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of one house, and the report of it and of two others: one over several houses, one of another house."""
    folder = tmp_path_factory.mktemp("houses")
    command = ["evaluate", "--world", "grid", "--epsilon", "1", "0.5", "--caregiver", *CAREGIVERS]
    assert cli.main([*command, "--houses", "test-2", "--episodes", "4", "--out", str(folder / "many")]) == 0
    assert cli.main([*command, "--house", "paper", "--episodes", "4", "--out", str(folder / "paper")]) == 0
    write_run(folder / "tiny", plan=TINY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "as_bytes", drawn_once)
        report.write_report([folder / "paper", folder / "tiny", folder / "many"])
    return folder


@pytest.fixture(scope="module")
def many(folder):
    return report.read_run(folder / "many")


@pytest.fixture(scope="module")
def page(folder):
    return words((folder / "paper" / "report.html").read_text("utf-8"))


def test_unseen_houses_come_first_and_paper_last(page):
    titles = ["Grid, 2 houses (test-2), caregiver", "Grid (tiny), caregiver", "Grid (paper), caregiver"]
    places = [page.index(title) for title in titles]
    assert places == sorted(places)


def test_order_of_runs(folder, tmp_path):
    other = write_run(tmp_path / "other", plan=FloorPlan.parse("\n".join(PAPER.rows), "another"))
    ranks = [report.read_run(path).rank for path in (folder / "many", other, folder / "paper")]
    assert ranks == [0, 2, 3]
    assert wins_table(report.read_run(folder / "paper")) is None  # of a single house


def test_the_headline_is_over_houses(page, many):
    damage = many.episodes.groupby(["caregiver", "house"])["damage"].mean().groupby("caregiver").mean()
    assert f"{100 * (1 - damage['paper'] / damage['none']):.0f} % of the damage avoided" in page
    assert "4 paired episodes of each of 2 novices in each of 2 houses." in page


def test_damage_left_has_all_caregivers_in_the_order_of_the_run(many):
    table = left_table(many)
    assert [row[0] for row in table.rows] == ["guard", "nearest", "paper", "floor"]
    assert table.columns == ("caregiver", "random motion", "50 % random")
    means = many.episodes[many.episodes.family == "1"].groupby("caregiver")["damage"].mean()
    assert table.rows[2][1].startswith(f"{means['paper'] / means['none']:.2f}\n[")


def test_in_how_many_houses_one_does_better(many):
    table = wins_table(many)
    assert [row[0] for row in table.rows] == ["guard", "nearest"]
    for row in table.rows:
        for cell, family in zip(row[1:], many.families, strict=True):
            chosen = many.episodes[many.episodes.family == family]
            sums = chosen.groupby(["house", "caregiver"])["damage"].sum().unstack()
            difference = sums["paper"] - sums[row[0]]
            assert cell == f"{(difference < 0).sum()} : {(difference > 0).sum()}"


def test_what_did_the_damage(many):
    episodes = many.episodes[many.episodes.family == "1"]
    table = kinds_table(many)
    rows = {row[0]: row[1].split("\n")[0] for row in table.rows}
    for column, name in (("damage_stairwell", "stairs"), ("damage_candle", "candles"), ("damage_table", "bare tables")):
        means = episodes.groupby("caregiver")[column].mean()
        for caregiver, how in (("none", "without"), ("paper", "with"), ("floor", "floor")):
            assert rows[f"{name}, {how}"] == f"{means[caregiver]:.1f}"
    assert rows["stairs, floor"] == rows["candles, floor"] == "0.0"
    assert short_table(many).rows[0][1] == f"{rows['stairs, without']} → {rows['stairs, with']}"


def test_the_childs_side(tmp_path):
    # Three toys each, two moves blocked of which none is told apart; without, 8 of 8 come above 15, with, 2 of 8.
    run = report.read_run(write_run(tmp_path))
    rows = {row[0]: row[1:] for row in child_table(run).rows}
    assert rows["stopped, %"] == ("100 → 25", "50 → 0")
    assert rows["toys kept, %"][0].startswith("100.0\n[")
    assert rows["< 3 % lost?"] == ("not inferior", "not inferior")
    assert rows["free moves denied"] == ("0.0\n[0.0, 0.0]",) * 2


def test_a_run_that_did_not_measure_it_has_no_childs_side(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "as_bytes", undrawn)
    write_run(tmp_path)
    episodes = pd.read_parquet(tmp_path / "episodes.parquet")
    gone = ["stopped", "damage_until_stop", "moves_blocked_stairwell", "moves_blocked_free", "longest_blocked"]
    episodes.drop(columns=gone).to_parquet(tmp_path / "episodes.parquet")
    (tmp_path / "summary.json").write_text(
        re.sub(r'"damage_verdict": "[^"]*",', "", (tmp_path / "summary.json").read_text("utf-8"))
    )
    text = words(report.write_report([tmp_path]).read_text("utf-8"))
    assert "The child's side" not in text
    assert "of the damage avoided" in text


def test_why_damage_is_that_of_all_timesteps():
    # Mean 97.05 of 200: at least 102.95 / 200 = 51.5 % are stopped, with 16 or more of at most 20: .515 * .8 = .412
    text = why_all_timesteps()
    assert "at least 51 % of them are stopped, with 16 to 20 damage" in text
    assert "would be at least 0.41; it is 0.23" in text


def test_disclosures(folder, many, page):
    fitted, epsilon, same = disclosures([report.read_run(folder / "paper")])
    assert "validates nothing" in fitted
    assert "Figure 1, which we lack" in fitted
    assert "random" in epsilon
    assert "four or more moves" in same
    assert disclosures([many]) == [epsilon, same]  # no run of `paper`
    for text in (fitted, epsilon, same):
        assert text.replace("`", "") in page


def test_figures_of_several_houses_and_those_that_the_tables_show(folder):
    found = {path.stem for path in (folder / "paper" / "figures").glob("*.svg")}
    names = {"damage_left", "kinds", "survival", "toys", "figure_2", "figure_3", "figure_4"}
    assert {f"{name}_grid_test-2" for name in names} <= found
    assert "damage_left_grid_test-2_wide" in found
    assert not {name for name in found if name.startswith("map_") and "test-2" in name}
    # Tables in markdown show their figures.
    text = (folder / "paper" / "tables.md").read_text("utf-8")
    shown = re.findall(r"\]\((figures/[^)]+)\)", text)
    assert len(shown) >= 12
    assert all((folder / "paper" / name).is_file() for name in shown)
