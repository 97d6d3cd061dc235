"""A policy belongs to its environment."""

import pytest

import caregiver_mj
from caregiver_mj.caregivers.registry import make_caregiver


@pytest.mark.parametrize(("house", "children"), [("house-3", "0.5"), ("paper", "1,0.5")])
def test_another_environment_is_refused(house, children):
    policy = caregiver_mj.CaregiverPolicy(caregiver_mj.load("supervise", "paper", random=0))
    other = caregiver_mj.load("supervise", house, children, random=0)
    message = "must be that of 0.5 in house 'paper', got another: make a policy for each environment"
    with pytest.raises(caregiver_mj.CaregiverError, match=message):
        policy(other.reset())


def test_one_that_cannot_be_made_leaves_the_house_as_it_is():
    env = caregiver_mj.load("supervise", "paper", random=0, visuals=False)
    with pytest.raises(caregiver_mj.CaregiverError, match="sensing must show"):
        caregiver_mj.CaregiverPolicy(env, "childproof", sensing={"candle": {"noise": 0.3}})
    assert env.task.caregiver is None
    env.reset()
    assert env.task.candles.starting_tables == [*env.task.plan.candle_tables]


def test_a_caregiver_serves_one_policy_at_a_time():
    """What it has seen of the one episode would count in the other."""
    one, two = (caregiver_mj.load("supervise", "paper", visuals=False, random=0) for _ in range(2))
    caregiver = make_caregiver("expected-danger", one.task.plan)
    first, second = caregiver_mj.CaregiverPolicy(one, caregiver), caregiver_mj.CaregiverPolicy(two, caregiver)
    timestep = one.reset()
    timestep = one.step(first(timestep))
    second(two.reset())
    with pytest.raises(caregiver_mj.CaregiverError, match="another policy has begun an episode"):
        first(timestep)
    first(one.reset())  # one after the other they may have it


def test_actions_that_are_too_far_apart_to_control_the_robot_are_refused():
    """At 0.15 s it drops candles. Actions of somebody else may be so far apart."""
    env = caregiver_mj.load("supervise", "paper", random=0, task_kwargs={"control_timestep": 0.08})
    env.reset()
    env.step(env.action_spec().generate_value())
    with pytest.raises(caregiver_mj.CaregiverError, match=r"control_timestep must be at most 0.06 s .*, got 0\.08"):
        caregiver_mj.CaregiverPolicy(env)
