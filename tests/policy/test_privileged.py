"""Privileged information in the house: the truth, once a novice timestep, past the observation."""

import pytest

import caregiver_mj
from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.caregiver import PrivilegedCaregiver
from caregiver_mj.tasks import TaskSpec
from caregiver_mj.tasks.supervise import Supervise

HOUSE = "house-200000"


class Listener(NearestCaregiver, PrivilegedCaregiver):
    """Takes down what it hears, and when it watches."""

    def __init__(self, plan):
        super().__init__(plan)
        self.heard = []

    def watch(self, percept):
        self.heard.append(None)

    def hear(self, truth):
        self.heard[-1] = truth.goal.tolist(), truth.epsilon.tolist()


def run(env, policy, moves):
    timestep = env.reset()
    while env.task.timestep < moves:
        timestep = env.step(policy(timestep))


def test_a_bound_hears_the_truth_after_every_move():
    env = caregiver_mj.load("supervise", HOUSE, "0,0.25", random=3)
    listener = Listener(env.task.plan)
    run(env, caregiver_mj.CaregiverPolicy(env, listener), 4)
    assert len(listener.heard) == 4
    assert all(epsilon == [[0.0, 0.25]] for _, epsilon in listener.heard)
    assert listener.heard[-1][0] == [[child.goal for child in env.task.children]]


class Secretive(Supervise):
    """A task whose truth nobody may ask for."""

    def truth(self):
        raise AssertionError("asked")


@pytest.mark.parametrize(("name", "may_hear"), [("paper", False), ("knows-goal", True)])
def test_nobody_else_can_hear_it(name, may_hear, monkeypatch):
    monkeypatch.setitem(caregiver_mj.tasks.TASKS, "supervise", TaskSpec("supervise", Secretive))
    env = caregiver_mj.load("supervise", HOUSE, 0.5, random=3)
    policy = caregiver_mj.CaregiverPolicy(env, name)
    assert not any("goal" in key or "epsilon" in key for key in env.observation_spec())
    if may_hear:
        with pytest.raises(AssertionError, match="asked"):
            run(env, policy, 1)
    else:
        run(env, policy, 2)
