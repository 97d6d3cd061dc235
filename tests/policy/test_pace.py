"""How long the robot takes for what a caregiver does: by hand, and in the house."""

import numpy as np
import pytest

from caregiver_mj import CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers.percept import PAPER
from caregiver_mj.policy.pace import beside_a_child, handling_times, robot_pace
from caregiver_mj.robot.embodiments import EMBODIMENTS, find_embodiment
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.separation import allowed_rate
from caregiver_mj.robot.skills import Pick, Place
from caregiver_mj.robot.view import ChildView, View

# Eleven cells of 0.75 m from one landing to the other.
CORRIDOR = FloorPlan.parse("##############\n#S..........S#\n###B##########\n##############", "corridor")
ROOM = FloorPlan.parse(
    """
####################
#B.................#
#..............C.T.#
#B.................#
####################
""",
    "room",
)
NOWHERE_TO_GO = FloorPlan.parse("#####\n#B.B#\n#####", "toys")


@pytest.mark.parametrize("name", EMBODIMENTS)
def test_a_corridor_by_hand(name):
    robot = find_embodiment(name)
    speed, acceleration, jerk = robot.limits.base.velocity, robot.limits.base.acceleration, robot.limits.base.jerk
    of_a_cell = 0.75 / speed
    pace = robot_pace(Navigator(CORRIDOR, robot), 1.68, 0.02)
    assert pace.cells == pytest.approx(1.68 / of_a_cell, rel=0.02)
    assert pace.start == pytest.approx((speed / acceleration + acceleration / jerk) / of_a_cell, rel=0.02)
    get, place = handling_times(robot)
    assert pace.get == pytest.approx(get / of_a_cell, rel=0.02)
    assert pace.place == pytest.approx(place / of_a_cell, rel=0.02)


@pytest.mark.parametrize("name", EMBODIMENTS)
def test_a_child_ahead_makes_it_slower_the_nearer_it_is(name):
    robot = find_embodiment(name)
    beside = np.array(beside_a_child(robot, 0.75, 1.3))
    assert (beside >= 1.0).all()
    assert (np.diff(beside[1:, 0]) <= 0.0).all()  # straight ahead, from the next cell on
    assert beside[1, 0] > beside[2, 0] > 1.0
    assert beside[-1].max() < 1.02  # from where it begins to count
    # Two cells ahead: with the middles 1.5 m apart at first, 0.75 m at last, and so no faster than at first.
    stands, nothing = (ChildView((1.5, 0.0), (0.0, 0.0)),), np.zeros((0, 4))
    view = View(0.0, (0.0, 0.0, 0.0), 0.0, nothing, stands, nothing[:, :3], nothing)
    assert beside[2, 0] > 1.0 / allowed_rate(view, robot, (1.3, 0.0))


def test_beside_a_faster_child_it_has_less_time_and_is_slower():
    robot = find_embodiment()
    navigator = Navigator(CORRIDOR, robot)
    slow, fast = (robot_pace(navigator, 0.75 / speed, 0.02, speed) for speed in (0.4, 0.8))
    assert slow.cells == pytest.approx(2 * fast.cells)
    assert slow.get == fast.get
    ahead = [np.array(pace.beside)[1:3, 0] for pace in (slow, fast)]
    assert (ahead[0] < ahead[1]).all()


def test_candles_take_as_long_in_the_house_as_the_pace_says():
    """The sum of six ways to a candle and with it, each from rest to rest, with a child that keeps to the other end."""
    env = load("relocate_candle", ROOM, 0.0, random=0, task_kwargs={"embodiment": "mobile_ur5e"}, visuals=False)
    policy = CaregiverPolicy(env)
    pace, timesteps, took, told = policy.caregiver.pace, 1.68, 0.0, 0.0
    for _ in range(3):
        timestep, doing = env.reset(), None
        while not timestep.last():
            timestep = env.step(policy(timestep))
            skill = getattr(policy.executive.routine, "skill", None)
            took += 0.02 * isinstance(skill, Pick | Place)
            if isinstance(skill, Pick | Place) and type(skill) is not doing:
                doing = type(skill)
                here = ROOM.caregiver_cells.index(ROOM.cell_at(timestep.observation["base_position"]))
                stands = ROOM.graph.beside([ROOM.tables[skill.table]])[0]
                cells = ROOM.graph.distances_from([here])[0][stands].min()
                told += (pace.start + cells + (pace.get if doing is Pick else pace.place)) / pace.cells * timesteps
    assert took == pytest.approx(told, rel=0.2)


def test_a_house_without_ways():
    assert robot_pace(Navigator(NOWHERE_TO_GO, find_embodiment()), 1.68, 0.02) == PAPER


def test_the_policy_tells_its_caregiver():
    env = load("supervise", CORRIDOR, random=0)
    caregiver = CaregiverPolicy(env, "foresight").caregiver
    assert caregiver.pace == robot_pace(Navigator(CORRIDOR, find_embodiment()), env.task.novice_timestep, 0.02)
