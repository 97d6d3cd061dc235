"""What the tasks say of their observations, against what they show."""

import pytest

import caregiver_mj
from caregiver_mj.tasks.base import OBSERVED


@pytest.mark.parametrize("children", ["0.5", "1,.25"])
@pytest.mark.parametrize("task", caregiver_mj.ALL_TASKS)
def test_every_key_is_as_it_is_said_to_be(task, children):
    needs, plan = caregiver_mj.tasks.TASKS[task].find_kind().needs, caregiver_mj.FloorPlan.load("paper")
    if needs and needs not in plan.hazards.kinds:
        plan = caregiver_mj.FloorPlan.load("home")
    env = caregiver_mj.load(task, plan, children, visuals=False)
    counts = {"candles": len(plan.candle_tables), "tables": len(plan.tables), "stairwells": len(plan.stairwells)}
    counts |= {"gates": len(plan.mouths), "batteries": len(plan.floor_cells), "joints": 7, "children": 2}
    seen = {key: spec.shape for key, spec in env.observation_spec().items()}
    assert set(seen) == {key for key, observed in env.task.observed.items() if not observed.asked or key in seen}
    for key, shape in seen.items():
        one, _, several = env.task.observed[key].shape.partition(", of several children ")
        assert shape == eval(several if several and children == "1,.25" else one, counts)


def test_what_is_asked_for_is_shown():
    env = caregiver_mj.load("supervise", "paper", visuals=False, task_kwargs={"table_height": (0.5, 0.7)})
    asked = {key for key, observed in OBSERVED.items() if observed.asked}
    assert asked == {"table_height", "gate_position", "battery_position", "toddler_seen", "cell_seen"}
    assert env.observation_spec()["table_height"].shape == (len(env.task.plan.tables),)
