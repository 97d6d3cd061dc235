"""A person who plays the caregiver or drives: keys, what the robot makes of them, and that an episode is kept."""

import math

import numpy as np
import pandas as pd
import pytest

from caregiver_mj import cli
from caregiver_mj.caregivers.answers import unpacked
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.experiments.submission import read_submission
from caregiver_mj.viz.viewers import Session

window = pytest.importorskip("caregiver_mj.viz.viewers.window")

PAID = ("damage", "interventions", "interventions_done", "toys_reached", "moves_blocked", "timesteps_to_threshold")


def cell_of_robot(session):
    return session.episode.policy.plan.cell_at(session.episode.hud_state(1).robot[:2])


def played(house, **settings):
    return Session(EpisodeSpec(house, "1", seed=4, **settings), playing=False)


def test_the_robot_goes_where_keys_say(house):
    session = played(house, caregiver="person")
    policy = session.episode.policy
    assert session.targets == [("0", "nothing more", "<"), ("1", "stairwell 1", ""), ("2", "candle 1", "")]
    for key in "0129A~":  # the last one that stands for something counts
        window.press(session, ord(key))
    assert session.targets[2] == ("2", "candle 1", "< waits")
    session.next_move()
    assert (policy.target, session.targets[2][2]) == (1, "<")
    assert "2  candle 1" in window.texts(session.episode.hud_state(1), session)[0]
    window.press(session, ord("1"))
    (landing,) = policy.plan.landings
    while session.episode.seconds < 60.0 and cell_of_robot(session) != landing:
        session.next_move()
    assert cell_of_robot(session) == landing
    assert (policy.activity, session.targets[1][2]) == ("block stairwell 1", "<")
    window.press(session, ord("0"))
    session.next_move()
    assert (policy.target, session.targets[0][2], session.targets[1][2]) == (0, "<", "")  # stairs stay guarded
    # Others are not told what to do.
    session = played(house, caregiver="nearest")
    session.choose("1")
    assert not session.targets


@pytest.mark.parametrize("robot", ["mobile_fr3", "mobile_ur5e"])
def test_keys_drive_the_base(house, robot):
    session = played(house, caregiver="driver", embodiment=robot)
    env, limits = session.episode.env, session.episode.env.task.embodiment.limits

    def pose_after(seconds, keys):
        for key in keys:
            window.press(session, ord(key))
        session.step(seconds)
        return session.episode.hud_state(1).robot

    start = pose_after(0.0, "")
    assert pose_after(0.5, "129AM~") == pytest.approx(start, abs=1e-3)
    x, y, yaw = pose_after(1.5, "IKKK")  # back and to the north, from the table that it faces
    assert (yaw, x) == pytest.approx((-math.pi / 2, start[0]), abs=0.02)
    assert env.physics.named.data.qvel["robot/base_y"] == pytest.approx(limits.base.velocity / 2, rel=0.02)
    names, values = window.texts(session.episode.hud_state(1), session)
    assert "K  slower, then back" in names
    assert f"drive at {-limits.base.velocity / 2:.2f} m/s" in values
    assert start[1] < y < pose_after(2.0, "0JJJ")[1]  # it brakes
    rest = pose_after(1.0, "")
    assert pose_after(1.0, "") == pytest.approx(rest, abs=0.01)
    assert rest[2] == pytest.approx(math.pi / 4, abs=0.01)
    pose_after(1.0, "IIIIIIIII")
    assert session.episode.policy.activity == f"drive at {limits.base.velocity:.2f} m/s"
    # Never beyond what the base can follow.
    actions = np.array(unpacked(session.episode.answers())["actions"])
    changes = np.diff(actions[:, :3], axis=0) / env.control_timestep()
    for told, bounds in ((changes[:, :2], limits.base), (changes[:, 2:], limits.yaw)):
        assert 0.9 * bounds.acceleration < np.linalg.norm(told, axis=1).max() < 1.001 * bounds.acceleration
        jerks = np.linalg.norm(np.diff(told, axis=0), axis=1) / env.control_timestep()
        assert jerks.max() < 1.001 * bounds.jerk
    assert (actions[:, 3:] == actions[0, 3:]).all()


@pytest.mark.slow
def test_episodes_are_kept_as_a_run_and_can_be_submitted(house, tmp_path, monkeypatch, capsys):
    who, keys, seen = "driver", "KJ", []

    class Fingers:
        """A window in which somebody plays the first episode to its end."""

        def __init__(self, session):
            self._session = session

        def run(self):
            seen.append(self._session.spec.episode)
            if seen == [0]:
                for key in keys:
                    window.press(self._session, ord(key))
                    self._session.step(50.0)
                self._session.step(400.0)
                seen.append(self._session.episode.env.task.outcome())

        def close(self):
            pass

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(window, "Window", Fingers)
    run, entry = tmp_path / "run", str(tmp_path / "me.submission")
    for _ in range(2):
        assert (
            cli.main(["view", "--caregiver", who, "--house", house, "--epsilon", "1", "--out", str(run), "--paused"])
            == 0
        )
    first, outcome, second = seen
    assert (first, second) == (0, 1)
    rows = pd.read_parquet(run / "episodes.parquet").set_index("caregiver").loc[["none", who]]
    assert rows.interventions.tolist() == [0, outcome["interventions"]]
    assert {key: rows[key][who] for key in PAID} == {key: outcome[key] for key in PAID}
    again = ["--episodes", "1", "--out", str(run), "--resume"]
    assert cli.main(["submit", str(run), "--out", entry]) == 0
    assert sum(map(len, read_submission(entry).results)) == 2
    assert cli.main(["evaluate", "--house", house, "--epsilon", "1", "--caregiver", "none", who, *again]) == 0
    assert cli.main(["report", str(run), "--render"]) == 2
    assert f"a {who} plays in" in capsys.readouterr().err
    record = ["record", "--format", "lerobot", "--answers", str(run), "--caregiver", who, "--seconds", "0.2"]
    assert cli.main([*record, "--out", str(tmp_path / "set")]) == 0
    assert len(pd.read_parquet(tmp_path / "set" / "data/chunk-000/file-000.parquet")) == 10
    film = ["render", "--answers", str(run), "--caregiver", who, "--seconds", "0.05", "--out", str(tmp_path / "me.mp4")]
    assert cli.main(film) == 0
    assert cli.main([*film, "--episode", "2"]) == 2
    assert "episode must be from 0 to 0, as --answers has them, got 2" in capsys.readouterr().err
