"""Cameras: what they leave out is not missed."""

import numpy as np
import pytest

from caregiver_mj.errors import CaregiverError
from caregiver_mj.house.rendering import engine
from caregiver_mj.viz.cameras import StillCamera
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Studio


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
