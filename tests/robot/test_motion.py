"""The robot's references and the actions that follow them."""

import contextlib

import numpy as np
import pytest
from views import ROBOT, at_rest

from caregiver_mj.robot.base_path import BasePath
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.scalar_motion import PathError


@pytest.fixture
def robot() -> RobotMotion:
    motion = at_rest()
    return motion


def motion_along(*points: tuple[float, float]) -> RobotMotion:
    robot = at_rest()
    robot.drive_along([(0.0, 0.0), *points], lambda _: True)
    robot.set_rate(1.0)
    return robot


def test_feeding_the_lag_forward_adds_no_jerk():
    """A command with more jerk than the path could not be followed, and would go beyond where the path ends."""
    robot, told = motion_along((2.0, 0.0)), []
    while not told or robot.moving:
        robot.set_rate(1.0)
        told.append(robot.action((*robot.base_reference()[0], 0.0))[0])
        robot.now += 0.02
    assert max(told) > 1.0
    assert np.abs(np.diff(told, 2)).max() < 1.05 * ROBOT.limits.base.jerk * 0.02**2


@pytest.mark.parametrize("rate", [0.0, 0.4, 1.0])
def test_a_base_that_has_left_its_path_stops_as_soon_as_it_can_at_whatever_rate_it_is_asked_for(rate):
    robot = motion_along((3.0, 0.0))
    while np.hypot(*robot.base_reference()[1]) < 1.0:
        robot.set_rate(1.0)
        robot.now += 0.02
    assert not robot.stops
    at, motion = robot.now, robot.base_reference()
    robot.let_go(*motion)
    way = BasePath.to_rest(*motion, ROBOT.limits.as_commanded)
    while robot.moving:
        np.testing.assert_allclose(robot.base_reference(), way.at(robot.now - at), atol=1e-9)
        robot.set_rate(rate)
        robot.now += 0.02
    assert robot.now - at == pytest.approx(way.duration, abs=0.05)
    assert robot.stops  # until it has another path, or another episode begins
    here = robot.base_reference()[0]
    robot.reset((*here, 0.0))
    assert not robot.stops
    robot.let_go(here, (0.0, 0.0), (0.0, 0.0))
    robot.drive_along([here, (0.0, 0.0)], lambda _: True)
    assert not robot.stops


@pytest.mark.parametrize("off", [0.0, 0.04])
def test_a_base_that_comes_to_rest_is_not_told_to_turn_back(off):
    """A child may be at its heels: neither the servos' lag nor that it is ahead of its reference may lead back."""
    robot, lag = motion_along((3.0, 0.0)), ROBOT.servos.base_lag
    base, speed, told = np.zeros(3), 0.0, []
    for _ in range(150):
        if not robot.stops and speed > 0.8:
            robot.let_go(*robot.base_reference())
            base[0] += off
        robot.set_rate(1.0)
        asked = robot.action(base)[0]
        speed = asked + (speed - asked) * np.exp(-0.02 / lag)
        base[0] += 0.02 * speed
        told.append(asked)
        robot.now += 0.02
    assert robot.stops
    assert not robot.moving
    assert min(told) > -0.04
    # There it stays, and there it comes back to if it is pushed away.
    assert robot.base_reference()[0] == pytest.approx(base[:2], abs=1e-3)
    assert robot.action((base[0] + 0.02, *base[1:]))[0] < -0.02


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
def test_a_base_that_is_about_to_rest_does_not_turn_back_for_a_new_path(way):
    """A child may be at its heels: a path that would end the stop with less jerk must wait until the base rests."""
    robot = motion_along((3.0, 0.0))
    while np.hypot(*robot.base_reference()[1]) < 1.0:
        robot.set_rate(1.0)
        robot.now += 0.02
    robot.let_go(*robot.base_reference())
    while robot.base_reference()[1][0] > 0.1:
        robot.now += 0.02
    last = robot.base_reference()[0][0]
    for _ in range(20):
        here = robot.base_reference()[0]
        if robot.moving and robot.stops:
            with contextlib.suppress(PathError):
                robot.drive_along([here, (here[0] + way[0], here[1] + way[1])], lambda _: True)
        robot.set_rate(0.0)
        assert robot.base_reference()[0][0] >= last - 1e-6
        last = robot.base_reference()[0][0]
        robot.now += 0.02
    assert not robot.moving


