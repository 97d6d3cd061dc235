"""What the source distribution and the wheel hold beside the package, and what they and the citation say of it."""

import email
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile

import pytest
import yaml

ROOT = pathlib.Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# What is made in a checkout, and must not lie in what is built from it.
MADE = (".git", ".*_cache", ".hypothesis", ".venv", "__pycache__", "*.egg-info", "_build", "build", "runs")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the source distribution, and of the wheel that is built from it."""
    source, out = tmp_path_factory.mktemp("source") / "checkout", tmp_path_factory.mktemp("dist")
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*MADE))
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", out, source]
    subprocess.run(build, check=True, capture_output=True)
    return out


def test_source_distribution_holds_what_is_needed_to_test_it(built):
    (path,) = built.glob("*.tar.gz")
    with tarfile.open(path) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    here = pathlib.Path(__file__).relative_to(ROOT).as_posix()
    wanted = {"caregiver_mj/py.typed", "models/houses/paper.txt", "scripts/test", ".ci/run", here}
    wanted |= {"docs/guide/start.md", "examples/README.md"}
    wanted |= {path.name for path in ROOT.iterdir() if path.suffix in (".cff", ".md", ".toml", ".txt")}
    assert wanted <= names
    assert not [name for name in names if name.endswith((".pyc", ".tmp")) or name.startswith((".git/", ".venv"))]


def test_wheel_says_what_it_is(built):
    (path,) = built.glob("*.whl")
    with zipfile.ZipFile(path) as file:
        (metadata,) = (name for name in file.namelist() if name.endswith(".dist-info/METADATA"))
        told, names = email.message_from_bytes(file.read(metadata)), file.namelist()
    assert (told["Name"], told["Version"]) == ("caregiver_mj", PROJECT["version"])
    assert (told["License-Expression"], told["License-File"]) == (PROJECT["license"], "LICENSE")
    assert metadata.replace("METADATA", "licenses/LICENSE") in names
    assert set(told["Requires-Python"].split(",")) == set(PROJECT["requires-python"].split(","))
    assert told.get_all("Project-URL") == [f"{name}, {url}" for name, url in PROJECT["urls"].items()]
    assert set(told.get_all("Provides-Extra")) == set(PROJECT["optional-dependencies"])
    assert told.get_payload().strip() == (ROOT / "README.md").read_text(encoding="utf-8").strip()
    assert not [name for name in names if name.startswith(("tests/", "docs/", "examples/", "scripts/"))]


def test_citation_is_of_software_and_paper():
    told = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= told.keys()
    assert (told["type"], told["license"]) == ("software", PROJECT["license"])
    (paper,) = told["references"]
    assert paper["type"] == "conference-paper"
    assert [author["family-names"] for author in paper["authors"]] == ["Rosman", "Hayes", "Scassellati"]
    assert paper["url"] == PROJECT["urls"]["Paper"]
