"""The report of runs over several houses."""

import pytest
from made_runs import TINY, drawn_once, write_run
from test_report import words

from caregiver_mj import cli
from caregiver_mj.viz import figures, report
from caregiver_mj.viz.report.child import child_table
from caregiver_mj.viz.report.left import kinds_table, short_table

pytestmark = pytest.mark.slow

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


def test_the_headline_is_over_houses(page, many):
    damage = many.episodes.groupby(["caregiver", "house"])["damage"].mean().groupby("caregiver").mean()
    assert f"{100 * (1 - damage['paper'] / damage['none']):.0f} % of the damage avoided" in page
    assert "4 paired episodes of each of 2 novices in each of 2 houses." in page


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
