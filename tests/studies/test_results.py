"""The results of the documentation: which runs there are, and what is published of them."""

import pathlib

import pandas as pd
import pytest

from caregiver_mj import cli
from studies.results import CHILDREN, RUNS, command, publish


@pytest.mark.parametrize("name", [*RUNS, *CHILDREN])
def test_every_run_could_be_run(name, capsys, tmp_path):
    asked = command(tmp_path, name, 2)
    assert asked[0] == "evaluate"
    assert asked[-5:] == ["--jobs", "2", "--out", str(tmp_path / name), "--resume"]
    # All else is checked before the number of episodes is.
    assert cli.main([*asked, "--episodes", "0"]) == 2
    assert "episodes must be an integer of at least 1, got 0" in capsys.readouterr().err
    assert not (tmp_path / name).exists()


def test_tables_figures_and_houses_are_published(tmp_path):
    report, house, docs = tmp_path / "run", tmp_path / "house-ten", tmp_path / "docs"
    (report / "figures").mkdir(parents=True)
    for name in ("figures/damage.svg", "figures/damage.png", "figures/map.png"):
        (report / name).write_text(name)
    (report / "tables.md").write_text("# Tables\n![Damage](figures/damage.png)\n")
    pd.DataFrame({"house": ["house-1"], "damage_left": [1 / 3]}).to_parquet(report / "houses.parquet")
    house.mkdir()
    pd.DataFrame({"house": ["paper"], "harm_verdict": ["more"]}).to_parquet(house / "houses.parquet")
    (docs / "results").mkdir(parents=True)
    (docs / "results" / "stale.png").write_text("of an earlier report")
    publish([report, house], docs, "results")
    found = sorted(str(path.relative_to(docs)) for path in docs.rglob("*") if path.is_file())
    assert found == [
        "results/README.md",
        "results/figures/damage.png",
        "results/houses.csv",
        "results/houses_house-ten.csv",
    ]
    assert (docs / "results" / "README.md").read_text() == "# Tables\n![Damage](figures/damage.png)\n"
    assert pathlib.Path(docs / "results" / "houses.csv").read_text() == "house,damage_left\nhouse-1,0.3333\n"
    assert pathlib.Path(docs / "results" / "houses_house-ten.csv").read_text() == "house,harm_verdict\npaper,more\n"
