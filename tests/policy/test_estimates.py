"""What is there now, by what is observed with errors and too late."""

import math

import numpy as np
import pytest
from views import ROBOT

from caregiver_mj.house.sensing import Blur, Sensing
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import CANDLE
from caregiver_mj.policy.estimates import CandleEstimates, ChildEstimates, SelfEstimate, Senses
from caregiver_mj.robot.kinematics import arm_of
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.reach import as_high, reach_path

STEP = 0.02  # seconds
OPEN, ROUND = 0.072, 0.044  # metres that the fingers stand off the middle, both together
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
TUCKED, CANDLES = arm_of(ROBOT).tucked, (layout.thing(CANDLE),) * 2
HERE = (np.zeros(3), TUCKED)


def motion():
    """A robot under way, straight ahead."""
    robot = RobotMotion(ROBOT, STEP)
    robot.reset((0.0, 0.0, 0.0))
    robot.drive_along([(0.0, 0.0), (3.0, 0.0)], lambda points: True)
    return robot


def drive(blur, delay_steps, steps=90, off=(0.0, 0.0, 0.0), seed=0):
    """Where the robot is and where it is estimated to be, at every control timestep: (steps, 3) each."""
    robot, random = motion(), np.random.default_rng(seed)
    estimate = SelfEstimate(blur, robot, delay_steps)
    true, found = [], []
    for _ in range(steps):
        robot.set_rate(1.0)
        true.append(np.array([*robot.base_reference()[0], robot.yaw]) + off)
        seen = true[max(0, len(true) - 1 - delay_steps)]
        _, (base, _) = estimate.update(seen + random.normal(size=3) * [blur.noise, blur.noise, 0.0], TUCKED)
        found.append(base)
        robot.now += STEP
    assert np.ptp([x for x, _, _ in true]) > 1.0  # it has moved
    return np.array(true), np.array(found)


@pytest.mark.parametrize("delay_steps", [0, 3])
def test_a_robot_knows_where_it_is_by_now(delay_steps):
    true, found = drive(Blur(), delay_steps, off=(0.01, -0.02, 0.1))
    assert found == pytest.approx(true, abs=1e-9)


def test_noise_of_where_it_is_averages_out_under_way():
    true, found = drive(Blur(noise=0.01), 3)
    assert (found - true)[30:, :2].std() < 0.005


@pytest.mark.parametrize("off", [(0.055, 0.0), (0.042, 0.042)])
def test_a_reference_that_is_set_anew_does_not_move_the_robot(off):
    """As where it is let go by a base that has been led off it."""
    robot = RobotMotion(ROBOT, STEP)
    robot.reset((0.0, 0.0, 0.0))
    estimate, found = SelfEstimate(Blur(noise=0.01), robot, 3), []
    for step in range(40):
        if step == 30:
            robot.let_go(off, (0.0, 0.0), (0.0, 0.0))
        _, (base, _) = estimate.update(np.array([*off, 0.0]), TUCKED)
        found.append(base[:2])
        robot.now += STEP
    assert np.array(found)[30:] == pytest.approx(np.tile(off, (10, 1)), abs=0.001)


def test_a_base_that_is_held_does_not_move_and_what_is_not_measured_is_driven_on():
    robot = motion()
    estimate = SelfEstimate(Blur(), robot, 0)
    for _ in range(60):
        robot.set_rate(1.0)
        _, (base, _) = estimate.update(np.zeros(3), TUCKED)  # it is told to, and is seen where it was
        robot.now += STEP
    assert base[0] == pytest.approx(0.0, abs=1e-9)
    # What has not been measured is driven on.
    robot = motion()
    estimate = SelfEstimate(Blur(dropout=0.5), robot, 0)
    for _ in range(60):
        robot.set_rate(1.0)
        _, (base, _) = estimate.update(np.zeros(3), TUCKED)  # as at the start, over and over
        robot.now += STEP
    assert base[0] == pytest.approx(robot.base_reference()[0][0], abs=0.05)
    assert base[0] > 0.3


