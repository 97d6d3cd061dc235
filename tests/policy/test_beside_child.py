"""What the policy tells the robot's motion of the children that are near it."""

import dm_env
import numpy as np
import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.recording.ledger import STRIKE_SPEED
from caregiver_mj.robot import separation
from caregiver_mj.robot.separation import GENTLE_GAP, catch_up_speed, slide_speed
from caregiver_mj.robot.view import CHILD_RADIUS

ROOM = FloorPlan.parse("#########\n#B......#\n#..C....#\n#....T..#\n#.......#\n#########", "room")
TOUCHING = 0.27 + 0.12  # metres between the middles of base and child


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
@pytest.mark.parametrize("gap", np.arange(0.05, 2.5, 0.4))
def test_what_is_left_out_where_children_are_far_away_changes_no_action(monkeypatch, robot, gap):
    env = load("supervise", ROOM, 0.0, random=0, task_kwargs={"embodiment": robot})
    timestep = env.reset()
    x, y, yaw = env.physics.base_position()

    def actions():
        policy, seen, told = CaregiverPolicy(env), timestep, []
        apart = policy.robot.robot.footprint + CHILD_RADIUS + gap
        for step in range(40):
            pushed = np.array([0.04, 0.02, 0.2]) * (step > 10)  # metres and radians
            here = {"base_position": np.array([x, y, yaw]) + pushed, "toddler_position": np.array([x + apart, y, 0.0])}
            told.append(policy(seen._replace(observation={**timestep.observation, **here})))
            seen = timestep._replace(step_type=dm_env.StepType.MID)
        return np.array(told)

    with_short_cuts = actions()
    monkeypatch.setattr(separation, "is_alone", lambda view, robot, apart=0.0: False)
    assert np.array_equal(with_short_cuts, actions())


@pytest.mark.parametrize("gap", [0.0, 0.02, 0.2])
def test_nor_does_it_turn_back_any_faster_and_with_its_creep_along_a_child_that_is_no_strike(gap):
    env = load("relocate_candle", ROOM, 0.0, random=0)
    policy, timestep = CaregiverPolicy(env), env.reset()
    x, y, yaw = env.physics.base_position()
    told = []
    for step in range(30):
        off = 0.2 if step else 0.0  # radians by which it has been pushed
        place = np.array([x + TOUCHING + gap, y, 0.0])
        here = {"base_position": np.array([x, y, yaw + off]), "toddler_position": place}
        told.append(policy(timestep._replace(observation={**timestep.observation, **here}))[2])
        timestep = timestep._replace(step_type=dm_env.StepType.MID)
    surface = policy.robot.robot.footprint * np.abs(told)
    back = catch_up_speed(gap) / 3
    assert 0.5 * back < surface.max() < back + 0.01
    assert gap > GENTLE_GAP or surface.max() + slide_speed(gap) < STRIKE_SPEED


def test_the_restraint_knows_when_there_is_a_candle_in_the_hand(monkeypatch):
    told, restrain = [], separation.restrain

    def listen(view, robot, clearance, seconds, is_loaded, velocity, before):
        told.append((is_loaded, view.base, seconds))
        return restrain(view, robot, clearance, seconds, is_loaded, velocity, before)

    monkeypatch.setattr(separation, "is_alone", lambda view, robot, apart=0.0: False)  # children are near at every step
    monkeypatch.setattr(separation, "restrain", listen)
    env = load("relocate_candle", ROOM, 0.0, random=0)
    policy, timestep = CaregiverPolicy(env), env.reset()
    gripping = []
    while not policy.executive.done and env.physics.time() < 30.0:
        gripping.append(env.physics.is_gripping())
        timestep = env.step(policy(timestep))
    loaded, bases, seconds = zip(*told, strict=True)
    assert len(told) == len(gripping)
    assert set(seconds) == {env.control_timestep()}
    assert not loaded[0]
    assert len(set(bases)) > 100  # it is told of the base as it moves
    closes, opens = np.flatnonzero(np.diff(loaded)) + 1  # from when the fingers begin to close until they open
    held = np.flatnonzero(gripping)
    assert closes < held[0] < closes + 10
    assert held[0] + 100 < opens <= held[-1] + 1
