"""A decision assesses the dangers once; a display that asks for the numbers gets those of that decision."""

from unittest import mock

import numpy as np

from caregiver_mj import CaregiverPolicy, load
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.robot.skills import Skill


def test_a_decision_assesses_once_where_nothing_is_hidden():
    env = load("supervise", random=0, visuals=False)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
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


def test_a_skill_that_drives_is_asked_ten_times_a_second():
    env = load("block_stairs", random=0, visuals=False)
    policy = CaregiverPolicy(env)
    timestep = env.reset()
    with mock.patch.object(Skill, "step", autospec=True, side_effect=Skill.step) as step:
        for _ in range(100):  # two seconds, in which a child begins two moves
            timestep = env.step(policy(timestep))
    assert 20 <= step.call_count <= 23
