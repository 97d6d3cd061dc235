"""Cameras: what they leave out is not missed."""

import pytest

from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.house.rendering import engine
from caregiver_mj.viz.cameras import StillCamera
from caregiver_mj.viz.episode import Episode


@pytest.fixture
def episode():
    return Episode(EpisodeSpec("paper", 1.0, "none", None))


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
