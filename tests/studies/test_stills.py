"""Stills of the robot at work: what there is to show, and how it is taken."""

import numpy as np
import pytest

from caregiver_mj.viz.episode import Episode
from studies.stills import show_grid, take_portrait


@pytest.fixture
def episode():
    return Episode.load(children=1.0, number=None, caregiver="none")


def test_portrait_is_soft_and_leaves_the_light_as_it_was(episode):
    physics = episode.env.physics
    sun = physics.data.ptr.light_xdir[physics.model.ptr.light("sun").id]
    before = sun.copy()
    size = {"look_at": [0.0, 0.0, 0.4], "distance": 2.0, "yaw": 0.0, "side": 120, "down": -30, "size": (160, 120)}
    picture = take_portrait(physics, **size)
    assert picture.shape == (120, 160, 3)
    assert picture.std() > 10
    np.testing.assert_array_equal(sun, before)


def test_the_grid_is_shown_alike_for_the_same_seed():
    picture = show_grid(3)
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 10
    np.testing.assert_array_equal(picture, show_grid(3))
