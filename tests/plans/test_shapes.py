"""Houses of every shape: each is valid, and one that the robot can work in."""

import pytest

from caregiver_mj import FloorPlan, cli
from caregiver_mj.plans.generator import is_drivable
from caregiver_mj.plans.sets import house_set

SHAPES = (
    "hall", "alcoves", "dead-ends", "open-plan", "loops", "chain", "stairs-only", "many-tables", "far-bins",
)  # fmt: skip


def houses(shape):
    return [FloorPlan.load(f"{shape}-{seed}") for seed in range(700, 704)]


@pytest.mark.parametrize("shape", SHAPES)
def test_each_can_be_lived_and_worked_in(shape):
    for plan in houses(shape):
        assert 10 <= len(plan.free_cells) <= 100
        assert is_drivable(plan)
        assert (plan.graph.table_distances < 1000).all()
        assert (plan.graph.stairwell_distances < 1000).all()
        assert plan.bins
        assert FloorPlan.load(plan.name).rows == plan.rows
    assert len({plan.rows for plan in houses(shape)}) == 4


def test_sets_are_balanced_over_the_shapes():
    names = [plan.name for plan in house_set("shapes-test-20")]
    assert sorted(name.rpartition("-")[0] for name in names) == sorted(2 * ["house", *SHAPES])
    assert not set(names) & {plan.name for plan in house_set("shapes-train-20")}
    assert FloorPlan.load("shapes-test-20/3").rows == FloorPlan.load(names[3]).rows


def test_a_valid_house_that_the_robot_cannot_work_in_is_warned_of(tmp_path, capsys):
    (tmp_path / "narrow.txt").write_text("########\n#..#####\n#......#\n#B.#T#B#\n########\n")
    assert cli.main(["house", "check", str(tmp_path / "narrow.txt")]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("OK: narrow")
    assert "warning: the robot has no room" in err
    assert (cli.main(["house", "check", "hall-3"]), capsys.readouterr().err) == (0, "")
