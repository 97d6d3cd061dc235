"""What a user gets: the wheel, installed, and used outside the checkout."""

import email
import importlib.metadata
import subprocess
import sys
import tomllib
import zipfile

import pytest
from packaging.requirements import Requirement
from wheels import FOLDERS, ROOT, build_wheel

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = SETTINGS["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return build_wheel(tmp_path_factory.mktemp("dist"))


def test_all_that_dm_control_requires_is_named_where_pip_cannot_install_it():
    """But for labmaze, which has no wheel from Python 3.13 on."""
    required = map(Requirement, importlib.metadata.requires("dm_control"))
    needed = {one.name.lower() for one in required if not one.marker or one.marker.evaluate({"extra": ""})}
    named = map(Requirement, PROJECT["dependencies"])
    there = {one.name.lower() for one in named if not one.marker or one.marker.evaluate({"python_version": "3.13"})}
    assert "labmaze" in needed
    assert needed - {"labmaze"} <= there
    assert not {"labmaze", "dm_control"} & there


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


def test_no_generic_name_leaks_from_the_checkout(tmp_path):
    code = "import importlib.util as u; print([u.find_spec(n) for n in ('tasks', 'models', 'tests', 'scripts')])"
    command = [sys.executable, "-I", "-c", code]
    assert (
        subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stdout == f"{[None] * 4}\n"
    )
