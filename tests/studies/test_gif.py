"""Moving pictures: that of the README, and of the grid."""

import contextlib
import importlib.util
import itertools
import pathlib

from PIL import Image

from caregiver_mj.viz.episode import Episode
from studies.gif import frames


def test_frames_are_those_of_a_part_of_the_episode():
    episode = Episode.load(house="paper")
    with contextlib.closing(episode.env):
        pictures = list(frames(episode, 0.4, 0.8, 320, 240))
        assert [picture.size for picture in pictures] == [(320, 240)] * 2
        assert 0.4 < episode.env.physics.time() < 0.8


def test_an_episode_in_the_grid_is_filmed(tmp_path, capsys):
    script = pathlib.Path(__file__).parents[2] / "scripts" / "grid_film.py"
    spec = importlib.util.spec_from_file_location("grid_film", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    path = tmp_path / "hall.gif"
    module.main(["hall-3", str(path), "--caregiver", "guard", "--seed", "20", "--end", "12"])
    with Image.open(path) as film:
        pictures = []
        for number in range(film.n_frames):
            film.seek(number)
            pictures.append(film.convert("RGB"))
    assert len(pictures) > 12  # pictures in which nothing moves are shown longer instead
    assert pictures[0].size == (18 * module.CELL + 2 * module.PAD, 5 * module.CELL + 2 * module.PAD + module.CAPTION)
    assert all(a.tobytes() != b.tobytes() for a, b in itertools.pairwise(pictures))
    assert ": damage " in capsys.readouterr().out
