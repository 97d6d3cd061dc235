"""What is there now, by what is observed with errors and too late, and what is not tried with such errors."""

import math

import numpy as np
import pytest
from views import ROBOT

from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan, load
from caregiver_mj.house.sensing import Blur, Sensing
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE
from caregiver_mj.policy.estimates import CandleEstimates, ChildEstimates, SelfEstimate, Senses, hand_error
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.motion import RobotMotion

STEP = 0.02  # seconds
OPEN, ROUND = 0.072, 0.044  # metres that the fingers stand off the middle, both together
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
TUCKED, CANDLES = arm_of(ROBOT).tucked, (layout.thing(CANDLE),) * 2
HERE = (np.zeros(3), TUCKED)


def motion():
    robot = RobotMotion(ROBOT, STEP)
    robot.reset((0.0, 0.0, 0.0))
    robot.drive_along([(0.0, 0.0), (3.0, 0.0)], lambda points: True)
    return robot


def drive(delay_steps, off):
    """Where the robot is and where it is estimated to be, at every control timestep: (90, 3) each."""
    robot = motion()
    estimate = SelfEstimate(Blur(), robot, delay_steps)
    true, found = [], []
    for _ in range(90):
        robot.set_rate(1.0)
        true.append(np.array([*robot.base_reference()[0], robot.yaw]) + off)
        seen = true[max(0, len(true) - 1 - delay_steps)]
        _, (base, _) = estimate.update(seen, TUCKED)
        found.append(base)
        robot.now += STEP
    assert np.ptp([x for x, _, _ in true]) > 1.0  # it has moved
    return np.array(true), np.array(found)


@pytest.mark.parametrize("delay_steps", [0, 3])
def test_a_robot_knows_where_it_is_by_now(delay_steps):
    true, found = drive(delay_steps, (0.01, -0.02, 0.1))
    assert found == pytest.approx(true, abs=1e-9)


def look(estimates, places, fingers=OPEN, then=HERE, now=HERE):
    positions = np.array(places, float)
    return estimates.update(positions, np.tile(UPRIGHT, (len(positions), 1)), fingers, then, now)[0]


def test_a_standing_candle_is_where_it_is_seen_on_average_and_one_that_has_been_moved_soon_elsewhere():
    random, place = np.random.default_rng(0), [1.0, 0.0, 0.6]
    estimates = CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES)
    found = np.array([look(estimates, [place + random.normal(size=3) * 0.01])[0] for _ in range(500)])
    late = found[100:]
    assert np.linalg.norm(late - place, axis=1).max() < 0.008
    assert np.linalg.norm(late - place, axis=1).mean() < 0.004
    assert (np.diff(late, axis=0) != 0).any(axis=1).sum() < 20  # goals stay where they are
    random, estimates = np.random.default_rng(0), CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES)
    for step in range(100):
        place = np.array([1.0, 0.0 if step < 80 else 0.1, 0.6])
        found = look(estimates, [place + random.normal(size=3) * 0.01])[0]
    assert found[1] == pytest.approx(0.1, abs=0.015)


def test_one_in_the_hand_goes_with_it_and_is_not_late():
    estimates, pinch = CandleEstimates(Blur(), ROBOT, CANDLES), arm_of(ROBOT).pinch(TUCKED)
    foot = pinch - [0.0, 0.0, 0.1]
    look(estimates, [foot])
    for step in range(1, 5):
        then, now = ((np.array([0.03 * s, 0.0, 0.0]), TUCKED) for s in (step - 1, step + 2))
        found = look(estimates, [foot + then[0]], ROUND, then, now)[0]
        assert found == pytest.approx(foot + now[0])


def test_one_that_tips_over_is_seen_to_at_once():
    estimates = CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES)
    random, lying = np.random.default_rng(0), np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    for orientation in (*[UPRIGHT] * 60, lying):
        places = np.array([[1.0, 0.0, 0.6]]) + random.normal(size=3) * 0.01
        _, found = estimates.update(places, orientation[None], OPEN, HERE, HERE)
    assert found[0] == pytest.approx(lying)


def test_a_child_goes_on_as_it_does():
    estimates, velocity = ChildEstimates(Blur(), STEP, 0.06), np.array([0.5, 0.0, 0.0])
    for step in range(20):
        seen = velocity * STEP * step
        position, _ = estimates.update(seen, velocity)
    assert position == pytest.approx(seen + 0.06 * velocity)


def unsure(sensing):
    return Senses(Sensing.of(sensing), RobotMotion(ROBOT, STEP), STEP, CANDLES).unsure


def test_a_child_may_be_nearer_by_what_it_walks_meanwhile_and_by_what_is_seen_wrongly():
    assert unsure(None) == unsure({"candle": {"noise": 0.01, "bias": 0.01}}) == 0.0
    assert unsure({"delay": 0.1}) == pytest.approx(0.062)
    assert unsure({"child": {"bias": 0.03}, "base": {"bias": 0.04}}) == pytest.approx(0.1)
    assert 0.0 < unsure({"base": {"noise": 0.01}}) < unsure({"base": {"noise": 0.02}}) < 0.04
    assert unsure({"child": {"dropout": 0.5}}) == pytest.approx(0.02 * 0.62)


def test_the_hand_is_off_by_what_is_wrong_with_candle_and_base():
    for kind in ("candle", "base"):
        assert hand_error(Sensing.of({kind: {"bias": 0.004}}), ROBOT, CANDLES) == pytest.approx(0.004)
        assert 0.0 < hand_error(Sensing.of({kind: {"noise": 0.01}}), ROBOT, CANDLES) < 0.0035  # a mean over many
    both = Sensing.of({"candle": {"bias": 0.003}, "base": {"bias": 0.004}})
    assert hand_error(both, ROBOT, CANDLES) == pytest.approx(0.005)
    assert hand_error(Sensing.of({"base": {"turn_bias": 0.005}}), ROBOT, CANDLES) == pytest.approx(0.7 * 0.005)
    assert hand_error(Sensing.of({"child": {"bias": 0.1}, "delay": 0.1}), ROBOT, CANDLES) == 0.0
    assert math.isclose(hand_error(Sensing.of(None), ROBOT, CANDLES), 0.0)


def test_who_sees_too_badly_to_take_a_candle_is_told_so():
    small = FloorPlan.parse("#######\n#B....#\n#..C..#\n#.....#\n#.S..T#\n#######", "small")
    bare = FloorPlan.parse("#######\n#B....#\n#.....#\n#.....#\n#.S...#\n#######", "bare")
    sensing = {"base": {"noise": 0.01}, "candle": {"bias": 0.008}, "delay": 0.1}
    env = load("supervise", small, 0.5, random=0, task_kwargs={"sensing": sensing}, visuals=False)
    with pytest.raises(CaregiverError, match=r"must show mobile_fr3 a candle within 5\.6 mm .*, got 8\.5 mm"):
        CaregiverPolicy(env)
    env = load("supervise", bare, 0.5, random=0, task_kwargs={"sensing": sensing}, visuals=False)
    policy = CaregiverPolicy(env)
    env.step(policy(env.reset()))
