"""A fourth task takes one class and one line."""

import numpy as np
import pytest

import caregiver_mj.tasks
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import HazardKind
from caregiver_mj.tasks.base import CareTask

PLAN = FloorPlan.parse("######\n#...B#\n#.C.T#\n######", "no_stairs")


class StayCalm(CareTask):
    """Move as little as possible, near a candle."""

    needs = HazardKind.CANDLE
    needs_robot = True
    time_limit = 0.5  # seconds

    def get_reward(self, physics):
        return float(np.exp(-np.abs(physics.base_velocity()).max()))


@pytest.fixture
def stay_calm(monkeypatch):
    monkeypatch.setitem(caregiver_mj.tasks.TASKS, "stay_calm", StayCalm)


@pytest.mark.usefixtures("stay_calm")
def test_a_fourth_task_is_loaded_as_the_others_are():
    env = caregiver_mj.tasks.load("stay_calm", PLAN, "1,.5", random=0)
    step = env.reset()
    rewards = []
    while not step.last():
        step = env.step(env.action_spec().generate_value() * 0)
        rewards.append(step.reward)
    assert len(rewards) == 25  # half a second
    assert all(0 < reward <= 1 for reward in rewards)
    assert caregiver_mj.tasks.load("stay_calm", PLAN, task_kwargs={"time_limit": 1.0}).reset().first()


@pytest.mark.usefixtures("stay_calm")
def test_what_it_needs_is_seen_to():
    bare = FloorPlan.parse("#####\n#B.S#\n#..T#\n#####", "bare")
    with pytest.raises(CaregiverError, match=r"stay_calm needs a candle \(C\), and floor plan 'bare' has none"):
        caregiver_mj.tasks.load("stay_calm", bare)
    with pytest.raises(CaregiverError, match="stay_calm needs the robot"):
        caregiver_mj.tasks.load("stay_calm", PLAN, task_kwargs={"robot": False})


@pytest.mark.usefixtures("stay_calm")
def test_who_asks_for_another_hears_of_it():
    with pytest.raises(CaregiverError, match=r"no task 'tidy_up': there are .*, stay_calm"):
        caregiver_mj.tasks.load("tidy_up", PLAN)
