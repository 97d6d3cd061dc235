"""Copies and pickles go on as the same episodes."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from small import OTHER, PLAN, TARGETS, same

from caregiver_mj import CaregiverPolicy, load
from caregiver_mj.envs.houses_vector import GridHousesVector

MAKERS = {
    "grid": lambda: gymnasium.make(TARGETS, house=PLAN, epsilon="1,.25", render_mode="rgb_array"),
    "houses": lambda: GridHousesVector((PLAN, OTHER), 4, observation="map"),
    "house": lambda: gymnasium.make(TARGETS, house=PLAN, world="house"),
}


def run(env, steps):
    action = np.ones(env.num_envs, int) if isinstance(env, gymnasium.vector.VectorEnv) else 1
    return [env.step(action) for _ in range(steps)]


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("how", ["copy", "pickle"])
def test_a_copy_goes_on_as_the_same_episode(kind, how):
    env = MAKERS[kind]()
    steps = 12 if kind == "house" else 205  # into the next episode
    env.reset(seed=3)
    run(env, 4)
    if how == "pickle" and steps == 12:
        with pytest.raises(TypeError, match="pickle"):  # of what the robot is moving by, as the guide says
            pickle.dumps(env)
        return
    other = copy.deepcopy(env) if how == "copy" else pickle.loads(pickle.dumps(env))
    steps = min(steps, 196) if kind == "grid" else steps
    wanted = run(env, steps)
    if kind == "grid":
        before = env.render()
        assert not np.array_equal(other.render(), before)  # a picture of the copy, which has not moved yet
        assert same(run(other, steps), wanted)
        np.testing.assert_array_equal(other.render(), before)
    else:
        assert same(run(other, steps), wanted)


def test_a_policy_is_copied_with_its_environment():
    env = load("supervise", PLAN, random=1)
    policy, timestep = CaregiverPolicy(env), env.reset()
    for _ in range(300):  # the robot is on its way
        timestep = env.step(policy(timestep))
    other, others, seen = *copy.deepcopy((env, policy)), timestep
    for _ in range(300):
        timestep, seen = env.step(policy(timestep)), other.step(others(seen))
    np.testing.assert_array_equal(env.physics.data.qpos, other.physics.data.qpos)
    assert abs(env.physics.base_velocity()).max() > 0.01  # m/s: it drives


EVERY = 40  # control timesteps between pickles: in a turn, under way, at rest, reaching out


@pytest.mark.slow
def test_a_pickled_environment_goes_on():
    env = load("supervise", "paper", 0.5, 3)
    policy, step = CaregiverPolicy(env, "foresight"), env.reset()
    for number in range(5 * EVERY):
        if number % EVERY == 0:
            other_env = pickle.loads(pickle.dumps(env))
        action = policy(step)
        step, other_step = env.step(action), other_env.step(action)
        for key, value in step.observation.items():
            np.testing.assert_array_equal(other_step.observation[key], value, err_msg=key)
    assert env.task.timestep > 1
