"""What the planner expects, beside what then comes."""

import pytest

from caregiver_mj.caregivers.foresight.foresight import KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.value_table import Objective
from caregiver_mj.errors import CaregiverError
from studies import value
from study import fill_in, main

HOUSE = "house-600003-9x5-candles0-tables1"  # where there are no candles its table is nearly exact, a little too high


class Converged(KnowsGoalCaregiver):
    def __init__(self, plan):
        super().__init__(plan, objective=Objective(sweeps=600, tolerance=1e-4), hysteresis=0.0)


class Hopeful(Converged):
    def expected_damage(self, percept, worlds):
        return 0.5 * super().expected_damage(percept, worlds)


@pytest.mark.parametrize(("caregiver", "ratio", "flag"), [(Converged, 1.0, "no"), (Hopeful, 2.0, "perhaps")])
def test_what_is_expected_is_what_comes(caregiver, ratio, flag, monkeypatch):
    monkeypatch.setitem(value.CAREGIVERS, "knows-goal", caregiver)
    rows = value.ask(value.Job(HOUSE, "knows-goal", 30))
    assert set(rows["shape"]) == {"home"}
    assert rows.realised.mean() / rows.expected.mean() == pytest.approx(ratio, rel=0.1)
    line = value.report(rows).splitlines()[2]
    assert line.startswith("| home (1) | `knows-goal` |")
    assert line.endswith(f"| {flag} |")


def test_the_command_fills_its_table_in(tmp_path, capsys):
    (tmp_path / "guide").mkdir()
    page = tmp_path / "guide" / "foresight.md"
    page.write_text("before\n<!-- made by scripts/study.py value -->\nold\n<!-- end -->\nafter\n")
    main(["value", "--houses", HOUSE, "--episodes", "1", "--jobs", "1", "--docs", str(tmp_path)])
    printed = capsys.readouterr().out.strip()
    assert "| all (1) | `foresight` |" in printed
    assert page.read_text() == f"before\n<!-- made by scripts/study.py value -->\n\n{printed}\n\n<!-- end -->\nafter\n"
    with pytest.raises(CaregiverError, match=r"foresight\.md has no place for what scripts/study\.py other makes"):
        fill_in(page, "other", "")
