"""Episodes to film: those of a run, and what the display is told of them."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from made_runs import PAPER, write_run

from caregiver_mj import cli
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.finished import best_rescue, read_finished
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.recording.record import COLUMNS
from caregiver_mj.viz import film
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, render_episode

SEED = 3
FAMILY = "1,0.25"
SMALL = Picture(320, 240, 1.0)


def measured(episode):
    return episode.env.task.outcome() | {
        "interventions": episode.policy.executive.begun,
        "interventions_done": episode.policy.executive.done,
    }


def assert_is_row(episode, row):
    outcome = measured(episode)
    counted = [column.name for column in COLUMNS if column.role in ("damage", "count")]
    assert {name: outcome[name] for name in counted} == {name: row[name] for name in counted}


class Blank:
    """A studio without cameras."""

    seen: Episode

    def __init__(self, episode, picture, trail_length):
        Blank.seen = episode
        self._frame = np.zeros((picture.height, picture.width, 3), np.uint8)

    def frame(self):
        return self._frame


@pytest.mark.slow
def test_a_film_by_answers_is_of_an_episode_of_their_run(house, tmp_path, monkeypatch, capsys):
    run = tmp_path / "run"
    made = ["--house", house, "--epsilon", "1", "--seed", str(SEED), "--damage", "7:2:1", "--sight", "walls"]
    assert cli.main(["evaluate", *made, "--caregiver", "nearest", "--episodes", "2", "--out", str(run)]) == 0
    row = pd.read_parquet(run / "episodes.parquet").set_index("episode").loc[1]
    assert row.damage > 0
    small = {"studio": Blank, "picture": SMALL, "quiet": True}
    monkeypatch.setattr(film, "render_episode", lambda out, spec, **how: render_episode(out, spec, **how | small))
    command = ["render", "--answers", str(run), "--caregiver", "nearest", "--episode", "1", "--seconds", "400"]
    assert cli.main([*command, "--out", str(tmp_path / "film.mp4")]) == 0
    assert_is_row(Blank.seen, row)
    for option in ("--task=block_stairs", "--epsilon=.5", "--seed=3", "--sight=all", "--max-calls=3"):
        assert cli.main([*command, option, "--out", str(tmp_path / "film.mp4")]) == 2
        name = option.partition("=")[0]
        assert f"{name} must be left out with --answers" in capsys.readouterr().err
    assert cli.main([*command[:6], "best", "--out", str(tmp_path / "film.mp4")]) == 2
    assert "must have 'none'" in capsys.readouterr().err
    assert cli.main(["record", "--format", "lerobot", *command[1:5], "--out", str(tmp_path / "set")]) == 2
    assert "--answers must be a run with sight all, got walls" in capsys.readouterr().err


def test_the_best_rescue_of_a_run_is_filmed_where_it_happens(tmp_path, monkeypatch, capsys):
    """In the made run the caregiver prevents 30 to 40; the first 40 are in episode 1 of novice 1."""
    run, out = write_run(tmp_path / "run", "house"), str(tmp_path / "film.mp4")
    found = read_finished(run)
    assert best_rescue(found, "paper") == (PAPER, ChildGroup.of("1"), 1)
    with pytest.raises(CaregiverError, match="'none' must prevent damage"):
        best_rescue(found, "none")
    alone = read_finished(write_run(tmp_path / "other", "house", caregivers=("paper", "guard")))
    with pytest.raises(CaregiverError, match="must have 'none'"):
        best_rescue(alone, "paper")
    assert cli.main(["render", "--episode", "best", "--out", out]) == 2
    assert cli.main(["render", "--episode", "first", "--out", out]) == 2
    assert capsys.readouterr().err.count("--episode") == 2
    grid = str(write_run(tmp_path / "grid"))
    assert cli.main(["render", "--answers", grid, "--caregiver", "paper", "--episode", "best", "--out", out]) == 2
    assert "--answers must be a run in the house" in capsys.readouterr().err

    def made(specs, observers, answers):
        """Alone, a child is hurt in the timesteps 40 and 101; with the caregiver in the first of them only."""
        (observer,) = observers
        hurt = (40, 101) if specs[0].caregiver == "none" else (40,)
        for now in range(201):
            damage = np.array([5.0 * sum(now >= when for when in hurt)])
            observer(SimpleNamespace(ledger=SimpleNamespace(timestep=now, damage=damage)))
        return SimpleNamespace(measured=[{"sim_seconds": 336.0}])

    monkeypatch.setattr(film, "run", made)
    spec = EpisodeSpec("paper", 1, "paper")
    assert film.rescue_start(spec, "", 30.0) + 15.0 == pytest.approx(101 * 1.68, abs=1.68)
    assert film.rescue_start(spec, "", 400.0) == 0.0


def test_the_display_is_told_of_each_child(house):
    episode = Episode(EpisodeSpec(house, FAMILY, "paper", seed=SEED))
    for second in range(1, 21):
        assert episode.run_until(second)
    shown, outcome = episode.hud_state(trail_length=5), episode.env.task.outcome()
    observation = episode.env.task.get_observation(episode.env.physics)
    assert shown.family == "1,0.25"
    np.testing.assert_allclose([child.position for child in shown.children], observation["toddler_position"][:, :2])
    assert [child.damage for child in shown.children] == outcome["damage_by_child"]
    for child in shown.children:
        assert child.trail.shape == (5, 2)
        np.testing.assert_array_equal(child.trail[-1], child.position)
    assessment = episode.policy.assessment
    assert [child.safe for child in shown.children] == assessment.safe[0].tolist()
    # What decides is the sum of the dangers to the children.
    np.testing.assert_allclose(shown.danger, assessment.danger[0].sum(axis=0))