# -- Candles -------------------------------------------------------------------------------------


def look(estimates, places, fingers=OPEN, then=HERE, now=HERE):
    positions = np.array(places, float)
    return estimates.update(positions, np.tile(UPRIGHT, (len(positions), 1)), fingers, then, now)[0]


def test_a_standing_candle_is_where_it_is_seen_on_average_and_one_that_has_been_moved_soon_elsewhere():
    random, estimates, place = (
        np.random.default_rng(0),
        CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES),
        [1.0, 0.0, 0.6],
    )
    found = np.array([look(estimates, [place + random.normal(size=3) * 0.01])[0] for _ in range(500)])
    late = found[100:]
    assert np.linalg.norm(late - place, axis=1).max() < 0.008
    assert np.linalg.norm(late - place, axis=1).mean() < 0.004
    assert (np.diff(late, axis=0) != 0).any(axis=1).sum() < 20  # goals stay where they are
    # A candle that has been moved is soon elsewhere.
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


def test_one_let_go_stays_where_it_was_in_the_hand():
    random, estimates = np.random.default_rng(0), CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES)
    foot = arm_of(ROBOT).pinch(TUCKED) - [0.0, 0.0, 0.1]
    for fingers in (*[OPEN] * 60, *[ROUND] * 60, OPEN):
        found = look(estimates, [foot + random.normal(size=3) * 0.01], fingers)[0]
        assert np.linalg.norm(found - foot) < 0.03
    assert np.linalg.norm(found - foot) < 0.012


def test_one_that_tips_over_is_seen_to_at_once():
    estimates = CandleEstimates(Blur(noise=0.01), ROBOT, CANDLES)
    random, lying = np.random.default_rng(0), np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    for orientation in (*[UPRIGHT] * 60, lying):
        places = np.array([[1.0, 0.0, 0.6]]) + random.normal(size=3) * 0.01
        _, found = estimates.update(places, orientation[None], OPEN, HERE, HERE)
    assert found[0] == pytest.approx(lying)


# -- Children ------------------------------------------------------------------------------------


def test_a_child_goes_on_as_it_does():
    estimates, velocity = ChildEstimates(Blur(), STEP, 0.06), np.array([0.5, 0.0, 0.0])
    for step in range(20):
        seen = velocity * STEP * step
        position, _ = estimates.update(seen, velocity)
    assert position == pytest.approx(seen + 0.06 * velocity)


def test_a_child_that_stands_still_does_so_however_its_velocity_is_seen():
    random, here = np.random.default_rng(0), np.array([1.0, 2.0, 0.0])
    estimates = ChildEstimates(Blur(velocity_noise=0.1), STEP, 0.0)
    for step in range(300):
        walks = np.array([0.4, 0.0, 0.0]) * (step < 20)
        here = here + STEP * walks
        position, velocity = estimates.update(here, walks + random.normal(size=3) * 0.1)
        assert math.dist(position[:2], here[:2]) < 0.01
    assert np.hypot(*velocity[:2]) < 0.2


# -- All of it -----------------------------------------------------------------------------------


def test_exact_observations_are_taken_as_they_are():
    senses, observation = Senses(Sensing(), motion(), STEP, ()), {"base_position": np.zeros(3)}
    senses.reset()
    assert senses.now(observation) is observation
    assert senses.age == 0.0


@pytest.mark.parametrize("height", [0.65, 0.70, 0.75])
def test_over_a_higher_table_the_hand_keeps_as_high(height):
    arm, mm = arm_of(ROBOT), round(1e3 * (height + 0.1))
    share = as_high(arm, 700, mm, 0.62)
    usual = arm.pinch(reach_path(arm, 7000).joints(0.62))[2] - 0.7
    higher = arm.pinch(reach_path(arm, 10 * mm).joints(share))[2] - 1e-3 * mm
    assert share < 0.62
    assert higher >= usual or share == 0.0
    assert as_high(arm, 700, 700, 0.62) == 0.62
