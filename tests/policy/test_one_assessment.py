"""A decision assesses the dangers once; a display that asks for the numbers gets those of that decision."""

from unittest import mock

import numpy as np

from caregiver_mj import CaregiverPolicy, load
from caregiver_mj.caregivers.paper import PaperCaregiver


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
