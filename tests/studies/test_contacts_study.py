"""The study of contacts: its rows, how it goes on with them, and what it tells beside the tables."""

import json

import pytest

from studies import contacts
from study import main

HOUSE, FAMILY = "paper", "adversary:0"


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    return tmp_path_factory.mktemp("contacts") / "rows.jsonl"


@pytest.fixture(scope="module")
def options(rows):
    command = f"--houses {HOUSE} --epsilon {FAMILY} --episodes 1 --jobs 1 --audit 1 --out"
    return [*command.split(), str(rows)]


def told(row):
    return {name: value for name, value in row.items() if name not in ("cpu_seconds", "audit")}


def test_an_episode_is_the_same_with_an_audit_and_its_row_is_written_and_not_run_again(
    options, rows, capsys, monkeypatch
):
    assert main(["contacts", *options]) == 0
    first = capsys.readouterr().out
    (row,) = (json.loads(line) for line in rows.read_text().splitlines())
    plain = contacts.supervise(frozenset(), contacts.Job(None, "paper", False, HOUSE, FAMILY, 0))
    assert told(row) == json.loads(json.dumps(told(plain), default=float))
    assert row["skill_seconds"] > 1.0
    assert f"Longest skill: {row['skill_seconds']:.1f} s, {row['skill']} ({HOUSE}, {FAMILY}, episode 0)." in first
    assert "measured" in first

    def supervise(audited, job):
        raise AssertionError(f"{job} is run again")

    monkeypatch.setattr(contacts, "supervise", supervise)
    assert main(["contacts", *options]) == 0
    assert capsys.readouterr().out == first


def test_the_exit_status_says_that_a_limit_was_not_kept(options, rows, capsys):
    row = json.loads(rows.read_text())
    row["audit"]["measured"][0] |= {"worst": 7.0, "limit": 5.0, "where": "there"}
    rows.write_text(json.dumps(row) + "\n")
    assert main(["contacts", *options]) == 1
    assert "1.400" in capsys.readouterr().out
