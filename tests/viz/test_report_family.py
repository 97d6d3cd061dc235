"""The report of runs with several children, and which of its episodes is filmed."""

import numpy as np
import pytest
from made_runs import DAMAGE, FAMILIES, PAPER, TINY, write_run

from caregiver_mj.viz import film, report
from caregiver_mj.viz.report.page import make_film
from caregiver_mj.viz.report.tables import children_table


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("several"), "house", caregivers=("none", "paper"), families=FAMILIES)


def test_each_child_has_a_row_of_its_own(run):
    table = children_table(report.read_run(run))
    assert table.columns == ("child", "damage, without", "damage, with", "toys reached, without", "toys reached, with")
    alone, guarded = (np.mean(DAMAGE[caregiver, "1"]) for caregiver in ("none", "paper"))
    assert table.rows[:2] == [
        ("100 % and 50 % random: novice 1, 100 %", f"{0.8 * alone:.1f}", f"{0.8 * guarded:.1f}", "2.0", "2.0"),
        ("100 % and 50 % random: novice 2, 50 %", f"{0.2 * alone:.1f}", f"{0.2 * guarded:.1f}", "1.0", "1.0"),
    ]
    assert len(table.rows) == 4


@pytest.fixture
def filmed(monkeypatch, tmp_path):
    """Tells what is asked to be filmed of some runs."""

    def asked_of(runs):
        asked = {}
        monkeypatch.setattr(film, "render_episode", lambda path, spec, **_: asked.update(path=path, spec=spec))
        path, caption = make_film(runs, tmp_path)
        assert asked["path"] == path == tmp_path / "report.mp4"
        return asked, caption

    return asked_of


def test_a_run_in_the_house_is_filmed_before_one_in_the_grid(run, filmed, tmp_path):
    grid = report.read_run(write_run(tmp_path / "grid", plan=TINY))
    house = report.read_run(run)
    assert filmed([grid, house])[0]["spec"].plan == PAPER
    asked, caption = filmed([grid])
    assert (asked["spec"].plan, str(asked["spec"].family)) == (TINY, "0.25")
    assert caption == "Episode 0 with the children of the run in the grid, 25 % random, caregiver paper"
