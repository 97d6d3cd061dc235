"""A policy of a caregiver: its environment, how often it assesses, what it leaves alone, and who hears the truth."""

from unittest import mock

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj import CaregiverError, CaregiverPolicy, load
from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.caregiver import PrivilegedCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.routines import COOLDOWN, LEFT_LYING, Cooldowns
from caregiver_mj.tasks import TaskSpec
from caregiver_mj.tasks.suite import Supervise


@pytest.mark.parametrize(("house", "children"), [("house-3", "0.5"), ("paper", "1,0.5")])
def test_another_environment_is_refused(house, children):
    policy = CaregiverPolicy(load("supervise", "paper", random=0))
    other = load("supervise", house, children, random=0)
    message = "must be that of 0.5 in house 'paper', got another: make a policy for each environment"
    with pytest.raises(CaregiverError, match=message):
        policy(other.reset())


def test_one_that_cannot_be_made_leaves_the_house_as_it_is():
    env = load("supervise", "paper", random=0, visuals=False)
    with pytest.raises(CaregiverError, match="sensing must show"):
        CaregiverPolicy(env, "childproof", sensing={"candle": {"noise": 0.3}})
    assert env.task.caregiver is None
    env.reset()
    assert env.task.candles.starting_tables == [*env.task.plan.candle_tables]


def test_a_caregiver_serves_one_policy_at_a_time():
    """What it has seen of the one episode would count in the other."""
    one, two = (load("supervise", "paper", visuals=False, random=0) for _ in range(2))
    caregiver = make_caregiver("expected-danger", one.task.plan)
    first, second = CaregiverPolicy(one, caregiver), CaregiverPolicy(two, caregiver)
    timestep = one.reset()
    timestep = one.step(first(timestep))
    second(two.reset())
    with pytest.raises(CaregiverError, match="another policy has begun an episode"):
        first(timestep)
    first(one.reset())  # one after the other they may have it


def test_a_decision_assesses_once_where_nothing_is_hidden():
    env = load("supervise", random=0, visuals=False)
    policy, timestep = CaregiverPolicy(env), env.reset()
    with (
        mock.patch.object(PaperCaregiver, "assess", autospec=True, side_effect=PaperCaregiver.assess) as assess,
        mock.patch.object(PaperCaregiver, "decide", autospec=True, side_effect=PaperCaregiver.decide) as decide,
    ):
        for _ in range(30):
            timestep = env.step(policy(timestep))
        assert decide.call_count >= 1
        assert assess.call_count == decide.call_count
        shown, percept = policy.assessment, assess.call_args.args[1]
    assert policy.assessment is shown
    np.testing.assert_array_equal(shown.danger, policy.caregiver.assess(percept).danger)


def test_each_failure_doubles_the_wait_until_something_is_done_about_that_hazard():
    cooldowns, now = Cooldowns(2), 0.0
    for wait in (COOLDOWN, 2 * COOLDOWN, 4 * COOLDOWN, 8 * COOLDOWN, LEFT_LYING, LEFT_LYING):
        cooldowns.succeed(NOTHING)  # as when it stands at a lookout, which is about none
        cooldowns.fail(1, now)
        assert cooldowns.active(now + wait - 0.01).tolist() == [False, True]
        now += wait
        assert cooldowns.active(now).tolist() == [False, False]
    cooldowns.succeed(1)
    cooldowns.fail(1, now)
    assert cooldowns.active(now + COOLDOWN).tolist() == [False, False]


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
    env = load("supervise", HOUSE, "0,0.25", random=3)
    listener = Listener(env.task.plan)
    run(env, CaregiverPolicy(env, listener), 4)
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
    env = load("supervise", HOUSE, 0.5, random=3)
    policy = CaregiverPolicy(env, name)
    assert not any("goal" in key or "epsilon" in key for key in env.observation_spec())
    if may_hear:
        with pytest.raises(AssertionError, match="asked"):
            run(env, policy, 1)
    else:
        run(env, policy, 2)
