"""What was found in houses that nobody chose."""

import numpy as np

from caregiver_mj.experiments.seeds import episode_random, episode_seed
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load

CANDLE = 3


def test_a_candle_that_a_child_knocks_askew_in_the_hand_is_put_down_all_the_same():
    # The child runs into the candle that the robot is about to put down, 69.6 s into the episode. For a moment the hand
    # seems empty, and the robot sets out to pick the candle up; then it finds that it has got it.
    env = load("supervise", FloorPlan.load("house-200007"), 0.25, random=np.random.RandomState(0))
    policy = CaregiverPolicy(env)
    env.task.reseed(episode_random(episode_seed(0, 15)))
    timestep = env.reset()
    while env.physics.time() < 69.5:
        timestep = env.step(policy(timestep))
    assert policy.activity == f"carry candle {CANDLE + 1} to table 3"
    activities = []
    while env.physics.time() < 79.0:
        timestep = env.step(policy(timestep))
        activities.append(policy.activity)
    assert f"pick up candle {CANDLE + 1}" in activities
    height = env.physics.candle_poses()[CANDLE, 2]
    assert 0.55 < height < 0.75  # on a table, where it lies now, and neither in the hand nor on the floor
    assert not env.physics.is_gripping()
