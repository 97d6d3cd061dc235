"""The study of sensitivity: what it varies, what it derives by hand, its page and its figure."""

import dataclasses
from itertools import count

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.caregivers.baselines import NearestCaregiver
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.intervals import of_difference, of_ratio
from caregiver_mj.experiments.settings import EPSILONS, Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.robot.embodiments import find_embodiment
from studies.sensitivity import (
    COLLISIONS,
    CONDITIONS,
    LINEAR,
    NEAREST,
    NONE,
    PAPER,
    ROBOTS,
    SPEEDS,
    STILL,
    WEIGHTED,
    WEIGHTS,
    Job,
    Place,
    Results,
    cells_apart,
    draw,
    page,
    run_job,
    slowed,
)

# A corridor: wherever the child is, stairwell and candle are 11 moves away together. The bare table is by the stairs.
CORRIDOR = FloorPlan.parse("##############\n#S..........C#\n##T######B####\n##############")


# -- Where the two rules are the same ----------------------------------------------------------------


def choices(plan, candle_table):
    """What the rule and `nearest` choose with a child in each cell."""
    cells = len(plan.free_cells)
    child = np.arange(cells)[:, None]
    percept = Percept(
        child, child, np.full_like(child, NOTHING), np.zeros(cells, int), np.tile(candle_table, (cells, 1)),
        np.full(cells, NOTHING),
    )  # fmt: skip
    return PaperCaregiver(plan).choose(percept), NearestCaregiver(plan).choose(percept)


@settings(max_examples=25, deadline=None)
@given(plan_texts(), st.sampled_from(["5:4:1", "20:4:1", "1:1:1", "4:5:1"]), st.randoms(use_true_random=False))
def test_the_rules_differ_just_where_the_derivation_says(text, weights, random):
    plan = FloorPlan.parse(text, damage=weights)
    tables = np.array(random.sample(range(len(plan.tables)), len(plan.candle_tables)), int)
    ours, theirs = choices(plan, tables)
    assert (ours != theirs).tolist() == cells_apart(plan, tables).tolist()
    if weights == "1:1:1":
        assert not cells_apart(plan).any()


def test_the_rules_differ_in_a_corridor_by_hand():
    east, west = (CORRIDOR.graph.table_distances[:, 0], CORRIDOR.graph.stairwell_distances[:, 0])
    assert (east + west == 11).all()
    apart = {(int(c), int(s)) for c, s, so in zip(east, west, cells_apart(CORRIDOR), strict=True) if so}
    assert apart == {(5, 6)}
    dear = dataclasses.replace(CORRIDOR, damage=DamageWeights(20.0, 4.0, 1.0))
    apart = {(int(c), int(s)) for c, s, so in zip(east, west, cells_apart(dear), strict=True) if so}
    assert apart == {(2, 9), (3, 8), (4, 7), (5, 6)}


# -- In the grid -------------------------------------------------------------------------------------


def run_at(condition, epsilon=1.0, episodes=4):
    return run_job(Job("paper", epsilon, condition, episodes))


def test_episodes_are_those_of_an_evaluation():
    rows = evaluate(Settings(FloorPlan.load("paper"), "grid", ("none", "paper"), (0.5,), 4)).episodes
    for one in (NONE, PAPER):
        found, own = run_at(one, 0.5), rows[rows.caregiver == one.caregiver]
        assert (found[COLLISIONS] @ [5, 4, 1]).tolist() == own.damage.tolist()
        alike = own.damage_stairwell / 5 + own.damage_candle / 4 + own.damage_table
        assert found[COLLISIONS].sum(axis=1).tolist() == alike.tolist()
        assert found.toys.tolist() == own.toys_reached.tolist()
        assert found.above.tolist() == own.timesteps_to_threshold.tolist()
        assert (found["at"] <= found.above).all()


def test_what_is_varied_changes_what_happens_but_for_equal_weights_which_make_the_rule_nearest():
    at = {one: run_at(one)[COLLISIONS].to_numpy().tolist() for one in CONDITIONS}
    for one in (LINEAR, STILL, WEIGHTED["20:4:1"], *(SPEEDS[actions] for actions in (1, 2, 4))):
        assert at[one] != at[PAPER]
    assert at[WEIGHTED["1:1:1"]] == at[NEAREST]


