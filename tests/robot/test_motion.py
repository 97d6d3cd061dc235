"""The robot's references and the actions that follow them."""

import numpy as np
import pytest

from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion

ROBOT = find_embodiment()
MAX_BASE_SPEED = 5.0 / 3.6  # m/s


def motion_along(*points: tuple[float, float], start=(0.0, 0.0, 0.0)) -> RobotMotion:
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset(start)
    robot.drive_along([start[:2], *points], lambda _: True)
    robot.set_rate(1.0)
    return robot


def test_an_ideal_base_follows_its_path_and_stops_at_its_end():
    robot = motion_along((2.0, 0.0), (2.0, 1.5))
    base, off = np.zeros(3), []
    for _ in range(300):
        robot.set_rate(1.0)
        action = robot.action(base)
        # A base whose velocity follows its command with the servos' lag would need the feed-forward; this one does not.
        base[:2] += 0.02 * action[:2]
        robot.now += 0.02
        off.append(np.hypot(*(base[:2] - robot.base_reference()[0])))
    assert max(off) < 0.02
    np.testing.assert_allclose(base[:2], [2.0, 1.5], atol=1e-4)
    np.testing.assert_allclose(action[:3], 0.0, atol=1e-3)
    assert not robot.moving


def test_a_base_tells_how_much_of_its_speed_it_has():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
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


def test_a_base_that_stops_before_it_has_turned_round_turns_where_it_stands():
    """The rest of its turn would lead it on to what it has stopped for."""
    robot = motion_along((4.0, 0.0))
    places, ahead = [], []
    for i in range(400):
        if i == 60:
            robot.drive_along([robot.base_reference()[0], (-2.0, 0.0)], lambda _: True)
            assert robot.planned()[0][0] > 1.0
        robot.set_rate(0.0 if 60 <= i < 160 else 1.0)
        robot.action((*robot.base_reference()[0], 0.0))
        places.append(robot.base_reference()[0][0])
        ahead.append(robot.planned()[0][0])
        robot.now += 0.02
    assert not np.diff(places[110:160]).any()  # it stands
    assert max(ahead[110:160]) < 0.0
    assert np.abs(np.diff(places)).max() < 0.02 * MAX_BASE_SPEED
    assert np.abs(np.diff(places, 2)).max() < 0.02**2 * 2.5  # and has not jumped
    assert max(places) == max(places[:160])
    assert places[-1] == pytest.approx(-2.0)


def test_a_base_held_up_is_never_told_to_exceed_its_speed():
    robot = motion_along((3.0, 3.0))
    for _ in range(75):
        robot.set_rate(1.0)
        assert np.hypot(*robot.action((0.0, 0.0, 0.0))[:2]) <= MAX_BASE_SPEED
        assert np.hypot(*robot.base_reference()[0]) < 0.2  # and does not leave it behind
        robot.now += 0.02


def test_a_base_at_which_nobody_looks_any_more_stops():
    robot = motion_along((3.0, 0.0))
    base = np.zeros(3)
    for step in range(100):
        if step < 40:
            robot.set_rate(1.0)
        base[:2] += 0.02 * robot.action(base)[:2]
        robot.now += 0.02
        if step == 40:
            there = base[0]
            _, velocity, acceleration = robot.base_reference()
    assert there > 0.3
    # What it takes to brake, as the base's limits say of one that still speeds up.
    deceleration, build_up = ROBOT.limits.braking(velocity, acceleration)
    assert base[0] - there < velocity[0] ** 2 / (2 * deceleration) + velocity[0] * (build_up + 0.02)
    assert not robot.moving


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
    assert np.hypot(*acceleration.T).max() <= 2.0
    assert np.hypot(*np.diff(acceleration, axis=0).T).max() / 0.02 <= 35.0
    np.testing.assert_allclose(robot.base_reference()[0], base[:2], atol=0.01)
    assert robot.led_off == 1


def test_a_base_that_something_holds_up_lets_go_of_its_path_and_stops():
    """It would else push what holds it up for as long as it takes to brake."""
    robot = motion_along((3.0, 0.0))
    while not robot.led_off:
        robot.set_rate(1.0)
        robot.action((0.0, 0.0, 0.0))
        robot.now += 0.02
    assert not robot.is_driving
    assert robot.base_reference()[0] == (0.0, 0.0)


def test_a_standing_base_that_is_pushed_keeps_its_place_for_longer():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    for off, let_go in ((0.1, 0), (0.16, 1)):
        robot.action((off, 0.0, 0.0), restrain=lambda velocity, before: ((0.0, 0.0), False))
        robot.action((off, 0.0, 0.0), restrain=lambda velocity, before: ((0.0, 0.0), False))
        assert robot.led_off == let_go
    assert robot.base_reference()[0] == (0.16, 0.0)


