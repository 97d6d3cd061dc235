"""The documentation: it builds without a warning, has what is made of the code, and takes nothing from the network."""

import html
import pathlib
import re
import subprocess
import sys

import pytest

import caregiver_mj
from caregiver_mj.caregivers.registry import CAREGIVERS
from caregiver_mj.children.family import CHILDREN
from caregiver_mj.experiments.settings import FLOOR
from caregiver_mj.interventions.registry import VERBS
from caregiver_mj.recording.record import COLUMNS

DOCS = pathlib.Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "-n", "--keep-going", "-d", folder / "trees", DOCS]
    result = subprocess.run([*build, folder / "html"], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    return folder / "html"


def shown(site, page):
    """The text of a page."""
    article = re.search(r"<article.*?</article>", (site / page).read_text("utf-8"), re.S).group()
    return html.unescape(re.sub(r"<[^>]+>", "", article))


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


def test_tables_are_made_of_the_code(site):
    columns = shown(site, "reference/columns.html")
    assert all(column.name in columns and column.meaning.replace("`", "") in columns for column in COLUMNS)
    options = shown(site, "reference/options.html")
    for option in ("--houses SET|NAME ...", "--overlay danger", "--damage S:C:T", "--resume", "--still FILE.png"):
        assert option in options
    assert "caregiver-mj house make" in options
    assert "--seed SEED 0 of the run" in " ".join(options.split())
    tasks = shown(site, "reference/tasks.html")
    for task in caregiver_mj.ALL_TASKS:
        assert task in tasks
        env = caregiver_mj.load(task, visuals=False)
        assert all(key in tasks for key in env.observation_spec())
        assert all(name in tasks for name in env.action_spec().name.split("\t"))
    assert "hazard_nearness_to_caregiver" in shown(site, "guide/gymnasium.html")


def test_a_formula_is_drawn_by_the_browser_alone(site):
    page = (site / "guide" / "model.html").read_text("utf-8")
    assert page.count("<math") > 20
    assert not re.search(r"<script[^>]*mathjax", page, re.I)


@pytest.mark.parametrize(
    ("page", "names"),
    [("caregivers", [*CAREGIVERS, FLOOR]), ("children", CHILDREN), ("interventions", VERBS)],
)
def test_everything_that_has_a_name_is_explained(page, names):
    text = (DOCS / "guide" / f"{page}.md").read_text("utf-8")
    explained = re.findall(r"^\| (`.*?) \|", text, re.M)
    found = {name for row in explained for name in re.findall("`([^`]+)`", row)}
    assert {name for name in found if ":" not in name} == set(names)


def test_links_of_pages_outside_lead_somewhere():
    root = DOCS.parent
    for page in ("README.md", "CONTRIBUTING.md", "examples/README.md"):
        links = re.findall(r"\]\(([^)#]+)[^)]*\)", (root / page).read_text("utf-8"))
        local = [link for link in links if not link.startswith("http")]
        assert local
        assert [link for link in local if not (root / page).parent.joinpath(link).exists()] == []
