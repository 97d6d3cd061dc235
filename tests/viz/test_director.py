"""The camera that tells the story: the whole house is in the picture, and those whom a moment is about."""

import numpy as np
import pytest

from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.house.rendering import engine
from caregiver_mj.viz import director
from caregiver_mj.viz.cameras import FOVY, Camera
from caregiver_mj.viz.episode import Episode


@pytest.fixture(scope="module")
def episode():
    return Episode(EpisodeSpec("paper", 0.5, "expected-danger", seed=0))


def test_what_a_camera_anywhere_leaves_out_is_not_missed(episode):
    physics = episode.env.physics
    pose = director.CloseShot(1.0, 10.0).follow(episode.hud_state(1))
    fovy = physics.model.vis.global_.fovy
    picture = Camera(physics, pose, 320, 240).render()
    assert physics.model.vis.global_.fovy == fovy
    whole = engine.MovableCamera(physics, 240, 320)
    whole.set_pose(pose.place, pose.distance, 90.0, -np.degrees(pose.elevation))
    physics.model.vis.global_.fovy = FOVY
    drawn = whole.render(render_flag_overrides={"shadow": False})
    physics.model.vis.global_.fovy = fovy
    assert (picture != drawn).any(axis=2).sum() < 20  # rounding at the edges of shapes
    assert picture.std() > 10