def test_a_base_tells_how_much_of_its_speed_it_has(robot):
    assert (robot.is_driving, robot.rate) == (False, 0.0)
    robot.drive_along([(0.0, 0.0), (3.0, 0.0)], lambda _: True)
    rates = []
    for i in range(300):
        robot.set_rate(1.0 if i < 40 else 0.25)
        assert robot.is_driving or i > 100
        rates.append(robot.rate)
        robot.action((*robot.base_reference()[0], 0.0))
        robot.now += 0.02
    assert rates[1:39] == [1.0] * 38
    assert rates[100] == pytest.approx(0.25)
    while robot.is_driving:
        robot.now += 0.02
        robot.base_reference()
    assert (robot.rate, robot.base_reference()[0]) == (0.0, (3.0, 0.0))


def test_a_base_that_is_led_off_its_path_lets_go_of_it_without_a_jump():
    """It is told to go straight on where its path turns off; then it comes to rest from where it has got to."""
    robot = motion_along((0.5, 0.0), (0.5, 3.0))
    base, told = np.zeros(3), []

    def straight_on(velocity, before):
        return (velocity[0] if base[0] < 0.3 else before[0], 0.0), False

    while not robot.led_off:
        robot.set_rate(1.0)
        told.append(robot.action(base, restrain=straight_on)[:2])
        base[:2] += 0.02 * told[-1]
        robot.now += 0.02
    np.testing.assert_allclose(robot.base_reference()[0], base[:2], atol=0.03)
    assert told[-1][0] > 0.3
    while robot.moving:
        robot.set_rate(1.0)
        told.append(robot.action(base)[:2])
        base[:2] += 0.02 * told[-1]
        robot.now += 0.02
    acceleration = np.diff(told, axis=0) / 0.02
    assert np.hypot(*acceleration.T).max() <= 4.6
    assert np.hypot(*np.diff(acceleration, axis=0).T).max() / 0.02 <= 70.0
    np.testing.assert_allclose(robot.base_reference()[0], base[:2], atol=0.01)
    assert robot.led_off == 1


def turning(robot: RobotMotion, seconds: float) -> list[float]:
    """How fast the base turns, rad/s, at every control timestep of some time."""
    rates = []
    for _ in range(round(seconds / 0.02)):
        robot.action((0.0, 0.0, robot.yaw))
        robot.now += 0.02
        rates.append(robot.turning[0])
    return rates


def test_a_turn_under_way_slows_down_to_its_bound_and_speeds_up_when_it_is_lifted(robot):
    robot.turn_to(3.0)
    began = turning(robot, 0.5)[-1]
    assert began > 2.0
    robot.bound_turning(0.04)
    slows = turning(robot, 0.9)
    assert np.abs(np.diff(slows)).max() < 0.02 * ROBOT.limits.yaw.acceleration + 1e-6
    braked = round((began / ROBOT.limits.yaw.acceleration + 0.3) / 0.02)  # the jerk takes 0.21 s, and what it gains
    assert np.abs(slows[braked:]).max() < 0.04
    assert slows[-1] == pytest.approx(0.036)  # a little less, so that the next one need not change it
    robot.bound_turning(0.045)
    assert turning(robot, 0.1)[-1] == pytest.approx(0.036)  # for so little the solver is not asked
    robot.bound_turning(1.0)
    assert max(turning(robot, 0.5)) == pytest.approx(0.9)
    robot.bound_turning(np.inf)
    assert max(turning(robot, 1.5)) > 1.5
    assert robot.yaw == pytest.approx(3.0)


