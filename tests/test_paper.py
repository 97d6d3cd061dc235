"""`caregiver-mj paper`: the paper's numbers beside those of `evaluate` with the same seed."""

import json

import pytest

from caregiver_mj import cli


def test_the_papers_tables_beside_ours(capsys):
    which = ["--episodes", "4", "--seed", "3", "--json"]
    assert cli.main(["paper", *which]) == 0
    out, err = capsys.readouterr()
    tables = json.loads(out, parse_constant=pytest.fail)  # NaN is no JSON
    assert cli.main(["evaluate", "--world", "grid", "--house", "paper", *which]) == 0
    summary = json.loads(capsys.readouterr().out)
    damage, timesteps = ({(r["epsilon"], r["quantity"]): r for r in rows} for rows in tables.values())
    assert (len(damage), len(timesteps)) == (15, 10)  # five novices; without, with, and what is left
    rows = {(row["family"], {"none": "without"}.get(row["caregiver"], "with")): row for row in summary["rows"]}
    for found, column in ((damage, "damage_normalised"), (timesteps, "timesteps_to_threshold")):
        for key, row in rows.items():
            assert found[key]["here"] == row[f"{column}_mean"]
            assert [found[key]["low"], found[key]["high"]] == [row[f"{column}_ci_low"], row[f"{column}_ci_high"]]
    assert damage["0.5", "with"]["paper"] == 0.1106  # as printed in its Table I
    assert damage["0.5", "left"]["paper"] == pytest.approx(0.3886, abs=1e-4)  # 0.1106 / 0.2846
    assert timesteps["0.75", "without"]["paper"] == 41.05  # Table II
    for row in (*damage.values(), *timesteps.values()):
        assert row["deviation"] == pytest.approx(row["here"] - row["paper"])
    assert damage["1", "left"]["here"] == pytest.approx(damage["1", "with"]["here"] / damage["1", "without"]["here"])
    printed = [line.split() for line in err.splitlines()]  # the tables beside it
    assert [line[-2] for line in printed if line[:2] == ["0.5", "with"]] == ["0.111", "171.5"]
    assert "It is the one of many plans that came closest" in err
