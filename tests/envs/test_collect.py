"""Episodes run for a data set: that they are those of an evaluation, whoever acts, and what cannot be recorded."""

import dataclasses

import numpy as np
import pytest

from caregiver_mj.children.family import Family
from caregiver_mj.envs.recipe import RANDOM, Recipe, collect
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings, episode_seed
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.steps import Store
from caregiver_mj.viz.episode import Watched

PAPER = FloorPlan.load("paper")
GRID = Recipe("targets", PAPER, Family.of(1.0), world="grid")
SHORT = Recipe("supervise", PAPER, Family.of(0.5), seconds=1.0)


def run(recipe, path, seed=3):
    store = Store(path)
    collect(recipe, store.path, (0, seed))
    return store.load(0)


@pytest.mark.slow
def test_an_episode_is_that_of_an_evaluation(tmp_path):
    settings = Settings(PAPER, "house", ("paper",), (1.0,), 1, seed=4)
    (row,) = evaluate(settings).episodes.to_dict("records")
    found = run(Recipe("supervise", PAPER, Family.of(1.0), seed=4), tmp_path, episode_seed(4, 0))
    assert found.seed == row["seed"]
    assert {key: found.outcome[key] for key in ("damage", "interventions", "strikes", "toys_reached")} == {
        key: row[key] for key in ("damage", "interventions", "strikes", "toys_reached")
    }
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


@pytest.mark.parametrize(
    ("name", "own"),
    [
        ("childproof", "prepare, destination"),
        ("foresight", "decide, destination"),
        ("studies.ablations:Still", "yields"),
    ],
)
def test_who_does_more_than_choose_targets(name, own):
    words = f"caregiver must do no more than choose targets, got '{name}', which has its own {own}$"
    with pytest.raises(CaregiverError, match=words):
        dataclasses.replace(GRID, caregiver=name).spaces()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"world": "grid"}, "task must be targets in the grid, got 'supervise'"),
        ({"world": "grid", "task": "targets"}, "cameras and seconds must be left out in the grid"),
        ({"cameras": ("overview", "overview")}, "cameras must be different"),
        ({"caregiver": "none"}, "caregiver must be one that acts, got 'none'"),
        ({"task": "targets", "seconds": None, "caregiver": "knows-goal"}, "needs privileged information"),
    ],
)
def test_what_cannot_be_recorded(changes, message):
    with pytest.raises(CaregiverError, match=message):
        dataclasses.replace(SHORT, **changes).spaces()


def test_answers_are_given_again_in_the_place_of_the_caregiver(tmp_path):
    played = Watched(PAPER, Family.of(0.5), "nearest", seed=3, number=None).begin()
    assert played.run_until(1.5)
    asked = run(dataclasses.replace(SHORT, caregiver="nearest"), tmp_path / "asked")
    given = run(dataclasses.replace(SHORT, caregiver="person", answers=(played.answers(),)), tmp_path / "given")
    np.testing.assert_array_equal(given.actions, asked.actions)
    assert set(given.interventions) == set(asked.interventions) != {NOTHING}
