"""The rooms of the package: imports run one way, and the picture in the documentation shows them as they are."""

import html
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[1]


@pytest.fixture(scope="module")
def rooms():
    spec = importlib.util.spec_from_file_location("rooms", ROOT / "scripts" / "rooms.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def imports(rooms):
    return rooms.graph()


def test_imports_run_one_way(rooms, tmp_path):
    """By import-linter, of a package that is put together in a folder."""
    rooms.assemble(tmp_path)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"]
    there = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(tmp_path)}}
    found = subprocess.run(command, **there, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


def test_no_modules_import_each_other(rooms, imports):
    assert rooms.circles(imports) == []


def test_the_danger_model_needs_numpy_and_scipy_alone(imports):
    found = set()
    for module in imports.modules:
        if module.startswith("caregiver_mj.danger") and module != "caregiver_mj.danger.child_model":  # of a house
            found |= imports.find_modules_directly_imported_by(module)
    outside = {name.split(".")[0] for name in found if not name.startswith("caregiver_mj.danger")}
    standard = set(sys.stdlib_module_names)
    assert "numpy" in outside
    assert outside <= {"numpy", "scipy"} | standard


def test_the_picture_shows_the_rooms_as_they_are(rooms, imports):
    """If not: run scripts/rooms.py."""
    picture = html.unescape(rooms.PICTURE.read_text(encoding="utf-8"))
    found = rooms.arrows(imports)
    assert rooms.describe(found) in picture
    for layer in rooms.layers():
        for room in layer:
            assert f">{room}</text>" in picture
