"""The figure of a child: it walks as toddlers do, and what happens in the house does not depend on it."""

import math
import pickle

import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.figure import Mood
from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan

ROOM = FloorPlan.parse("#######\n#B....#\n#..o..#\n#.....#\n#.S..T#\n#######", "room")
STEP = 0.02  # seconds


class Walker:
    """A child that does as it is told, in a house with visuals."""

    def __init__(self):
        self.physics = Physics.from_plan(ROOM, robot=False)
        self.walk = ToddlerWalk(1.68)
        self.walk.reset((0.0, 0.0), 0.0)
        self.physics.figures[0].reset()

    def go(self, seconds, speed=0.0, robot=None, **mood):
        """Walks on along x, and returns where its parts were after each step, by name (steps, 3)."""
        looks = []
        for _ in range(round(seconds / STEP)):
            self.walk.velocity = (speed, 0.0)
            self.walk.position = (self.walk.position[0] + speed * STEP, 0.0)
            self.physics.set_toddler(self.walk)
            self.physics.figures[0].step(self.walk, Mood(**mood), robot, STEP)
            self.physics.forward()
            looks.append(self.physics.data.geom_xpos.copy())
        names = [self.physics.model.geom(i).name for i in range(self.physics.model.ngeom)]
        return {
            name.removeprefix("toddler/"): np.array(looks)[:, i]
            for i, name in enumerate(names)
            if name.startswith("toddler/")
        }


def heading(parts, one, other):
    """The angle on the floor of the way from one part to another at the end, radians."""
    x, y, _ = parts[other][-1] - parts[one][-1]
    return math.atan2(y, x)


@pytest.mark.parametrize("robot", [False, True])
def test_with_a_figure_everything_happens_exactly_as_without(robot):
    states, shown = [], []
    for visuals in (True, False):
        kwargs = {"robot": robot, "time_limit": 20.0}
        env = caregiver_mj.load("supervise", ROOM, "1,1", random=1, task_kwargs=kwargs, visuals=visuals)
        timestep = env.reset()
        action = np.zeros(env.action_spec().shape)
        for _ in range(900):
            timestep = env.step(action)
            states.append(env.physics.get_state())
            shown.append(np.concatenate([np.ravel(value) for value in timestep.observation.values()]))
        assert len(env.physics.figures) == (2 if visuals else 0)
    assert env.task.outcome()["damage"] > 0
    half = len(states) // 2
    np.testing.assert_array_equal(states[:half], states[half:])
    np.testing.assert_array_equal(shown[:half], shown[half:])


def test_legs_pass_each_other_once_in_a_step_and_one_foot_is_on_the_floor():
    walker = Walker()
    walker.go(0.5, speed=0.45)  # gets going
    parts = walker.go(4.0, speed=0.45)
    ahead = (parts["sole_l"] - parts["sole_r"])[:, 0]
    steps = np.count_nonzero(np.diff(np.sign(ahead)))
    assert 0.12 <= 4.0 * 0.45 / steps <= 0.25  # metres, of toddlers in their first months of walking
    lower = np.minimum(parts["sole_l"], parts["sole_r"])[:, 2]
    assert np.abs(lower - lower.mean()).max() < 0.015
    assert -0.005 < lower.mean() - 0.01 < 0.015  # half of a sole's thickness
    # The foot that stands stays where it is, or nearly so: it is not dragged along.
    speeds = np.abs(np.diff([parts["sole_l"][:, 0], parts["sole_r"][:, 0]], axis=1)) / STEP
    assert np.median(speeds.min(axis=0)) < 0.15
    # Arms swing against the legs.
    arms = (parts["hand_l"] - parts["hand_r"])[:, 0]
    assert np.corrcoef(arms, ahead)[0, 1] < -0.5


def test_it_stands_still_when_the_child_does():
    walker = Walker()
    walker.go(0.75, speed=0.45)
    parts = walker.go(1.5)
    for name in ("sole_l", "sole_r", "hand_l", "head"):
        assert np.ptp(parts[name][-10:], axis=0).max() < 1e-3, name
    assert np.abs(parts["sole_l"][-1] - parts["sole_r"][-1])[0] < 0.01