def test_a_gentle_base_is_pushed_away_without_pushing_back():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))

    def told():
        return [robot.action((0.1, 0.1, 0.0))[:2] for _ in range(20)][-1]

    firm = np.hypot(*told())
    robot.catch_up = 0.03
    back = told()
    assert 0.2 < firm <= 0.3 + 1e-9
    assert np.hypot(*back) < 0.05  # m/s, the speed of a strike
    assert (back < 0).all()


def test_a_robot_told_to_turn_gently_does_until_its_gripper_opens():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    fastest = []
    for _ in range(2):
        robot.turn_gently()
        if fastest:
            robot.grip(0.036)
        robot.turn_to(robot.yaw + 3.0)
        rates = []
        for _ in range(200):
            rates.append(robot.action((0.0, 0.0, robot.yaw))[2])
            robot.now += 0.02
        fastest.append(max(rates))
    assert fastest[0] < 1.6  # the limit, and the feed-forward of the servo's lag
    assert fastest[1] > 2.5


def turning(robot: RobotMotion, seconds: float) -> list[float]:
    """How fast the base turns, rad/s, at every control timestep of some time."""
    rates = []
    for _ in range(round(seconds / 0.02)):
        robot.action((0.0, 0.0, robot.yaw))
        robot.now += 0.02
        rates.append(robot.turning[0])
    return rates


def test_a_turn_under_way_slows_down_to_its_bound_and_speeds_up_when_it_is_lifted():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
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


def test_a_turn_that_brakes_goes_on_doing_so_until_there_is_room_for_it():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    robot.turn_to(3.0)
    turning(robot, 0.5)
    robot.bound_turning(0.04)
    assert turning(robot, 0.1)[-1] > 1.5
    robot.bound_turning(0.5)
    assert np.abs(turning(robot, 0.9)[-10:]).max() < 0.04


@pytest.mark.parametrize("slips", [False, True])
def test_the_bound_of_a_turn_outlasts_what_is_told_of_the_candle(slips):
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    robot.turn_to(3.0)
    robot.bound_turning(0.2)
    if slips:
        robot.turn_gently()
    assert max(turning(robot, 1.0)) < 0.2
    robot.bound_turning(np.inf)
    assert max(turning(robot, 1.0)) > 1.0


@pytest.mark.parametrize("rate", [0.0, 0.6])
def test_a_base_that_is_slowed_down_goes_on_braking_whatever_new_ways_it_takes(rate):
    """A new way that began to brake anew would lead it a step farther each time, to what it brakes for."""
    speeds, places = {}, {}
    for ways in (0, 5):
        robot = motion_along((6.0, 0.0))
        path = []
        for i in range(160):
            if 60 <= i < 60 + 4 * ways and i % 4 == 0:
                there = robot.base_reference()[0]
                robot.drive_along([there, (6.0, 0.001 * i)], lambda _: True)
            robot.set_rate(1.0 if i < 55 else rate)
            robot.action((*robot.base_reference()[0], 0.0))
            path.append([*robot.base_reference()[0], *robot.base_reference()[1]])
            robot.now += 0.02
        places[ways], speeds[ways] = np.array(path)[:, 0], np.hypot(*np.array(path)[:, 2:].T)
    assert speeds[0][55] > 1.0
    assert (speeds[5] < speeds[0] + 0.01).all()
    assert (places[5] < places[0] + 0.01).all()
    assert speeds[5][100] == pytest.approx(speeds[0][100], abs=0.3)
    # Nor do its speed or its acceleration jump.
    change = np.diff(speeds[5]) / 0.02
    assert np.abs(change).max() < ROBOT.limits.as_told.acceleration
    assert np.abs(np.diff(change)).max() / 0.02 < ROBOT.limits.as_told.jerk


@pytest.mark.parametrize(("rate", "degrees", "most"), [(0.25, 40.0, 0.05), (0.6, 40.0, 0.2)])
def test_a_slow_base_turns_into_a_new_way_as_slow_as_it_is(rate, degrees, most):
    """Not as one that goes as fast as its path was planned, which would swing out farther."""
    robot = motion_along((6.0, 0.0))
    turn = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    off = []
    for i in range(240):
        if i == 140:
            there = np.array(robot.base_reference()[0])
            robot.drive_along([tuple(there), tuple(there + 2.0 * turn)], lambda _: True)
        robot.set_rate(1.0 if i < 30 else rate)
        robot.action((*robot.base_reference()[0], 0.0))
        if i >= 140:
            x, y = robot.base_reference()[0] - there
            off.append(abs(x * turn[1] - y * turn[0]))
        robot.now += 0.02
    assert 0.0 < max(off) < most


def test_heading_turns_the_shorter_way():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 3.0))
    robot.turn_to(-3.0)
    for _ in range(100):
        robot.action((0.0, 0.0, robot.yaw))
        assert robot.yaw >= 3.0 - 1e-9
        robot.now += 0.02
    assert robot.yaw == pytest.approx(2 * np.pi - 3.0)


