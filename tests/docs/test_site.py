"""The documentation: it builds without a warning, has tables as the code is, and takes nothing from the network."""

import dataclasses
import pathlib
import re
import subprocess
import sys

import pytest
import tables

import caregiver_mj
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import CAREGIVERS
from caregiver_mj.children.behaviour import Sight
from caregiver_mj.children.family import CHILDREN
from caregiver_mj.experiments.settings import FLOOR
from caregiver_mj.interventions.verb import VERBS
from caregiver_mj.recording.record import COLUMNS

DOCS = pathlib.Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "-n", "--keep-going", "-d", folder / "trees", DOCS]
    result = subprocess.run([*build, folder / "html"], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    return folder / "html"


def markdown(page):
    """A page as it can be read in the repository."""
    return (DOCS / page).read_text("utf-8")


def test_every_page_is_there(site):
    for path in DOCS.rglob("*.md"):
        if "_build" not in path.parts:
            assert (site / path.relative_to(DOCS)).with_suffix(".html").is_file()


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


def test_tables_name_everything_that_there_is():
    columns, options, tasks = (markdown(f"reference/{page}.md") for page in ("columns", "options", "tasks"))
    assert all(f"| `{column.name}` |" in columns and column.meaning in columns for column in COLUMNS)
    for option in (
        "--houses SET\\|NAME ...",
        "--overlay danger",
        "--damage KIND=D,...",
        "--resume",
        "--still FILE.png",
    ):
        assert f"| `{option}` |" in options
    assert "## caregiver-mj house make" in options
    assert "| `--seed SEED` | `0` | seed of the run" in options
    for task in caregiver_mj.ALL_TASKS:
        env = caregiver_mj.load(task, visuals=False)
        names = [task, *env.observation_spec(), *env.action_spec().name.split("\t")]
        assert all(f"| `{name}` |" in tasks for name in names)
    assert "| `hazard_nearness_to_caregiver` |" in markdown("guide/gymnasium.md")


def test_a_formula_is_drawn_by_the_browser_alone(site):
    page = (site / "guide" / "model.html").read_text("utf-8")
    assert page.count("<math") > 20
    assert not re.search(r"<script[^>]*mathjax", page, re.I)


@pytest.mark.parametrize(
    ("page", "names"), [("caregivers", [*CAREGIVERS, FLOOR]), ("children", CHILDREN), ("interventions", VERBS)]
)
def test_everything_that_has_a_name_is_explained(page, names):
    text = (DOCS / "guide" / f"{page}.md").read_text("utf-8")
    explained = re.findall(r"^\| (`.*?) \|", text.partition("\n## ")[0], re.M)
    found = {name for row in explained for name in re.findall("`([^`]+)`", row)}
    assert {name for name in found if ":" not in name} == set(names)


@pytest.mark.parametrize(("page", "given"), [("caregivers", Percept), ("children", Sight)])
def test_all_that_is_given_is_explained(page, given):
    explained = re.findall(r"^\| (`.*?) \|", (DOCS / "guide" / f"{page}.md").read_text("utf-8"), re.M)
    found = {name for row in explained for name in re.findall("`([^`]+)`", row)}
    assert {field.name for field in dataclasses.fields(given)} <= found


def test_files_that_the_architecture_names_are_there():
    named = re.findall(r"`([a-z_/]+(?:\.py|/))`", (DOCS / "guide" / "architecture.md").read_text("utf-8"))
    folders = DOCS.parent, DOCS.parent / "caregiver_mj"
    assert len(named) > 20
    assert [file for file in named if not any((folder / file).exists() for folder in folders)] == []


def test_links_of_pages_outside_lead_somewhere():
    root = DOCS.parent
    for page in ("README.md", "CONTRIBUTING.md", "examples/README.md"):
        links = re.findall(r"(?:\]\(|src=\")([^)#\"]+)", (root / page).read_text("utf-8"))
        local = [link for link in links if not link.startswith("http")]
        assert local
        assert [link for link in local if not (root / page).parent.joinpath(link).exists()] == []
