"""How long the robot takes for what a caregiver does: by hand, and in the house."""

import pytest

import caregiver_mj
from caregiver_mj.caregivers.percept import PAPER
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.policy.pace import handling_times, robot_pace
from caregiver_mj.robot.embodiments import EMBODIMENTS, find_embodiment
from caregiver_mj.robot.navigation import Navigator

# Eleven cells of 0.75 m from one landing to the other.
CORRIDOR = FloorPlan.parse("##############\n#S..........S#\n###B##########\n##############", "corridor")
NOWHERE_TO_GO = FloorPlan.parse("#####\n#B.B#\n#####", "toys")


@pytest.mark.parametrize("name", EMBODIMENTS)
def test_a_corridor_by_hand(name):
    robot = find_embodiment(name)
    speed, acceleration, jerk = robot.limits.base.velocity, robot.limits.base.acceleration, robot.limits.base.jerk
    seconds = 11 * 0.75 / speed + speed / acceleration + acceleration / jerk  # from rest to rest
    pace = robot_pace(Navigator(CORRIDOR, robot), 1.68, 0.02)
    assert pace.cells == pytest.approx(1.68 * 11 / seconds, rel=0.02)
    get, place = handling_times(robot)
    assert pace.get == pytest.approx(get / (seconds / 11), rel=0.02)
    assert pace.place == pytest.approx(place / (seconds / 11), rel=0.02)


@pytest.mark.parametrize("name", EMBODIMENTS)
def test_the_hand_takes_longer_than_its_parts_and_less_than_a_timestep(name):
    robot = find_embodiment(name)
    for seconds in handling_times(robot):
        assert robot.grasp.grip_time < seconds < 1.68


def test_a_house_without_ways():
    assert robot_pace(Navigator(NOWHERE_TO_GO, find_embodiment()), 1.68, 0.02) == PAPER


def test_the_policy_tells_its_caregiver():
    env = caregiver_mj.load("supervise", CORRIDOR, random=0)
    caregiver = caregiver_mj.CaregiverPolicy(env, "foresight").caregiver
    assert caregiver.pace == robot_pace(Navigator(CORRIDOR, find_embodiment()), env.task.novice_timestep, 0.02)