def test_a_turn_that_must_slow_down_does_not_speed_up_again_at_once(robot):
    """Allowed to, it would shake: the less it speeds up, the more it is allowed, and the other way round."""
    robot.turn_to(3.0)
    turning(robot, 0.08)
    robot.bound_turning(0.04)
    speeding_up = []
    for _ in range(15):
        turning(robot, 0.02)
        robot.bound_turning(2.0)
        speeding_up.append(robot.turning[1])
    last = speeding_up.index(min(speeding_up))
    assert speeding_up[0] > 1.0
    assert speeding_up[last] < 0.1
    assert speeding_up[: last + 1] == sorted(speeding_up[: last + 1], reverse=True)
    assert speeding_up[-1] > 2.0


def test_a_base_that_turns_slowly_for_what_it_holds_does_so_until_the_hand_opens(robot):

    def fastest_turn_to(yaw):
        robot.turn_to(yaw)
        rates = []
        while robot.turn_left(yaw):
            robot.now += 0.02
            rates.append(abs(robot.turning[0]))
        return max(rates)

    robot.turn_gently(0.4)
    robot.turn_gently()  # as anybody else would have it
    assert fastest_turn_to(1.5) == pytest.approx(0.4)
    robot.grip(ROBOT.grasp.open)
    assert fastest_turn_to(0.0) > 1.0


def test_a_hand_on_its_way_slows_down_to_a_creep_and_goes_on_when_it_need_not(robot):

    def reached_in(seconds, creeps):
        before = robot.reached
        for _ in range(round(seconds / 0.02)):
            robot.reach(1.0, creeps)
            robot.action((0.0, 0.0, 0.0))
            robot.now += 0.02
        return robot.reached - before

    fast = reached_in(0.3, creeps=False)
    reached_in(0.3, creeps=True)
    assert 0.0 < reached_in(0.3, creeps=True) < 0.2 * fast
    assert reached_in(0.2, creeps=False) > 0.2 * fast


def test_heading_turns_the_shorter_way():
    robot = at_rest((0.0, 0.0, 3.0))
    robot.turn_to(-3.0)
    for _ in range(100):
        robot.action((0.0, 0.0, robot.yaw))
        assert robot.yaw >= 3.0 - 1e-9
        robot.now += 0.02
    assert robot.yaw == pytest.approx(2 * np.pi - 3.0)


@pytest.mark.parametrize("delay", [0.06, 0.5])
def test_feedback_by_what_is_seen_late_does_not_swing(delay):
    """A base that is off its place, and told of it so late, comes back there without going far beyond."""
    robot, steps = at_rest(delay=delay), round(delay / 0.02)
    poses = [np.array([0.0, 0.05, 0.1])] * (steps + 1)
    for _ in range(round((2.0 + 10 * delay) / 0.02)):
        poses.append(poses[-1] + 0.02 * robot.action(poses[-1 - steps])[:3])
    after = np.array(poses)[:, 1:]
    assert after.min() > -0.01
    assert np.abs(after[-1]).max() < 0.01


@pytest.mark.parametrize("name", ["mobile_fr3", "mobile_ur5e"])
def test_a_turn_is_commanded_within_its_limits_whatever_its_bound_and_the_heading_that_is_seen(name):
    """The bound comes and goes with a child at the edge of where it counts, and the heading is seen with noise."""
    robot = at_rest(robot=find_embodiment(name))
    robot.turn_to(3.0)
    told = [0.0, 0.0]
    for i in range(60):
        robot.bound_turning(0.03 if i % 4 == 3 else 2.0)
        told.append(robot.action((0.0, 0.0, robot.yaw + 0.005 * (-1) ** i))[2])
        robot.now += 0.02
    acceleration = np.diff(told) / 0.02
    assert max(told) > 0.3
    assert np.abs(acceleration).max() <= robot.robot.limits.turn.acceleration
    assert np.abs(np.diff(acceleration)).max() / 0.02 <= robot.robot.limits.turn.jerk
