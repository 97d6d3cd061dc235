"""Policies that see through the cameras: what they see is the house, wherever they act."""

import numpy as np
import pytest

from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.envs.recipe import Recording, prepared
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import EpisodeSpec, episode_seed
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, Studio, render_episode

TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
HERE = __name__
CAMERAS = ("overview", "follow", "wrist", "eye")
seen = []  # by the policies below, the pictures of each camera


class Seeing:
    needs_pictures = True

    def __init__(self, env):
        self.env, self.action = env, np.zeros(env.action_spec().shape)

    def __call__(self, timestep):
        if timestep.first():
            seen.append([self.env.physics.render(48, 64, camera_id=name) for name in CAMERAS])
        return self.action


@pytest.mark.slow
def test_a_policy_sees_the_same_in_evaluate_record_and_render(tmp_path):
    seen.clear()
    evaluate(Settings(TINY, "house", (f"{HERE}:Seeing",), (1.0,), 1))
    ((*pictures,),) = seen  # at the start of episode 0 of seed 0, an array a camera
    seen.clear()
    for picture in pictures:
        assert picture.std() > 10  # the sky alone has less
    spec = EpisodeSpec(TINY, 1.0, f"{HERE}:Seeing")
    env, actor = prepared(Recording(spec))
    env.reset(seed=episode_seed(0, 0))
    actor.begin(0)
    actor.act()
    render_episode(tmp_path / "film.mp4", spec, seconds=0.1, quiet=True)
    recorded, filmed = seen
    for mine, others, also in zip(pictures, recorded, filmed, strict=True):
        np.testing.assert_array_equal(mine, others)
        np.testing.assert_array_equal(mine, also)


class Looking(PaperCaregiver):
    """Looks at a percept's pictures."""

    needs_pictures = True


@pytest.mark.parametrize("who", ["Seeing", "Looking"])
def test_it_sees_the_same_while_it_is_filmed(who):
    episode = Episode(EpisodeSpec(TINY, 1.0, f"{HERE}:{who}"))
    pictures = []
    for _ in range(2):
        pictures.append(episode.env.physics.render(240, 320, camera_id="overview").copy())
        Studio(episode, Picture(320, 240), 1).frame()
    np.testing.assert_array_equal(*pictures)
