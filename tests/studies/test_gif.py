"""The moving picture of the README."""

import contextlib

from PIL import Image

from caregiver_mj.studies.gif import frames, write
from caregiver_mj.viz.episode import Episode


def test_pictures_go_round_at_their_speed(tmp_path):
    path = tmp_path / "film.gif"
    picture = Image.linear_gradient("L").convert("RGB")
    write(path, (picture.rotate(angle) for angle in (0, 90, 180)))
    with Image.open(path) as film:
        assert (film.n_frames, film.info["loop"], film.info["duration"], film.size) == (3, 0, 100, (256, 256))


def test_frames_are_those_of_a_part_of_the_episode():
    episode = Episode.load(house="paper")
    with contextlib.closing(episode.env):
        pictures = list(frames(episode, 0.4, 0.8, 320, 240))
        assert [picture.size for picture in pictures] == [(320, 240)] * 2
        assert 0.4 < episode.env.physics.time() < 0.8
