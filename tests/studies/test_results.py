"""README's first claim is what the tables in the documentation say, and the report's tables become CSV."""

import pathlib

import pandas as pd

from studies.results import by_chance, main_results, publish, write_readme

ROOT = pathlib.Path(__file__).parents[2]


def test_readme_has_what_the_tables_say(tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text((ROOT / "README.md").read_text("utf-8"), "utf-8")
    write_readme(ROOT / "docs", readme)
    assert readme.read_text("utf-8") == (ROOT / "README.md").read_text("utf-8")
    # In docs/results/tables/harm_by_hazards.csv harm could be shown in 278 to 282 of the 500 conditions of `test-100`.
    assert "550 conditions" in " ".join(main_results(ROOT / "docs").split())


def test_chance_is_what_the_papers_few_episodes_allow():
    # Ours of 2,000 episodes is 0.01 wide to either side; of 20 it is ten times as wide: 0.3 to 0.5.
    found = [by_chance(theirs, [0.4, 0.39, 0.41], 2000) for theirs in (0.29, 0.31, 0.49, 0.51)]
    assert found == [False, True, True, False]


def test_published_houses_of_the_grid_lack_what_only_the_house_counts(tmp_path):
    for world in ("grid", "house"):
        (tmp_path / world).mkdir()
        table = pd.DataFrame({"world": [world], "damage": [1.0], "strikes": [0.0], "wall_seconds": [9.0]})
        table.to_parquet(tmp_path / world / "houses.parquet")
    publish([], [tmp_path / "grid", tmp_path / "house"], tmp_path, "of")
    assert (tmp_path / "of/houses_grid.csv").read_text("utf-8") == "world,damage\ngrid,1.0\n"
    assert (tmp_path / "of/houses_house.csv").read_text("utf-8") == "world,damage,strikes\nhouse,1.0,0.0\n"
