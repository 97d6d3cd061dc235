"""From episodes to tables, worked out by hand: in one house, over several, and house by house."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from comparing import twelve_houses

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.experiments import statistics, two_level
from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.summary import by_house, summarise

HOUSES = twelve_houses()


def frame(house="h", epsilon=1.0, toys=0, **damages):
    """Episodes by hand: of each caregiver a list of damages."""
    rows = [(name, episode, damage) for name, values in damages.items() for episode, damage in enumerate(values)]
    found = pd.DataFrame(rows, columns=["caregiver", "episode", "damage"])
    found = found.assign(world="grid", house=house, family=f"{epsilon:g}", epsilon=epsilon)
    return found.assign(timesteps_to_threshold=200 - found.damage, cells_visited=1, toys_reached=toys)


def test_means_by_hand():
    none, paper = statistics.mean_rows(frame(none=[10, 20], paper=[6, 0]), ("damage", "cells_visited"))
    assert (none["house"], none["caregiver"], none["family"], none["episodes"]) == ("h", "none", "1", 2)
    assert none["damage_mean"] == 15
    assert none["damage_sd"] == pytest.approx(50**0.5)  # ((10-15)² + (20-15)²) / (2-1)
    assert (none["damage_ci_low"], none["damage_ci_high"]) == (0, None)  # two episodes bound nothing
    assert none["damage_normalised_mean"] == pytest.approx(0.75)
    assert paper["damage_normalised_mean"] == pytest.approx(0.15)
    assert paper["damage_normalised_sd"] == pytest.approx(18**0.5 / 20)
    assert (none["cells_visited_mean"], none["cells_visited_sd"]) == (1, 0)
    assert (none["cells_visited_ci_low"], none["cells_visited_ci_high"]) == (1, 1)


def test_means_of_one_harmless_episode():
    (row,) = statistics.mean_rows(frame(none=[0]), ("damage",))
    assert (row["damage_mean"], row["damage_sd"], row["damage_normalised_mean"]) == (0, 0, 0)
    assert (row["damage_ci_low"], row["damage_ci_high"]) == (0, None)


def test_comparison_by_hand():
    theirs = [10, 20, 30, 40, 50, 60]
    episodes = frame(none=theirs, paper=[0.9 * damage for damage in theirs])
    (row,) = statistics.comparison_rows(episodes, "paper", "none")
    assert (row["caregiver"], row["baseline"], row["house"], row["episodes"]) == ("paper", "none", "h", 6)
    assert row["damage_left"] == pytest.approx(0.9)
    assert row["damage_left_ci_low"] == pytest.approx(0.9)  # the ratio is the same in every pair
    assert row["damage_left_ci_high"] == pytest.approx(0.9)
    assert row["damage_difference_mean"] == pytest.approx(-3.5)
    assert row["damage_p"] == pytest.approx(2 / 2**6)  # all six of one sign: two of the 64 assignments
    assert row["damage_difference_ci_low"] < -3.5 < row["damage_difference_ci_high"] < 0
    assert row["damage_verdict"] == "less"
    assert row["timesteps_to_threshold_difference_mean"] == pytest.approx(3.5)
    assert row["timesteps_to_threshold_verdict"] == "more"
    assert (row["toys_reached_p"], row["toys_reached_verdict"]) == (None, "no verdict")  # no difference at all
    assert row["toys_reached_left"] is row["toys_reached_left_ci_low"] is None  # and no toys
    assert "damage_equivalence" not in row  # to nobody's care
    assert "moves_blocked_free_p" not in row  # that was not measured


def test_comparison_without_any_damage():
    (row,) = statistics.comparison_rows(frame(none=[0, 0], paper=[0, 0]), "paper", "none")
    assert row["damage_left"] is row["damage_left_ci_low"] is row["damage_p"] is None


def test_margins():
    damage = [10, 20, 30, 40, 50, 60]
    episodes = pd.concat([frame(toys=20, guard=damage), frame(toys=19, paper=[0.95 * one for one in damage])])
    (row,) = statistics.comparison_rows(episodes, "paper", "guard")
    assert row["damage_verdict"] == "less"
    assert row["damage_equivalence"] == "equivalent"  # less, but within the margin of 10 %
    assert row["toys_reached_left"] == pytest.approx(0.95)
    assert row["toys_reached_not_inferior"] == "inferior"  # by more than 3 %


def test_comparisons_that_are_told_together_are_corrected_for_their_number():
    theirs = [10, 20, 30, 40, 50, 60]
    ours = {"guard": theirs, "paper": [9, 18, 29, 38, 49, 58], "nearest": [5, 14, 25, 34, 45, 54]}
    episodes = frame(none=theirs, **ours)
    rows = [statistics.comparison_rows(episodes, name, "none")[0] for name in ours]
    # All six of one sign: 2 of 64; a test of no difference at all could show nothing, and does not count.
    assert [row["damage_p"] for row in rows] == [None, 2 / 64, 2 / 64]
    assert [row["damage_verdict"] for row in rows] == ["no verdict", "less", "less"]
    together = statistics.judged_together(rows)
    assert [row["damage_p"] for row in together] == [None, 2 / 64, 2 / 64]
    assert [row["damage_p_holm"] for row in together] == [None, 4 / 64, 4 / 64]
    assert [row["damage_verdict"] for row in together] == ["no verdict"] * 3


def test_what_does_not_pair_is_refused():
    with pytest.raises(CaregiverError, match="got 1 of 'paper' or 'none' without a counterpart"):
        statistics.comparison_rows(frame(none=[1, 2], paper=[1]), "paper", "none")
    with pytest.raises(CaregiverError, match="no caregiver 'nanny' in the run: there are none, paper"):
        statistics.comparison_rows(frame(none=[1], paper=[1]), "nanny", "none")


@pytest.fixture(scope="module")
def episodes():
    """The same as rows, at epsilon 1 and, with half of the damage, at .5."""
    parts = [
        frame(f"h{j:02}", epsilon, paper=epsilon * ours, none=epsilon * theirs)
        for epsilon in (1.0, 0.5)
        for j, (ours, theirs) in enumerate(zip(*HOUSES, strict=True))
    ]
    return pd.concat(parts, ignore_index=True)


def test_comparison_over_houses(episodes):
    first, second = statistics.comparison_rows(episodes, "paper", "none")
    assert (first["world"], first["epsilon"], second["epsilon"]) == ("grid", 1.0, 0.5)
    assert (first["house"], first["houses"], first["houses_defined"], first["episodes"]) == ("12 houses", 12, 12, 240)
    left, difference = two_level.of_ratio(*HOUSES), two_level.of_difference(*HOUSES)
    assert tuple(first[f"damage_left{part}"] for part in ("", "_ci_low", "_ci_high")) == pytest.approx(left)
    assert first["damage_left_by_house"] == pytest.approx(two_level.of_mean_ratio(*HOUSES).value)
    assert first["damage_difference_mean"] == pytest.approx(2 * second["damage_difference_mean"])
    assert first["damage_difference_ci_low"] == pytest.approx(difference.low)
    assert first["damage_p"] == pytest.approx(2 / 2**12)  # less in all twelve houses
    assert first["damage_verdict"] == "less"


def test_who_is_compared_with_whom():
    settings = Settings(FloorPlan.load("paper"), "grid", ("none", "guard", "paper"), (1.0,), 2, seed=5)
    episodes = frame(none=[2, 3], guard=[1, 2], paper=[1, 1])
    found = summarise(settings, episodes, by_house(episodes))
    compared = [(row["caregiver"], row["baseline"]) for row in found["comparisons"]]
    assert compared == [("guard", "none"), ("paper", "none"), ("paper", "guard")]
    assert ([row["caregiver"] for row in found["rows"]], found["seed"]) == (["none", "guard", "paper"], 5)
    alone = dataclasses.replace(settings, caregivers=("guard",))
    found = summarise(alone, frame(guard=[1, 2]), by_house(frame(guard=[1, 2])))
    assert (found["comparisons"], found["harm"]) == ([], [])


def test_every_house(episodes):
    table = by_house(episodes)
    assert list(table.columns) == [
        *("world", "house", "caregiver", "family", "epsilon", "episodes"),
        *("damage", "timesteps_to_threshold", "cells_visited", "toys_reached"),
        *("damage_left", "damage_left_ci_low", "damage_left_ci_high"),
        *("damage_difference", "damage_difference_ci_low", "damage_difference_ci_high", "worse"),
        *("harm_p", "harm_p_least", "harm_p_holm", "harm_verdict"),
    ]
    assert list(table.house) == [f"h{j:02}" for _ in range(2) for j in range(12) for _ in range(2)]
    paper = table[(table.caregiver == "paper") & (table.family == "1")]
    assert paper.damage.tolist() == pytest.approx([np.mean(ours) for ours in HOUSES[0]])
    assert (table.episodes == 20).all()
    for row, ours, theirs in zip(paper.itertuples(), *HOUSES, strict=True):
        found = row.damage_left, row.damage_left_ci_low, row.damage_left_ci_high
        assert found == pytest.approx(of_ratio(ours, theirs))
    assert table[table.caregiver == "none"].damage_left.isna().all()
