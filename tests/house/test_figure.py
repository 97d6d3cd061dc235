"""The figure of a child: it walks as toddlers do, and what happens in the house does not depend on it."""

import pickle

import numpy as np
import pytest

from caregiver_mj import FloorPlan, load
from caregiver_mj.children.walk import ToddlerWalk
from caregiver_mj.house.figure import Mood
from caregiver_mj.house.physics import Physics

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
        return {name.removeprefix("toddler/"): np.array(looks)[:, i] for i, name in enumerate(names)}


@pytest.mark.parametrize("robot", ["", "mobile_fr3", "mobile_ur5e"])
def test_without_visuals_the_house_is_smaller_and_everything_happens_exactly_as_with_them(robot):
    states, shown, geoms = [], [], []
    for visuals in (True, False):
        kwargs = {"embodiment": robot, "time_limit": 20.0} if robot else {"robot": False, "time_limit": 20.0}
        env = load("supervise", ROOM, "1,1", random=1, task_kwargs=kwargs, visuals=visuals)
        timestep = env.reset()
        action = np.zeros(env.action_spec().shape)
        for _ in range(900):
            timestep = env.step(action)
            states.append(env.physics.get_state())
            shown.append(np.concatenate([np.ravel(value) for value in timestep.observation.values()]))
        assert len(env.physics.figures) == (2 if visuals else 0)
        geoms.append(env.physics.model.ngeom)
    assert geoms[1] < geoms[0] / 5
    assert env.task.outcome()["damage"] > 0
    half = len(states) // 2
    np.testing.assert_array_equal(states[:half], states[half:])
    np.testing.assert_array_equal(shown[:half], shown[half:])


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


def test_a_foot_that_stands_hardly_slips():
    """By the middle of each sole, of which the lower one stands."""
    parts = Walker().go(3.0, speed=0.45)
    soles = np.stack([parts["sole_l"], parts["sole_r"]], axis=1)[50:]  # (steps, 2, 3), in its stride
    speed = np.linalg.norm(np.diff(soles[..., :2], axis=0), axis=2) / STEP
    stands = soles[1:, :, 2].argmin(axis=1)
    assert np.median(speed[np.arange(len(speed)), stands]) < 0.15 * 0.45


def test_a_figure_comes_to_rest():
    """Its parts would else decay on into the smallest numbers, with which a step takes 20 times as long."""
    walker = Walker()
    walker.go(1.0, speed=0.4, robot=(1.0, 1.0), reaches=True, hurt=True, holds=True)
    walker.go(15.0)
    state = walker.physics.figures[0].state
    assert {name: value for name, value in state.items() if value} == {"walked": state["walked"]}
