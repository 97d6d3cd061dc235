"""The documentation: it builds without a warning, has tables as the code is, and takes nothing from the network."""

import argparse
import html
import json
import pathlib
import re
import subprocess
import sys

import api_pages
import gallery
import numpy as np
import paper_figures
import pytest
import reproduce
import tables
from mdit_py_plugins.anchors.index import slugify
from PIL import Image

from caregiver_mj.caregivers.registry import CAREGIVERS, PLAYERS
from caregiver_mj.children.child_group import CHILDREN
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.interventions.verb import VERBS
from caregiver_mj.plans.sets import house_set
from caregiver_mj.tasks import TASKS
from studies import results

DOCS = pathlib.Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "-n", "--keep-going", "-d", folder / "trees", DOCS]
    result = subprocess.run([*build, folder / "html"], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    return folder / "html"


@pytest.mark.slow
def test_nothing_comes_from_the_network(site):
    tags = re.compile(r"""<(?:script|img|iframe|source|video)\b[^>]*\bsrc="([^"]*)|<link\b[^>]*\bhref="([^"]*)""")
    styles = re.compile(r"""(?:url\(|@import )\s*["']?([^"')]*)""")
    found = [
        address
        for path in [*site.rglob("*.html"), *site.rglob("*.css")]
        for match in (tags if path.suffix == ".html" else styles).findall(path.read_text("utf-8"))
        for address in (match if isinstance(match, tuple) else (match,))
    ]
    assert len(found) > 100
    assert [address for address in found if "//" in address and not address.startswith("data:")] == []


def test_tables_are_as_the_code_is():
    """`python scripts/tables.py` writes them anew."""
    old = [
        str(page.relative_to(DOCS))
        for page in tables.PAGES
        if tables.filled(page.read_text("utf-8")) != page.read_text("utf-8")
    ]
    assert old == []
    api = {path.name: path.read_text("utf-8") for path in api_pages.FOLDER.iterdir()}
    assert api == api_pages.pages()


def test_every_environment_is_filmed_and_scored():
    assert {task.id for task in TASKS.values()} < {entry.id for entry in gallery.ENTRIES.values()}
    scored = [(row["environment"], row["policy"], row["house"]) for row in gallery.read_scores()]
    assert len(set(scored)) == len(scored)
    assert {row[:2] for row in scored} == {
        (name, who) for name, entry in gallery.ENTRIES.items() for who in entry.policies
    }
    for name in gallery.ENTRIES:
        path = gallery.FOLDER / f"{name}.gif"
        with Image.open(path) as film:
            assert (film.size, film.n_frames > 20, path.stat().st_size <= 250_000) == (gallery.SIZE, True, True)


def test_scores_are_those_of_the_code():
    """`python scripts/gallery.py scores` makes them anew; of the grid it is quick."""
    entry = gallery.ENTRIES["targets_grid"]
    for policy in entry.policies:  # in the house with most damage
        row = {"environment": "targets_grid", "policy": policy} | gallery.score(
            entry, policy, 2, house_set(gallery.SET)[2]
        )
        assert {key: str(value) for key, value in row.items()} in gallery.read_scores()


@pytest.mark.parametrize(
    ("page", "names"),
    [("caregivers", [*CAREGIVERS, BARE_TABLES, *PLAYERS]), ("children", CHILDREN), ("interventions", VERBS)],
)
def test_everything_that_has_a_name_is_explained(page, names):
    text = (DOCS / "guide" / f"{page}.md").read_text("utf-8")
    explained = re.findall(r"^\| (`.*?) \|", text.partition("\n## ")[0], re.M)
    found = {name for row in explained for name in re.findall("`([^`]+)`", row)}
    assert {name for name in found if ":" not in name} == set(names)


def test_the_results_are_what_tables_in_the_documentation_say():
    """`scripts/study.py results --docs docs` writes the page anew, `scripts/reproduce --mark` its marks."""
    page = results.run(argparse.Namespace(docs=None, runs=None, beside=None))
    assert reproduce.without_marks((DOCS / "results.md").read_text("utf-8")) == page.text("results", "")


def test_figures_of_the_results_show_the_tables_as_they_are():
    """`python scripts/paper_figures.py` draws them anew."""
    for file in paper_figures.FIGURES:
        picture = html.unescape((DOCS / file).read_text("utf-8"))
        assert json.dumps(paper_figures.tables(file)) in picture, file


@pytest.mark.parametrize(
    ("cell", "wanted"),
    [
        ("0.31 (0.19 to 1.97); 34 % (20 to 50)", [0.31, 0.19, 1.97]),
        ("0.31 [0.19, ∞]\n3.2 of 10.1", [0.31, 0.19, np.nan]),
        ("-0.31 (too few episodes for an interval)\n3.2 of 10.1", [-0.31, np.nan, np.nan]),
        ("0.46 (–); 34 % (20 to 50)", [0.46, np.nan, np.nan]),
        ("–", [np.nan, np.nan, np.nan]),
    ],
)
def test_figures_read_the_interval_of_a_cell_and_no_other_number(cell, wanted):
    np.testing.assert_array_equal(paper_figures.estimate(cell), wanted)


def test_links_lead_somewhere():
    root = DOCS.parent
    pages = [root / page for page in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "examples/README.md")]
    for page in [*pages, *DOCS.rglob("*.md")]:
        links = re.findall(r"(?:\]\(|src=\")([^)#\"]+)", page.read_text("utf-8"))
        local = [link for link in links if not link.startswith("http")]
        assert [link for link in local if not page.parent.joinpath(link).exists()] == [], page
        for file, heading in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text("utf-8")):
            titles = re.findall(r"^#+ (.*)", (page.parent / file if file else page).read_text("utf-8"), re.MULTILINE)
            assert heading in {slugify(title.replace("`", "")) for title in titles}, f"{page}: {file}#{heading}"


def test_pages_stay_short():
    """Words as `wc -w` has them, but for the marks of tables; API pages count in no limit."""
    root = DOCS.parent
    count = {
        path: len(re.findall(r"\S*\w\S*", path.read_text("utf-8")))
        for path in [*DOCS.rglob("*.md"), *root.glob("*.md")]
        if api_pages.FOLDER not in path.parents
    }
    assert count[root / "README.md"] <= 500
    assert count[DOCS / "guide/limits.md"] <= 1_000
    assert sum(count.values()) <= 24_000
