"""Films of environments."""

import gymnasium
import imageio.v3 as imageio

import caregiver_mj
from caregiver_mj.envs.film import RecordFilm

NAME = "caregiver_mj/Supervise-Targets-v0"
gymnasium.register_envs(caregiver_mj)


def test_the_films_of_the_episodes_that_are_asked_for(tmp_path):
    env = gymnasium.make(NAME, render_mode="rgb_array", width=320, height=240)
    env = RecordFilm(env, tmp_path / "films", which=lambda episode: episode != 1)
    env.reset(seed=0)
    for _ in range(200):
        *_, truncated, _ = env.step(0)
    assert truncated
    shown = imageio.imread(tmp_path / "films" / "episode-0.mp4")  # complete before the environment is closed
    assert shown.shape == (201, 240, 320, 3)
    env.reset(), env.step(0), env.reset(), env.step(0), env.close()
    assert sorted(path.name for path in (tmp_path / "films").iterdir()) == ["episode-0.mp4", "episode-2.mp4"]
    assert len(imageio.imread(tmp_path / "films" / "episode-2.mp4")) == 2
