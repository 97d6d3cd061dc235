"""What a shell makes of a tab, as somebody would type it, and what `caregiver-mj list` prints."""

import dataclasses
import importlib.metadata
import json
import subprocess
import sys

import pytest

from caregiver_mj import cli
from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.cli import listing
from caregiver_mj.robot.embodiments import find_embodiment

_LOADED = """
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_shtab_caregiver_mj 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def bash(tmp_path_factory):
    """What bash offers for the last of some words."""
    folder = tmp_path_factory.mktemp("completion")
    path = folder / "caregiver-mj"
    path.write_text(listing.script("bash"))

    def offered(*words):
        command = ["bash", "--norc", "-c", f"source {path}\n{_LOADED}", "bash", "caregiver-mj", *words]
        found = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
        return set(found.stdout.split())

    return offered


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["ev"], {"evaluate"}),
        (["re"], {"render", "report", "record"}),
        (["evaluate", "--caregiver", "none", "kn"], {"knows-goal"}),
        (["evaluate", "--houses", "te"], {"test-100", "tenement", "terrace"}),
        (["render", "--child", "ad"], {"adversary"}),
        (["house", "export", "--robot", "mobile_f"], {"mobile_fr3"}),
    ],
)
def test_words_are_completed(bash, words, offered):
    assert bash(*words) == offered


@pytest.mark.parametrize("arguments", [["completion", "bash"], ["--help"]])
def test_neither_help_nor_completion_needs_the_simulator(arguments):
    code = f"""if True:
        import sys
        from caregiver_mj import cli
        try:
            cli.main({arguments})
        finally:
            print(sorted({{"mujoco", "dm_control"}} & set(sys.modules)))
    """
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines()[-1] == "[]"


def butler():
    """butler of ours"""
    return dataclasses.replace(find_embodiment("mobile_ur5e"), name="butler")


class Nanny(NearestCaregiver):
    """Sings."""


def listed(capsys, what):
    """What is printed: a line by name."""
    assert cli.main(["list", what]) == 0
    lines = capsys.readouterr().out.splitlines()
    return dict(line.split(maxsplit=1) for line in lines)


@pytest.mark.parametrize(
    ("what", "some"),
    [
        ("caregivers", {"none", "expected-danger", "foresight", "floor", "person"}),
        ("children", {"novice", "toddler", "adversary"}),
        ("houses", {"paper", "home", "hall-SEED"}),
        ("robots", {"mobile_fr3", "mobile_ur5e"}),
        ("tasks", {"supervise", "relocate_candle", "block_stairs"}),
        ("sets", {"test-N", "home-train-N", "drawn-N"}),
    ],
)
def test_a_line_on_each_name(capsys, what, some):
    found = listed(capsys, what)
    assert found.keys() >= some
    assert list(found) == sorted(found)
    assert all(found.values())
    assert cli.main(["list", what, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found


def test_other_packages_are_listed_and_those_that_fail_say_why(capsys, monkeypatch):
    values = (("nanny", f"{__name__}:Nanny"), ("broken", "no.such.module:Nanny"))
    offered = [importlib.metadata.EntryPoint(*value, "caregiver_mj.caregivers") for value in values]
    offered.append(importlib.metadata.EntryPoint("ours", f"{__name__}:butler", "caregiver_mj.embodiments"))
    points = importlib.metadata.EntryPoints(offered)
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: points.select(group=group))
    assert find_embodiment("ours").name == listed(capsys, "robots")["ours"].split()[0] == "butler"
    found = listed(capsys, "caregivers")
    assert found["nanny"].startswith("Sings. (from ")
    assert "cannot be loaded" in found["broken"]
    assert "guard" in found
