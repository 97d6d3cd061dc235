"""Value tables come from the user's cache folder if the same code has made them for the same house."""

import os

import numpy as np
import pytest

from caregiver_mj.caregivers.foresight import cache, value_table
from caregiver_mj.caregivers.foresight.value_table import Objective, value_tables
from caregiver_mj.plans.floor_plan import FloorPlan

HOUSE = FloorPlan.parse("#######\n#B.G..#\n#.....#\n#C.o.T#\n#######", "kept")
OBJECTIVE = Objective(sweeps=5)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of the tables, in one that another file is in."""
    monkeypatch.setenv(cache.FOLDER, str(tmp_path))
    (tmp_path / "mine.parquet").write_bytes(bytes(300))
    os.utime(tmp_path / "mine.parquet", (0, 0))
    yield tmp_path / "value_tables"
    assert (tmp_path / "mine.parquet").exists()


def tables(plan=HOUSE):
    """As a process has them that has made none yet."""
    value_tables.cache_clear()
    return value_tables(plan, objective=OBJECTIVE)


def test_a_table_from_a_file_is_the_same_to_the_last_bit(folder, monkeypatch):
    made = tables()
    assert len(list(folder.iterdir())) == 1
    monkeypatch.setattr(value_table, "_made", lambda *_: pytest.fail("made anew"))
    found = tables()
    assert found.keys() == made.keys()
    source, table, child = np.zeros(3, int), np.ones(3, int), np.arange(3)
    for shut, one in made.items():
        other = found[shut]
        for name in ("value", "staying", "taken", "others", "going", "picked"):
            np.testing.assert_array_equal(getattr(other, name), getattr(one, name))
        carried = [some.carried(source, source, table, child, source, np.zeros(3)) for some in (one, other)]
        np.testing.assert_array_equal(*carried)
        assert other.plan is HOUSE


def test_another_house_other_code_and_a_damaged_file_are_not_mistaken_for_it(folder, monkeypatch):
    tables()
    tables(FloorPlan.parse("\n".join(HOUSE.rows), "kept", damage="5:4:2"))
    assert len(list(folder.iterdir())) == 2
    monkeypatch.setattr(cache, "_code", lambda: "other")
    value = tables()[frozenset()].value
    assert len(list(folder.iterdir())) == 3
    for file in folder.iterdir():
        file.write_bytes(file.read_bytes()[:-99])
    np.testing.assert_array_equal(tables()[frozenset()].value, value)


def test_what_was_used_longest_ago_goes_first(folder, monkeypatch):
    monkeypatch.setattr(cache, "LARGEST", 250)
    for key in "ab":
        cache.cached(key, lambda: bytes(100))
        for file in folder.iterdir():
            os.utime(file, (0, file.stat().st_mtime - 100))
    for key in "ac":
        cache.cached(key, lambda: bytes(100))
    made = []
    for key in "acb":
        cache.cached(key, lambda key=key: made.append(key) or b"")
    assert made == ["b"]


def test_it_does_without(tmp_path, monkeypatch):
    for folder in ("", str(tmp_path / "file" / "in the way")):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv(cache.FOLDER, folder)
        assert cache.cached("key", lambda: 1) == 1
    assert [file.name for file in tmp_path.iterdir()] == ["file"]
