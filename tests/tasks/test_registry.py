"""A fourth task takes one class and one line, and has all that the others have."""

from typing import ClassVar

import numpy as np
import pytest

import caregiver_mj.tasks
from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.interventions.verb import BLOCK, Intervention
from caregiver_mj.plans.hazards import STAIRWELL, Where
from caregiver_mj.tasks import TaskSpec, register
from caregiver_mj.tasks.base import OBSERVED, CareTask, Observed

PLAN = FloorPlan.parse("######\n#...B#\n#.C.T#\n######", "no_stairs")


class GuardStairs(CareTask):
    """Stand in the last stairwell, to which the observation has the way."""

    needs = STAIRWELL
    needs_robot = True
    time_limit = 20.0  # seconds
    observed: ClassVar = {**OBSERVED, "last_stairwell": Observed("(2,)", "m", "the way to the last landing", "way")}

    def _way(self, physics):
        return self.plan.position(self.plan.stairwells[-1]) - physics.base_position()[:2]

    def get_observation(self, physics):
        return super().get_observation(physics) | {"last_stairwell": self._way(physics)}

    def orders(self, observation):
        place = observation["base_position"][:2] + observation["last_stairwell"]
        stairwell = self.plan.stairwells.index(self.plan.cell_at(place))
        return Intervention(BLOCK, self.plan.hazards.number(Where.OPENING, stairwell))

    def get_reward(self, physics):
        return float(np.abs(self._way(physics)).max() < 0.1)


class Unfinished(CareTask):
    """It has no reward."""


@pytest.fixture
def guard_stairs():
    gymnasium = pytest.importorskip("gymnasium")
    task = TaskSpec("guard_stairs", f"{__name__}:GuardStairs", version=2)
    register(task)
    yield task.id
    del gymnasium.registry[task.id], caregiver_mj.tasks.TASKS[task.name]


def test_a_fourth_task_has_a_gymnasium_environment_and_a_scripted_policy(guard_stairs):
    import gymnasium

    assert guard_stairs == "caregiver_mj/GuardStairs-v2"
    plan = FloorPlan.parse("######\n#S..S#\n#....#\n#B...#\n######", "two")
    env = gymnasium.make(guard_stairs, house=plan, epsilon=1.0)
    widths = 2 * 0.75 * np.array([6 / 2 + 1, 5 / 2 + 1])  # of the house, and a cell on either side
    assert env.observation_space["last_stairwell"].high == pytest.approx(widths)
    house = env.unwrapped
    policy = caregiver_mj.CaregiverPolicy(house.dm_env)
    env.reset(seed=1)
    ended, reward = False, 0.0
    while not ended:
        observation, reward, *ends, _ = env.step(policy(house.timestep))
        assert env.observation_space.contains(observation)
        ended = any(ends)
    assert reward == 1.0
    assert policy.intervention.verb == BLOCK


def test_an_observation_with_unknown_bounds_is_refused(guard_stairs, monkeypatch):
    gymnasium = pytest.importorskip("gymnasium")
    monkeypatch.setitem(GuardStairs.observed, "last_stairwell", Observed("(2,)", "m", "the way", "wya"))
    with pytest.raises(CaregiverError, match=r"'last_stairwell' must be one of .*way.*, got 'wya'"):
        gymnasium.make(guard_stairs)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("collections:OrderedDict", "task 'mine' must be a subclass of CareTask, got <class"),
        (f"{__name__}:Unfinished", "task 'mine' must have get_reward, got Unfinished without"),
    ],
)
def test_a_task_that_is_none_is_refused_in_a_line(kind, words, monkeypatch):
    monkeypatch.setitem(caregiver_mj.tasks.TASKS, "mine", TaskSpec("mine", kind))
    with pytest.raises(CaregiverError, match=words):
        caregiver_mj.load("mine", PLAN)
