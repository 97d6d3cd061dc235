"""From episodes to tables, worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.experiments import statistics


def frame(**damages):
    """Episodes by hand: of each caregiver a list of damages."""
    return pd.DataFrame(
        {
            "world": "grid",
            "house": "h",
            "caregiver": name,
            "family": "1",
            "epsilon": 1.0,
            "episode": episode,
            "damage": damage,
            "timesteps_to_threshold": 200 - damage,
            "cells_visited": 1,
            "toys_reached": 0,
        }
        for name, values in damages.items()
        for episode, damage in enumerate(values)
    )


def test_summary_by_hand():
    none, paper = statistics.summarise(frame(none=[10, 20], paper=[6, 0]), ("damage", "cells_visited"))
    assert none["damage_mean"] == 15
    assert none["damage_sd"] == pytest.approx(50**0.5)  # ((10-15)² + (20-15)²) / (2-1)
    assert (none["damage_ci_low"], none["damage_ci_high"]) == (10, 20)  # a quarter of resamples are (10, 10)
    assert none["damage_normalised_mean"] == pytest.approx(0.75)
    assert paper["damage_normalised_mean"] == pytest.approx(0.15)
    assert paper["damage_normalised_sd"] == pytest.approx(18**0.5 / 20)
    assert (none["cells_visited_mean"], none["cells_visited_sd"]) == (1, 0)
    assert (none["cells_visited_ci_low"], none["cells_visited_ci_high"]) == (1, 1)


def test_summary_of_one_harmless_episode():
    (row,) = statistics.summarise(frame(none=[0]), ("damage",))
    assert (row["damage_mean"], row["damage_sd"], row["damage_normalised_mean"]) == (0, 0, 0)
    assert row["damage_ci_low"] is row["damage_ci_high"] is None


def test_comparison_by_hand():
    (row,) = statistics.compare(frame(none=[10, 20, 30, 40, 50], paper=[9, 18, 27, 36, 45]), "paper", "none")
    assert row["damage_left"] == pytest.approx(0.9)
    assert row["damage_left_ci_low"] == pytest.approx(0.9)  # the ratio is the same in every pair
    assert row["damage_left_ci_high"] == pytest.approx(0.9)
    assert row["damage_difference_mean"] == -3
    assert row["damage_p"] == pytest.approx(2 / 2**5)  # all five of one sign: two of the 32 assignments
    assert row["timesteps_to_threshold_difference_mean"] == 3
    assert row["toys_reached_p"] == 1  # no difference at all


def test_comparison_pairs_by_episode():
    episodes = frame(none=[10, 20, 30], paper=[9, 19, 29]).iloc[::-1]
    (row,) = statistics.compare(episodes, "paper", "none")
    assert row["damage_difference_ci_low"] == row["damage_difference_ci_high"] == -1


def test_comparison_without_any_damage():
    (row,) = statistics.compare(frame(none=[0, 0], paper=[0, 0]), "paper", "none")
    assert row["damage_left"] is row["damage_left_ci_low"] is None
    assert row["damage_p"] == 1


def test_interval_agrees_with_theory():
    data = np.random.default_rng(1).normal(5.0, 2.0, size=(400, 1))
    low, high = statistics.mean_interval(data)
    error = data.std(ddof=1) / 20
    assert low[0] == pytest.approx(data.mean() - 1.96 * error, abs=0.15 * error)
    assert high[0] == pytest.approx(data.mean() + 1.96 * error, abs=0.15 * error)
