"""A closed loop that is pickled in mid-episode goes on as if nothing had happened."""

import pickle

import numpy as np

import caregiver_mj

EVERY = 40  # control timesteps between pickles: in a turn, under way, at rest, reaching out


def test_environment_and_policy():
    env = caregiver_mj.load("supervise", "paper", 0.5, 3)
    policy = caregiver_mj.CaregiverPolicy(env, "foresight")
    step = env.reset()
    again = None
    for number in range(5 * EVERY):
        if number % EVERY == 0:
            copies = pickle.loads(pickle.dumps((env, policy, step)))
            again = copies
        other_env, other_policy, other_step = again
        action = policy(step)
        np.testing.assert_array_equal(other_policy(other_step), action)
        step, other_step = env.step(action), other_env.step(action)
        again = other_env, other_policy, other_step
        for key, value in step.observation.items():
            np.testing.assert_array_equal(other_step.observation[key], value, err_msg=key)
    assert env.task.timestep > 1