@pytest.fixture(scope="module")
def results():
    """Made up, over a house and a set of two."""
    places, random = (Place("paper", ("paper",), 9), Place("train-2", ("house-100000", "house-100001"), 9)), count(1)
    figures = {}
    for place in places:
        for house_ in place.houses:
            for one in CONDITIONS:
                for epsilon in EPSILONS:
                    draws = np.random.default_rng(next(random))
                    stops = np.sort(draws.integers(1, 201, (2, 9)), axis=0)
                    differs = draws.random(9) * (one == PAPER and house_ != "house-100000")
                    bumps = pd.DataFrame(draws.integers(0, 9, (9, len(COLLISIONS))), columns=COLLISIONS)
                    figures[house_, epsilon, one] = bumps.assign(
                        toys=draws.integers(0, 30, 9), above=stops[1], at=stops[0], apart=stops[0] != stops[1],
                        differs=differs,
                    )  # fmt: skip
    return Results(places, figures)


def collisions(results, house, epsilon, condition):
    return results.rows[house, epsilon, condition][COLLISIONS].to_numpy()


def test_what_is_left_is_of_the_damage_of_those_alone(results):
    single, several = results.places
    ours, alone = (collisions(results, "paper", 1.0, one) @ [20, 4, 1] for one in (LINEAR, NONE))
    assert results.left(single, LINEAR, "20:4:1")[0] == of_ratio(ours, alone)
    ours, alone = (
        [(collisions(results, name, 0.75, one) @ [5, 4, 1]).mean() for name in several.houses] for one in (LINEAR, NONE)
    )
    assert results.left(several, LINEAR)[1].value == pytest.approx(sum(ours) / sum(alone))


def test_differences_are_paired_and_of_means_over_houses(results):
    single, several = results.places
    ours, theirs = (collisions(results, "paper", 0.05, one).sum(axis=1) for one in (PAPER, NEAREST))
    assert results.difference(single, PAPER, NEAREST, "1:1:1")[-1] == of_difference(ours, theirs)
    ours, theirs = ([results.rows[name, 1.0, one].toys.mean() for name in several.houses] for one in (STILL, PAPER))
    found = results.difference(several, STILL, PAPER, "toys")[0]
    assert found.value == pytest.approx(np.mean(ours) - np.mean(theirs))
    ours, theirs = ([collisions(results, "paper", e, one) @ [5, 4, 1] for e in EPSILONS] for one in (PAPER, NEAREST))
    assert results.mean_difference("paper", PAPER, NEAREST).value == pytest.approx(np.mean(ours) - np.mean(theirs))


# -- In the house ------------------------------------------------------------------------------------


def test_a_slowed_robot_is_the_same_but_for_its_speed():
    robot = find_embodiment()
    slow = slowed(robot, 0.5)
    assert slow.limits.base.velocity == robot.limits.base.velocity / 2
    assert slow.limits.base_speed == robot.limits.base_speed / 2
    assert slow.limits.base.acceleration == robot.limits.base.acceleration
    assert (slow.model, slow.layout, slow.footprint, slow.limits.yaw) == (
        robot.model, robot.layout, robot.footprint, robot.limits.yaw)  # fmt: skip


# -- The page ----------------------------------------------------------------------------------------


def made_episodes():
    random = np.random.default_rng(0)
    rows = [
        {"robot": robot, "epsilon": epsilon, "episode": i, "damage": float(random.integers(1, 20)), "strikes": 0,
         "toys_reached": int(random.integers(9)), "candles_dropped": 0}
        for robot in ROBOTS for epsilon in EPSILONS for i in range(6)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def test_page_and_figure(results):
    text = page(results, made_episodes()).text("sensitivity", "the command")
    assert text.startswith("# Sensitivity\n")
    assert "| `train-2` | 20:4:1 |" in text
    assert "| the paper's own | `paper` | Table II | 97.0 | 164.2 | 171.5 | 200.0 | 200.0 |" in text
    assert "4 and 5, 5 and 6, 6 and 7" in " ".join(text.split())
    assert "In all of these 150 episodes there were 0 strikes and 0 dropped candles." in text
    assert all(len(line) <= 120 for line in text.splitlines() if not line.startswith("|"))
    assert text.count("| `paper` at 50 % of its speed |") == 3
    assert "the physical house" not in page(results, pd.DataFrame()).text("sensitivity", "the command")
    figure = draw(results)
    assert len(figure.axes) == 4 * len(results.places)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == [*WEIGHTS, "20:4:1, nearest"]