@pytest.mark.parametrize("called_back", [0.2, 0.4])
def test_hand_out_foresees_how_far_the_hand_still_swings(called_back):
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    robot.reach(0.78)
    robot.now = called_back
    robot.reach(0.0)
    foreseen = robot.hand_out
    swing = []
    for _ in range(100):
        swing.append(robot.reached)
        robot.now += 0.01
    assert max(swing) > swing[0] + 0.01
    assert foreseen >= max(swing) - 1e-3


def test_a_heading_that_has_been_pushed_away_comes_back_by_and_by():
    robot = RobotMotion(ROBOT, 0.02)
    robot.reset((0.0, 0.0, 0.0))
    robot.giving_way.yields = True
    pushed = (0.0, 0.0, 0.3)  # radians
    assert robot.action(pushed)[2] == pytest.approx(-0.02)
    robot.giving_way.yields, robot.catch_up = False, 1.0  # nobody is near
    rates = [-robot.action(pushed)[2] for _ in range(60)]
    assert rates[:3] == pytest.approx([0.04, 0.06, 0.08])  # 1 rad/s^2
    assert rates[-1] == pytest.approx(0.5)


@pytest.mark.parametrize("delay", [0.0, 0.06, 0.5])
def test_feedback_by_what_is_seen_late_does_not_swing(delay):
    """A base that is off its place, and told of it so late, comes back there without going far beyond."""
    robot, steps = RobotMotion(ROBOT, 0.02, delay), round(delay / 0.02)
    robot.reset((0.0, 0.0, 0.0))
    poses = [np.array([0.0, 0.05, 0.1])] * (steps + 1)
    for _ in range(round((2.0 + 10 * delay) / 0.02)):
        poses.append(poses[-1] + 0.02 * robot.action(poses[-1 - steps])[:3])
    after = np.array(poses)[:, 1:]
    assert after.min() > -0.01
    assert np.abs(after[-1]).max() < 0.01


# -- Where the robot does not see exactly ----------------------------------------------------------------


def reaching(hand_error: float, out: float) -> list[float]:
    """How far out the hand is, timestep by timestep, that is told to reach its goal when it is so far out."""
    robot = RobotMotion(ROBOT, 0.02, hand_error=hand_error)
    robot.reset((0.0, 0.0, 0.0))
    robot.plan_reach(0.70)
    robot.reach(0.77)
    shares = [0.0]
    while shares[-1] < 1.0 or not shares:
        if shares[-1] >= out:
            robot.reach(1.0)
            assert robot.reach_arrival > robot.now or shares[-1] == 1.0
        robot.action((0.0, 0.0, 0.0))
        robot.now += 0.02
        shares.append(robot.reached)
        assert len(shares) < 1000
    return shares


@pytest.mark.parametrize("out", [0.3, 0.77])
def test_a_hand_that_may_be_off_comes_down_slowly_and_not_too_far(out):
    """It stops first if it is on its way; that it has arrived it does not say before."""
    exact, off = reaching(0.0, out), reaching(0.005, out)
    assert max(off) == max(exact) == 1.0
    last = [np.diff([share for share in shares if share > 0.9]).max() for shares in (exact, off)]
    assert last[1] < 0.3 * last[0]
    # It comes back as quickly as ever.
    robot = RobotMotion(ROBOT, 0.02, hand_error=0.005)
    robot.reset((0.0, 0.0, 0.0))
    quick = RobotMotion(ROBOT, 0.02)
    quick.reset((0.0, 0.0, 0.0))
    for each in (robot, quick):
        each.reach(0.5)
        each.now = 3.0
        each.reach(0.0)
    assert robot.reach_arrival == quick.reach_arrival


def test_feedback_does_not_jolt_a_base_that_seems_to_jump():
    told = []
    for jumps in (0.0, 0.0015):
        robot, random = RobotMotion(ROBOT, 0.02, base_jumps=jumps), np.random.default_rng(0)
        robot.reset((0.0, 0.0, 0.0))
        off, rows = 0.0, []
        for _ in range(400):
            off += 0.3 * (random.normal() * 0.005 - off)
            rows.append(robot.action((off, 0.0, 0.0))[0])
            robot.now += 0.02
        told.append(np.abs(np.diff(rows, 2)).max() / 0.02**2)
    assert told[1] < 0.7 * ROBOT.limits.base_jerk < 0.85 * ROBOT.limits.base_jerk < told[0]


def test_what_the_base_is_told_leaves_room_for_what_the_arm_adds():
    # Measured in the house: 0.145 m/s^2, of an arm that turns from speeding up to slowing down.
    assert ROBOT.limits.as_told.acceleration + 0.145 < ROBOT.limits.base_acceleration
