"""`caregiver-mj list`, and what all commands have in common."""

import importlib.metadata
import json

import pytest

from caregiver_mj import cli
from caregiver_mj.caregivers.baselines import NearestCaregiver


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
    offered = importlib.metadata.EntryPoints(
        importlib.metadata.EntryPoint(name, value, "caregiver_mj.caregivers")
        for name, value in (("nanny", f"{__name__}:Nanny"), ("broken", "no.such.module:Nanny"))
    )
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: offered.select(group=group))
    found = listed(capsys, "caregivers")
    assert found["nanny"].startswith("Sings. (from ")
    assert "cannot be loaded" in found["broken"]
    assert "guard" in found
