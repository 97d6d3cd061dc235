"""The study of the robot near the child."""

import json

import pytest
from printed import printed

from studies.audit import NearChild
from studies.near_child import Episode, Job, report
from study import HOUSES, main

CALM = NearChild(separation=0.1, approach_separation=0.2, fast_seconds=1.0, contact_speed=0.0)


def episode(seed, **others):
    values = {
        "house": "paper", "seed": seed, "strikes": 0, "drops": 0, "epsilon": 0.5, "adversarial": False,
        "strike_times": (), "near": CALM, "interventions_done": 3, "blocked": 2,
    }  # fmt: skip
    return Episode(**values | others)


def test_every_house_meets_every_child():
    jobs = [Job.of_seed(seed) for seed in range(18)]
    assert len({(job.house, job.epsilon, job.adversarial) for job in jobs}) == 18
    assert jobs[0] == Job(HOUSES[0], 0, 0.5, False)
    assert jobs[1] == Job(HOUSES[0], 1, 0.5, True)
    assert jobs[2].house == HOUSES[1]
    assert Job.of_seed(18) == Job(HOUSES[0], 18, 0.5, False)


def test_houses_and_children_have_rows_of_their_own():
    text = printed(report, [episode(0), episode(1, adversarial=True, blocked=100), episode(2, house="apartment")])
    rows = [line.split()[:3] for line in text.splitlines()[4:]]
    assert rows == [
        ["paper", "novice", "1"],
        ["paper", "adversarial", "1"],
        ["apartment", "novice", "1"],
        ["all", "novice", "2"],
        ["all", "adversarial", "1"],
        [],
    ]


def test_a_contact_that_lasts_is_told_once():
    struck = episode(7, strikes=2, strike_times=(1.0, 1.005, 1.4, 3.0, 3.005))
    assert "paper, seed 7, epsilon 0.5: 2 strikes, contacts too fast at 1.00, 3.00 s" in printed(report, [struck])


def test_command(tmp_path, capsys):
    path = tmp_path / "episodes.json"
    main(["near_child", "--episodes", "1", "--seconds", "2", "--jobs", "1", "--json", str(path)])
    assert "Near the child" in capsys.readouterr().out
    (row,) = json.loads(path.read_text())
    assert (row["house"], row["seed"], row["strikes"]) == ("paper", 0, 0)
    assert row["near"]["contact_speed"] == pytest.approx(0.0, abs=0.05)
