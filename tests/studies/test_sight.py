"""The study of sight, in a tiny house."""

import pytest

import study
from studies import sight

HOUSE = "#########\n#S..#..B#\n#...#..C#\n#.......#\n#B..#..T#\n#########\n"


@pytest.mark.slow
def test_its_page(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sight, "CHILDREN", ("0.5", "seeker:0.25"))
    house = tmp_path / "tiny.txt"
    house.write_text(HOUSE)
    options = ["--sights", "all", "walls", "rooms:1", "--fewer", str(house)]
    options += ["--episodes", "2", "--children", "1", "--jobs", "1"]
    folders = ["--runs", str(tmp_path / "runs"), "--docs", str(tmp_path)]
    assert study.main(["sight", "--houses", str(house), *options, *folders]) == 0
    page = capsys.readouterr().out
    assert page == (tmp_path / "sight.md").read_text()
    for row in ("| walls | 0.", "| rooms:1 | 0.", "| never goes to look |"):
        assert row in page
    for table, row in {
        "damage": "walls,foresight,",
        "time": "walls,looking,",
        "sizes": "walls,20 to 20,",
        "belief": "walls,seeker:0.25,",
    }.items():
        assert f"\n{row}" in (tmp_path / f"sight_{table}.csv").read_text()
        assert f"(sight_{table}.csv)" in page
    assert {path.name for path in tmp_path.glob("*.svg")} == {"sight.svg", "sight_belief.svg"}
