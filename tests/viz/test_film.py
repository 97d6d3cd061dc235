"""Films of episodes: what can be read back from the files, and what is refused."""

import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.viz import director, hud
from caregiver_mj.viz.cameras import Camera
from caregiver_mj.viz.colours import GROUND
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, Studio, render_episode

SMALL = Picture(320, 240, 10.0)


def film(path, seconds=1.5, still=None, picture=SMALL, **fields):
    spec = EpisodeSpec("paper", **{"caregiver": "none", **fields})
    render_episode(path, spec, seconds=seconds, picture=picture, still=still, quiet=True)


@pytest.fixture(scope="module")
def short_film(tmp_path_factory):
    """A film with a still, in a folder that did not exist."""
    folder = tmp_path_factory.mktemp("film") / "new"
    film(folder / "short.mp4", still=folder / "short.png")
    return folder / "short.mp4"


def test_film_has_size_length_and_speed_and_can_start_before_it_is_loaded(short_film):
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(short_film))
    assert (frames, seconds) == (15, pytest.approx(1.5, abs=0.05))
    meta = iio.immeta(short_film, plugin="FFMPEG")
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert (meta["source_size"], meta["fps"]) == ((320, 240), 10.0)
    # Film can start before it is loaded.
    data = short_film.read_bytes()
    assert 0 < data.find(b"moov") < data.find(b"mdat")
    # Nothing else is left behind.
    assert sorted(p.name for p in short_film.parent.iterdir()) == ["short.mp4", "short.png"]


def test_film_shows_house_and_display_and_the_still_is_its_middle(short_film):
    frames = iio.imread(short_film, plugin="FFMPEG").astype(int)
    assert frames.shape == (15, 240, 320, 3)
    top = hud.strip_top(320, 240)
    house, strip = frames[:, :top], frames[:, top + 2 :]
    assert house.std(axis=(1, 2)).min() > 15
    assert np.median(np.abs(strip - GROUND)) < 8
    assert np.abs(frames[-1] - frames[0]).max() > 60  # the toddler has moved
    # Still is the middle of the film when nothing is carried.
    still = iio.imread(short_film.with_suffix(".png")).astype(int)
    difference = np.abs(frames - still).mean(axis=(1, 2, 3))
    assert difference.argmin() == 7
    assert difference.min() < 5  # the film is compressed


def test_large_views_from_above_are_near_the_house_and_near_those_whom_it_is_about():
    episode = Episode(EpisodeSpec("home", 0.5, "none"))
    width, height, top = 480, 240, hud.strip_top(480, 240)

    def large(camera):
        return Studio(episode, Picture(width, height, camera=camera), 1).frame()[:top]

    np.testing.assert_array_equal(large("overview")[:, : width // 2], large("auto")[:, : width // 2])
    followed = large("follow")
    physics, plain = episode.env.physics, episode.hud_state(1)
    pose = director.CloseShot(width / top, 30.0, director.screens(physics), 0.23).follow(plain)
    seen = Camera(physics, pose, width, top, shadows=True).render()
    left = np.s_[:, : width // 2]
    np.testing.assert_array_equal(followed[left], seen[left])


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_a_film_is_of_the_kind_that_its_name_says(tmp_path, suffix):
    path = tmp_path / f"film{suffix}"
    film(path, seconds=1.0)
    with Image.open(path) as moving:
        assert moving.format == suffix[1:].upper()
        assert (moving.size, moving.info["loop"]) == ((320, 240), 0)  # for ever
        seconds = 0.0
        for number in range(moving.n_frames):  # of which those that are alike may be one
            moving.seek(number)
            moving.load()
            seconds += moving.info["duration"] / 1000
        assert moving.n_frames > 3
        assert seconds == pytest.approx(1.0, abs=0.1)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
