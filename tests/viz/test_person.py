"""A person who plays the caregiver: keys, what the robot makes of them, and that the episode is kept as a run."""

import pandas as pd
import pytest

from caregiver_mj import cli
from caregiver_mj.children.family import Family
from caregiver_mj.experiments.submission import read_submission
from caregiver_mj.viz.episode import Watched
from caregiver_mj.viz.viewers.session import Session

window = pytest.importorskip("caregiver_mj.viz.viewers.window")

HOUSE = "########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########"
PLAYS = ["view", "--caregiver", "person"]
PAID = ("damage", "interventions", "interventions_done", "toys_reached", "moves_blocked", "timesteps_to_threshold")


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    path = tmp_path_factory.mktemp("house") / "small.txt"
    path.write_text(HOUSE)
    return str(path)


def cell_of_robot(session):
    return session.episode.policy.plan.cell_at(session.episode.hud_state(1).robot[:2])


def played(house, **settings):
    return Session(Watched(house, Family.parse("1"), seed=4, **settings), playing=False)


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


@pytest.mark.slow
def test_episodes_are_kept_as_a_run_and_can_be_submitted(house, tmp_path, monkeypatch, capsys):
    seen = []

    class Fingers:
        """A window in which somebody plays the first episode to its end."""

        def __init__(self, session):
            self._session = session

        def run(self):
            seen.append(self._session.watched.number)
            if seen == [0]:
                for key in ("1", "2"):
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
        assert cli.main([*PLAYS, "--house", house, "--epsilon", "1", "--out", str(run), "--paused"]) == 0
    first, outcome, second = seen
    assert (first, second) == (0, 1)
    rows = pd.read_parquet(run / "episodes.parquet").set_index("caregiver").loc[["none", "person"]]
    assert rows.interventions.tolist() == [0, outcome["interventions"]]
    assert {key: rows[key]["person"] for key in PAID} == {key: outcome[key] for key in PAID}
    again = ["--episodes", "1", "--out", str(run), "--resume"]
    assert cli.main(["submit", str(run), "--out", entry]) == 0
    assert sum(map(len, read_submission(entry).results)) == 2
    assert cli.main(["evaluate", "--house", house, "--epsilon", "1", "--caregiver", "none", "person", *again]) == 0
    assert cli.main(["report", str(run), "--render"]) == 2
    assert "a person plays in" in capsys.readouterr().err
    record = ["record", "--format", "lerobot", "--answers", str(run), "--caregiver", "person", "--seconds", "0.2"]
    assert cli.main([*record, "--out", str(tmp_path / "set")]) == 0
    assert len(pd.read_parquet(tmp_path / "set" / "data/chunk-000/file-000.parquet")) == 10


@pytest.mark.parametrize(
    ("command", "problem"),
    [
        ([*PLAYS, "--sight", "walls"], "sight must be all with a person"),
        ([*PLAYS, "--out", "run", "--episode", "2"], "--out must be with --caregiver person, and without --episode"),
        (["view", "--out", "run"], "--out must be with --caregiver person"),
        (["record", "--format", "lerobot", "--caregiver", "person", "--out", "set"], "must be with --answers DIR"),
        (["evaluate", "--caregiver", "none", "person", "--out", "run"], "acts by itself: a person plays"),
        (["render", "--caregiver", "person", "--out", "film.mp4"], "acts by itself: a person plays"),
    ],
)
def test_what_cannot_be_played(command, problem, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(command) == 2
    assert problem in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]
