"""Many trials: their options, their order, and what is counted in them."""

import argparse
import json
import os

from caregiver_mj.studies.trials import Trial, add_trials, by_house, mishaps, run_all, seeds, total, write_json


def _identify(job):
    return job, os.getpid()


def options(*arguments):
    parser = argparse.ArgumentParser()
    add_trials(parser, "count", 500)
    return parser.parse_args(arguments)


def test_results_come_in_the_order_of_the_jobs():
    found = run_all(_identify, range(5), 2, "identifying")
    assert [job for job, _ in found] == [0, 1, 2, 3, 4]
    assert os.getpid() not in {process for _, process in found}


def test_seeds_follow_the_first():
    assert seeds(options()) == range(500)
    assert seeds(options("--count", "3", "--first", "40")) == range(40, 43)


def test_mishaps_are_counted():
    assert mishaps({"strikes": 1.0, "candles_dropped": 2.0, "damage": 7.0}) == {"strikes": 1, "drops": 2}
    trials = [Trial("paper", 0, 1, 0), Trial("apartment", 1, 2, 4)]
    assert (total(trials, "strikes"), total(trials, "drops")) == ("3", "4")


def test_trials_by_house_and_all_together():
    trials = [Trial("b", 0, 0, 0), Trial("a", 1, 0, 0), Trial("b", 2, 0, 0)]
    assert by_house(trials) == {"b": [trials[0], trials[2]], "a": [trials[1]], "all": trials}


def test_results_as_json(tmp_path):
    path = tmp_path / "trials.json"
    write_json(options(), [Trial("paper", 0, 1, 2)])  # nobody asked
    write_json(options("--json", str(path)), [Trial("paper", 0, 1, 2)])
    assert json.loads(path.read_text()) == [{"house": "paper", "seed": 0, "strikes": 1, "drops": 2}]
