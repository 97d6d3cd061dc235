"""A policy belongs to its environment."""

import pytest

import caregiver_mj


@pytest.mark.parametrize(("house", "children"), [("apartment", "0.5"), ("house-3", "0.5"), ("paper", "1,0.5")])
def test_another_environment_is_refused(house, children):
    policy = caregiver_mj.CaregiverPolicy(caregiver_mj.load("supervise", "paper", random=0))
    other = caregiver_mj.load("supervise", house, children, random=0)
    message = "another environment, that of 0.5 in house 'paper': each environment needs a policy of its own"
    with pytest.raises(caregiver_mj.CaregiverError, match=message):
        policy(other.reset())
