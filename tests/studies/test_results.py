"""README's first claim is what the tables in the documentation say, and the report's tables become CSV."""

import pathlib

from studies.results import main_results, write_readme

ROOT = pathlib.Path(__file__).parents[2]


def test_readme_has_what_the_tables_say(tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text((ROOT / "README.md").read_text("utf-8"), "utf-8")
    write_readme(ROOT / "docs", readme)
    assert readme.read_text("utf-8") == (ROOT / "README.md").read_text("utf-8")
    # In docs/results/tables/harm_by_hazards.csv harm could be shown in 278 to 282 of the 500 conditions of `test-100`.
    assert "550 conditions" in " ".join(main_results(ROOT / "docs").split())
