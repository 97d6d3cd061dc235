"""What was found in houses that nobody chose."""

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.plans.floor_plan import FloorPlan

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
TABLE_TOP = 0.6  # metres
OPEN = 0.06  # metres between the fingers that do not hold a candle


# After one control timestep the fingers have not been told to open yet, and have it all along; after two they have.
@pytest.mark.parametrize("seconds", [0.02, 0.04])
def test_a_candle_that_seems_lost_for_a_moment_is_put_down_all_the_same(seconds):
    # A child that ran into the candle in the hand knocked it askew, and the hand seemed empty. The robot set out to
    # pick the candle up, found that it had got it, and stood there for good.
    env = caregiver_mj.load("relocate_candle", ROOM, 0.0, random=0)
    policy, timestep = caregiver_mj.CaregiverPolicy(env), env.reset()
    env.task.children[0].put(ROOM.free_cells[-1])
    while not (env.physics.is_gripping() and env.physics.candle_poses()[0, 2] > TABLE_TOP + 0.31):
        timestep = env.step(policy(timestep))
    assert policy.activity == "carry candle 1 to table 2"
    for _ in range(round(seconds / env.control_timestep())):
        empty = {**timestep.observation, "finger_position": np.full(2, 0.01)}
        timestep = env.step(policy(timestep._replace(observation=empty)))
    fingers = []  # while it is being picked up again
    while not policy.interventions_done and env.physics.time() < 40.0:
        timestep = env.step(policy(timestep))
        if policy.activity == "pick up candle 1":
            fingers.append(env.physics.finger_position().sum())
    assert (max(fingers) > OPEN) == (seconds > 0.02)
    assert env.task.is_placed(env.physics)
    assert not env.physics.is_gripping()
