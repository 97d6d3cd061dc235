"""Cameras: what they leave out is not missed."""

import numpy as np
import pytest

from caregiver_mj.errors import CaregiverError
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.portrait import take_portrait
from caregiver_mj.viz.still_camera import StillCamera
from caregiver_mj.viz.studio import Studio

# isort: split
from dm_control.mujoco import engine


@pytest.fixture
def episode():
    return Episode.load(children=1.0, number=None, caregiver="none")


def test_redrawn_part_equals_the_whole_picture_drawn_anew(episode):
    physics = episode.env.physics
    size = {"height": 240, "width": 480}
    still = StillCamera(physics, "overview", **size)
    for second in range(1, 12):
        episode.run_until(second)
        picture = still.render()
        whole = engine.Camera(physics, **size, camera_id="overview").render()
        assert (picture != whole).any(axis=2).sum() < 20  # rounding at the edges of shapes
    assert episode.seconds > 10


def test_camera_is_called_by_the_last_part_of_its_name(episode):
    assert Studio(episode, 320, 240, "follow", 10).frame().shape == (240, 320, 3)
    with pytest.raises(CaregiverError, match="no camera 'wrist': there are follow, overview"):
        Studio(episode, 320, 240, "wrist", 10)


def test_frames_follow_what_happens(episode):
    studio = Studio(episode, 320, 240, "overview", 10)
    first = studio.frame()
    np.testing.assert_array_equal(studio.frame(), first)
    episode.run_until(2.0)
    assert (studio.frame() != first).any()


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
