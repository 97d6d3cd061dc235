"""Stills of the robot at work: what there is to show, and how it is taken."""

import numpy as np
import pytest

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.tasks import load
from caregiver_mj.viz.episode import Episode
from studies.stills import show_grid, take_portrait, views


@pytest.fixture
def episode():
    return Episode.load(children=1.0, number=None, caregiver="none")


def test_nothing_to_take_a_picture_of_at_the_start():
    env = load("supervise", random=3)
    policy = CaregiverPolicy(env)
    env.step(policy(env.reset()))
    assert views(env.physics, policy) == {}


def test_portrait_is_soft_and_leaves_the_light_as_it_was(episode):
    physics = episode.env.physics
    sun = physics.data.ptr.light_xdir[physics.model.ptr.light("sun").id]
    before = sun.copy()
    size = {"look_at": [0.0, 0.0, 0.4], "distance": 2.0, "yaw": 0.0, "side": 120, "down": -30, "size": (160, 120)}
    picture = take_portrait(physics, **size)
    assert picture.shape == (120, 160, 3)
    assert picture.std() > 10
    np.testing.assert_array_equal(sun, before)


def test_portrait_is_taken_from_inside_the_house(episode):
    # South of the middle one looks south from north of it, whichever way the robot there looks.
    physics, look_at = episode.env.physics, [0.0, -2.0, 0.4]
    seen = {"look_at": look_at, "distance": 2.0, "side": 90, "down": -30, "size": (160, 120)}
    one, other = (take_portrait(physics, yaw=yaw, **seen) for yaw in (0.0, np.pi))
    np.testing.assert_array_equal(one, other)


def test_the_grid_is_shown_alike_for_the_same_seed():
    picture = show_grid(3)
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 10
    np.testing.assert_array_equal(picture, show_grid(3))
