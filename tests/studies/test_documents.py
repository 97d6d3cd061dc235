"""Pages in docs/: paragraphs, tables and files."""

from matplotlib.figure import Figure

from caregiver_mj.studies.documents import fill, table, write_page


def test_paragraphs_keep_words_whole():
    text = fill("- " + "word-with-hyphens " * 20, "  ")
    assert all(len(line) <= 120 for line in text.splitlines())
    assert text.splitlines()[1].startswith("  word-with-hyphens")


def test_table():
    assert table(("a", "b"), [("x", "1")]) == "| a | b |\n| --- | ---: |\n| x | 1 |"


def test_a_page_and_its_figures(tmp_path):
    write_page(tmp_path / "docs", "page", "text\n", Figure(), ("png", "svg"))
    assert {path.name for path in (tmp_path / "docs").iterdir()} == {"page.md", "page.png", "page.svg"}
    assert (tmp_path / "docs" / "page.md").read_text() == "text\n"
