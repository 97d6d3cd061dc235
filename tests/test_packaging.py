"""What a user gets: the wheel, built from the source distribution, installed, and used outside the checkout."""

import email
import importlib.util
import os
import pathlib
import subprocess
import sys
import tarfile
import tomllib
import zipfile

import pytest
import yaml
from packaging.specifiers import SpecifierSet
from wheels import FOLDERS, ROOT, build_wheel, environment_with

import caregiver_mj
from caregiver_mj import cli

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = SETTINGS["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return build_wheel(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory):
    return environment_with(wheel, tmp_path_factory.mktemp("environment"))


def run(python, code, cwd):
    """Runs code in isolation: neither the current folder nor the environment's variables count."""
    return subprocess.run([python, "-I", "-c", code], cwd=cwd, capture_output=True, text=True, check=False)


def test_wheel_holds_every_file_and_says_what_it_is(wheel):
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        told = email.message_from_bytes(file.read(metadata))
    wanted, packages = set(), set()
    for folder, package in FOLDERS.items():
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".typed", ".xml", ".txt", ".png", ".html", ".css") or path.name == "README.md":
                wanted.add(f"{package.replace('.', '/')}/{path.relative_to(ROOT / folder).as_posix()}")
            if path.suffix == ".py":
                packages.add(".".join([package, *path.parent.relative_to(ROOT / folder).parts]))
    assert {"caregiver_mj/models/houses/paper.txt", "caregiver_mj/py.typed"} <= wanted
    assert wanted <= names
    assert set(SETTINGS["tool"]["setuptools"]["packages"]) == packages
    assert {name.split("/")[0] for name in names} == {"caregiver_mj", metadata.partition("/")[0]}
    assert not [name for name in names if name.endswith((".pyc", ".tmp"))]
    assert (told["Name"], told["Version"]) == ("caregiver_mj", PROJECT["version"])
    assert (told["License-Expression"], told["License-File"]) == (PROJECT["license"], "LICENSE")
    assert metadata.replace("METADATA", "licenses/LICENSE") in names
    assert set(told["Requires-Python"].split(",")) == set(PROJECT["requires-python"].split(","))
    assert told.get_all("Project-URL") == [f"{name}, {url}" for name, url in PROJECT["urls"].items()]
    assert set(told.get_all("Provides-Extra")) == set(PROJECT["optional-dependencies"])
    assert told.get_payload().strip() == (ROOT / "README.md").read_text(encoding="utf-8").strip()


def test_source_distribution_holds_what_is_needed_to_test_it(wheel):
    (path,) = wheel.parent.glob("*.tar.gz")
    with tarfile.open(path) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    wanted = {"caregiver_mj/py.typed", "models/houses/paper.txt", "scripts/test", ".ci/run", "tests/test_packaging.py"}
    wanted |= {"docs/guide/start.md", "examples/README.md"}
    wanted |= {path.name for path in ROOT.iterdir() if path.suffix in (".cff", ".md", ".toml", ".txt")}
    assert wanted <= names
    assert not [name for name in names if name.endswith((".pyc", ".tmp")) or name.startswith((".git/", ".venv"))]


def test_installed_package_and_command_work_outside_the_checkout(python, tmp_path):
    code = "import caregiver_mj as c, caregiver_mj.models, caregiver_mj.tasks; print(c.__file__)"
    result = run(python, code, tmp_path)
    assert result.returncode == 0, result.stderr
    assert pathlib.Path(result.stdout.strip()).is_relative_to(python.parents[1])
    command = [python.parent / "caregiver-mj", "house", "check", "paper"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("OK: paper")


def test_no_generic_name_leaks(python, tmp_path):
    code = "import importlib.util as u; print([u.find_spec(n) for n in ('tasks', 'models', 'tests', 'scripts')])"
    for interpreter in (python, sys.executable):  # nor from the editable installation of the checkout
        assert run(interpreter, code, tmp_path).stdout == "[None, None, None, None]\n"


def test_version_is_the_same_wherever_it_is_told(capsys):
    version = PROJECT["version"]
    assert caregiver_mj.__version__ == version
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"caregiver-mj {version}\n"
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {version}" in (ROOT / "CHANGELOG.md").read_text()


@pytest.fixture(scope="module")
def resolve():
    spec = importlib.util.spec_from_file_location("resolve", ROOT / "scripts" / "resolve.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_pythons_that_are_checked_are_those_that_are_said(resolve):
    known = SpecifierSet(PROJECT["requires-python"])
    assert all(known.contains(python) for python in resolve.PYTHONS)
    assert not known.contains("3.10")
    assert not known.contains("3.13")  # labmaze, which dm_control needs, cannot be installed there
    minor = "Programming Language :: Python :: 3."
    said = [line.removeprefix(minor) for line in PROJECT["classifiers"] if line.startswith(minor)]
    assert said == [python.split(".")[1] for python in resolve.PYTHONS]
    for extra in ("docs", "learn", "test"):
        assert set(PROJECT["optional-dependencies"][extra]) <= set(resolve.requirements())


def test_a_constraint_that_asks_for_a_newer_python_is_found(resolve, tmp_path, monkeypatch):
    links = []
    (tmp_path / "soup").mkdir()
    for version, python in (("1.0", "&gt;=3.9"), ("2.0", "&gt;=3.11.5")):
        file = tmp_path / "soup" / f"soup-{version}-py3-none-any.whl"
        links.append(f'<a href="{file.name}" data-requires-python="{python}">{file.name}</a>')
        with zipfile.ZipFile(file, "w") as wheel:
            info = f"soup-{version}.dist-info"
            wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: soup\nVersion: {version}\n")
            wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
            wheel.writestr(f"{info}/RECORD", "")
    (tmp_path / "soup" / "index.html").write_text(f"<!DOCTYPE html><html><body>{''.join(links)}</body></html>")
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_INDEX_URL", tmp_path.as_uri())
    constraints = tmp_path / "constraints.txt"
    constraints.write_text("soup==1.0\n")
    assert resolve.resolve("3.11.2", constraints, ["soup"]) == ""
    constraints.write_text("soup==2.0\n")
    assert resolve.resolve("3.11.7", constraints, ["soup"]) == ""
    assert "soup==2.0" in resolve.resolve("3.11.2", constraints, ["soup"])


def test_constraints_are_plain_exact_versions():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert lines
    for line in lines:
        name, _, version = line.partition("==")
        assert name.replace("-", "").replace("_", "").isalnum(), line
        assert version.replace(".", "").isalnum(), line


def test_citation_is_of_software_and_paper():
    told = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= told.keys()
    assert (told["type"], told["license"]) == ("software", PROJECT["license"])
    (paper,) = told["references"]
    assert paper["type"] == "conference-paper"
    assert [author["family-names"] for author in paper["authors"]] == ["Rosman", "Hayes", "Scassellati"]
    assert paper["url"] == PROJECT["urls"]["Paper"]
