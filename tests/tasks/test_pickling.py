"""An environment that is pickled in mid-episode goes on as if nothing had happened."""

import pickle

import numpy as np
import pytest

import caregiver_mj

EVERY = 40  # control timesteps between pickles: in a turn, under way, at rest, reaching out


@pytest.mark.slow
def test_environment():
    env = caregiver_mj.load("supervise", "paper", 0.5, 3)
    policy = caregiver_mj.CaregiverPolicy(env, "foresight")
    step = env.reset()
    for number in range(5 * EVERY):
        if number % EVERY == 0:
            other_env = pickle.loads(pickle.dumps(env))
        action = policy(step)
        step, other_step = env.step(action), other_env.step(action)
        for key, value in step.observation.items():
            np.testing.assert_array_equal(other_step.observation[key], value, err_msg=key)
    assert env.task.timestep > 1
