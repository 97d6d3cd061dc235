"""Episodes run for a data set: that they are those of an evaluation, whoever acts, and what cannot be recorded."""

import dataclasses

import numpy as np
import pytest

from caregiver_mj import FloorPlan
from caregiver_mj.envs.recipe import RANDOM, Recording, collect
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.steps import Store
from caregiver_mj.viz.episode import Episode

PAPER = FloorPlan.load("paper")
GRID = EpisodeSpec(PAPER, 1.0, world="grid", seed=4, task="targets")
SHORT = EpisodeSpec(PAPER, 0.5, seed=3, task_kwargs={"time_limit": 1.0})


def run(spec, path, **recorded):
    store = Store(path)
    collect(Recording(spec, **recorded), store.path, 0)
    return store.load(0)


@pytest.mark.slow
def test_an_episode_is_that_of_an_evaluation(tmp_path):
    settings = Settings(PAPER, "house", ("paper",), (1.0,), 1, seed=4)
    (row,) = evaluate(settings).episodes.to_dict("records")
    found = run(EpisodeSpec(PAPER, 1.0, seed=4), tmp_path)
    assert found.seed == row["seed"]
    for key in ("damage", "interventions", "strikes", "toys_reached"):
        assert found.outcome[key] == row[key]
    assert found.damage.sum() == row["damage"]
    assert found.strikes.sum() == row["strikes"]
    assert found.costs.sum() == row["damage"] + row["strikes"]
    assert set(found.interventions) <= {NOTHING, *range(len(PAPER.hazards))}
    assert len(set(found.interventions)) > 2
    assert len(found) == len(found.actions) == len(found.observations["clock"]) - 1
    assert (found.terminated, found.diverged) == (False, False)


def test_caregivers_choose_targets_in_the_grid(tmp_path):
    found = {name: run(dataclasses.replace(GRID, caregiver=name), tmp_path / name) for name in ("paper", RANDOM)}
    cared = found["paper"]
    assert len(cared) == 200
    assert cared.rewards.sum() == -cared.outcome["damage"]
    np.testing.assert_array_equal(cared.actions - 1, cared.interventions)  # `paper` has no slots that are empty
    useful = cared.observations["action_mask"][np.arange(200), cared.actions]
    assert useful.mean() > 0.9  # with a candle in the hand it may want something else
    assert cared.outcome["damage"] < 0.75 * found[RANDOM].outcome["damage"]


def test_answers_are_given_again_in_the_place_of_the_caregiver(tmp_path):
    played = Episode(EpisodeSpec(PAPER, 0.5, "nearest", seed=3))
    assert played.run_until(1.5)
    asked = run(dataclasses.replace(SHORT, caregiver="nearest"), tmp_path / "asked")
    given = run(dataclasses.replace(SHORT, caregiver="person"), tmp_path / "given", answers=(played.answers(),))
    np.testing.assert_array_equal(given.actions, asked.actions)
    assert set(given.interventions) == set(asked.interventions) != {NOTHING}
