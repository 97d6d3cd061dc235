"""What a robot knows of how well it sees, and with what it does not set about its work."""

import math

import pytest

from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan, load
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE
from caregiver_mj.policy.estimates import Senses, hand_error
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion

ROBOT, CANDLES = find_embodiment(), (layout.thing(CANDLE),)


def unsure(sensing):
    return Senses(Sensing.of(sensing), RobotMotion(ROBOT, 0.02), 0.02, CANDLES).unsure


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