def test_it_sits_down_when_hurt_and_gets_up_again():
    walker = Walker()
    standing, hurt = walker.go(1.0), walker.go(1.0, hurt=True)
    assert standing["hips"][-1, 2] - hurt["hips"][-1, 2] > 0.15
    assert hurt["shoe_l"][-1, 0] - hurt["hips"][-1, 0] > 0.15  # legs before it
    assert min(place[-1, 2] for place in hurt.values()) > -0.01
    assert walker.go(3.0)["hips"][-1, 2] == pytest.approx(standing["hips"][-1, 2], abs=1e-3)


def test_it_looks_at_a_robot_that_is_near_and_ahead_otherwise():
    walker = Walker()
    assert heading(walker.go(1.5, robot=(1.0, 1.0)), "head", "nose") == pytest.approx(math.pi / 4, abs=0.05)
    assert heading(walker.go(1.5, robot=(1.0, -1.0)), "head", "nose") == pytest.approx(-math.pi / 4, abs=0.05)
    assert heading(walker.go(1.5, robot=(4.0, 4.0)), "head", "nose") == pytest.approx(0.0, abs=0.05)
    assert abs(heading(walker.go(1.5, robot=(-1.0, 0.1)), "head", "nose")) < 1.2  # no owl


def test_hands_reach_over_the_table_and_what_it_has_taken_is_seen_in_one():
    walker = Walker()
    rest, reaching = walker.go(1.0), walker.go(1.0, reaches=True)
    assert (reaching["hand_l"] - rest["hand_l"])[-1, 0] > 0.1
    assert reaching["hand_l"][-1, 2] > 0.55  # metres; tables are 0.60 m high
    assert np.linalg.norm(rest["held"] - rest["hand_r"], axis=1).max() < 0.005  # within the hand
    eating = walker.go(1.0, holds=True)
    assert np.linalg.norm(eating["held"][-1] - eating["hand_r"][-1]) > 0.03
    assert np.linalg.norm(eating["held"][-1] - eating["mouth"][-1]) < 0.08
    walker.physics.figures[0].reset()
    anew = walker.go(0.1)
    assert np.linalg.norm(anew["held"][-1] - anew["hand_r"][-1]) < 0.005


def test_the_same_episode_looks_the_same():
    turns = []
    for _ in range(2):
        env = caregiver_mj.load("supervise", ROOM, 1.0, random=1, task_kwargs={"robot": False})
        env.reset()
        for _ in range(200):
            env.step(np.zeros(0))
        turns.append(env.physics.model.body_quat.copy())
    np.testing.assert_array_equal(*turns)
    assert np.ptp(turns[0], axis=0).max() > 0


def leg(physics):
    return physics.model.body_quat[physics.model.body("toddler/leg_l").id].copy()


@pytest.mark.parametrize("again", [Physics.copy, lambda physics: pickle.loads(pickle.dumps(physics))])
def test_a_copy_walks_on_as_the_original_does(again):
    walker = Walker()
    walker.go(0.8, speed=0.4)
    copied = again(walker.physics)
    walker.go(STEP, speed=0.4)
    copied.figures[0].step(walker.walk, Mood(), None, STEP)
    assert copied.figures[0].walked == walker.physics.figures[0].walked > 0.3
    assert (leg(copied) == leg(walker.physics)).all()


def test_a_copy_that_shares_the_model_poses_nobody_in_it():
    walker = Walker()
    walker.go(0.8, speed=0.4)
    assert not walker.physics.copy(share_model=True).figures


@pytest.mark.parametrize("how", ["depth", "segmentation"])
def test_the_robots_eye_has_depth_and_segmentation(how):
    physics = Physics.from_plan(ROOM)
    physics.forward()
    assert physics.render(24, 32, "eye", **{how: True}).shape[:2] == (24, 32)
