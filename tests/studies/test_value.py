"""What the planner expects, beside what then comes."""

import pytest

from caregiver_mj.caregivers.foresight.foresight import KnowsGoalCaregiver
from caregiver_mj.caregivers.foresight.value_table import Objective
from studies import value

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
