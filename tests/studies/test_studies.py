"""All studies: they look at the rest of the package from outside, and each has a command that explains itself."""

import ast
import pathlib
import runpy
import sys

import pytest

import caregiver_mj.studies

FOLDER = pathlib.Path(caregiver_mj.studies.__file__).parent
SCRIPTS = pathlib.Path(__file__).parents[2] / "scripts"
COMMANDS = sorted(path for path in SCRIPTS.glob("*.py") if "caregiver_mj.studies" in path.read_text(encoding="utf-8"))


def private_uses(source):
    """Private attributes of anything but the object itself, and private names from other modules."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id == "self"):
            found.append(node.attr)
        elif isinstance(node, ast.ImportFrom):
            found += [alias.name for alias in node.names]
    return [name for name in found if name.startswith("_") and not name.endswith("__")]


def test_private_uses_are_found():
    assert private_uses("self._x\nself.a.b\nrobot.__dict__\nprint(_y)") == []
    assert private_uses("from m import _f\nself.policy._skill\nrobot._x = 1") == ["_f", "_skill", "_x"]


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: str(path.relative_to(FOLDER)))
def test_a_study_uses_nothing_private_of_others(path):
    assert private_uses(path.read_text(encoding="utf-8")) == []


def test_every_study_has_a_script():
    studies = {path.parent for path in FOLDER.glob("*/command.py")}
    studies |= {path for path in FOLDER.glob("*.py") if "def main(" in path.read_text(encoding="utf-8")}
    assert {path.stem for path in studies} == {path.stem for path in COMMANDS}


@pytest.mark.parametrize("script", COMMANDS, ids=lambda path: path.stem)
def test_a_script_explains_itself(script, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [str(script), "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(script), run_name="__main__")
    assert end.value.code == 0
    assert "options:" in capsys.readouterr().out
