"""The study of house and grid by shape: the ratio over a sample with so many houses of each shape."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj import cli
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from studies import shapes
from studies.shapes import of_ratio, of_stratified_ratio, slowed_lines
from study import main

OURS, THEIRS = np.array([2.0, 4.0, 6.0, 10.0]), np.array([1.0, 3.0, 2.0, 4.0])


def test_a_ratio_of_two_houses_of_each_of_two_shapes():
    # R = 22 / 10. The errors y - R x are -0.2, -2.6 and 1.6, 1.2, which within the shapes have variances 2.88 and 0.08;
    # so the sum has 2 * 2.88 + 2 * 0.08 = 5.92. Two of four degrees of freedom are left: t = 4.3027.
    ratio, low, high = of_stratified_ratio(OURS, THEIRS, [2, 2])
    reach = 4.3027 * 5.92**0.5 / 10
    assert (ratio, low, high) == pytest.approx((2.2, 2.2 - reach, 2.2 + reach), rel=1e-4)


def test_what_differs_from_shape_to_shape_is_no_chance():
    estimate = of_stratified_ratio(np.array([2.0, 2.0, 9.0, 9.0]), np.array([1.0, 1.0, 3.0, 3.0]), [2, 2])
    assert estimate == pytest.approx((2.75, 2.75, 2.75))


def test_a_ratio_is_not_negative_and_there_may_be_none():
    assert of_stratified_ratio(np.array([0.0, 9.0, 0.0, 9.0]), np.ones(4), [2, 2]).low == 0.0
    assert np.isnan(of_stratified_ratio(OURS, np.zeros(4), [2, 2]).value)


def test_houses_are_taken_within_their_shapes_where_there_are_several_of_each():
    ours, theirs = ([np.array([mean - 1.0, mean + 1.0]) for mean in means] for means in (OURS, THEIRS))
    assert of_ratio(ours, theirs, [2, 2]) == pytest.approx(of_stratified_ratio(OURS, THEIRS, [2, 2]))
    for sizes in ([4], [1, 3]):
        assert of_ratio(ours, theirs, sizes) == two_level.of_ratio(ours, theirs) != of_ratio(ours, theirs, [2, 2])
    assert of_ratio(ours[:1], theirs[:1], [1]) == intervals.of_ratio(ours[0], theirs[0])


def test_what_the_house_adds_to_a_slowed_caregiver():
    episodes = {"house": ["a", "a", "b"], "caregiver": "foresight", "family": "1", "episode": [0, 1, 0]}
    slow = pd.DataFrame(episodes | {"damage": [9.0, 5.0, 4.0], "pace": [3.0, 3.0, 0.0], "separation": [4.0, 4.0, 6.0]})
    grid = pd.DataFrame(episodes | {"damage": [1.0, 2.0, 0.0]})
    first, both = slowed_lines({"house": ["a"], "all": ["a", "b"]}, ["foresight"], slow, grid)
    assert first["means"] == pytest.approx([1.5, 3.0, 4.0, 7.0])  # grid, pace, separation, house
    assert both["means"] == pytest.approx([1.0, 2.0, 14 / 3, 6.0])
    assert (first["more"].value, both["more"].value) == (3.0, 0.5)  # 3 and -2, of the houses


@pytest.mark.parametrize("episodes", ["-1", "3"])
def test_no_more_episodes_can_be_slowed_than_there_are(monkeypatch, tmp_path, capsys, episodes):
    settings = Settings((FloorPlan.load("paper"),), episodes=2)
    monkeypatch.setattr(shapes, "read_run", lambda folder: (pd.DataFrame(), settings))
    with pytest.raises(SystemExit):
        main(["shapes", "--run", str(tmp_path), "--slowed", episodes])
    assert "--slowed must be" in capsys.readouterr().err


@pytest.mark.slow
def test_the_page(tmp_path, capsys):
    size, run = "8x7-rooms1-stairwells1-candles1-tables2-bins1", tmp_path / "run"
    houses = [f"{shape}-{seed}-{size}" for shape in ("house", "home") for seed in (1, 2)]
    words = ["evaluate", "--houses", *houses, "--caregiver", "none", "expected-danger", "--epsilon", "1"]
    assert cli.main([*words, "--episodes", "2", "--out", str(run), "--json"]) == 0
    assert main(["shapes", "--run", str(run), "--slowed", "1", "--docs", str(tmp_path)]) == 0
    text = (tmp_path / "shapes.md").read_text()
    assert "Alone, 8 of 8 episodes have the same damage" in " ".join(text.split())
    assert "4 of these episodes were also run in the grid" in text
    rows, slowed = (pd.read_csv(tmp_path / f"{name}.csv") for name in ("shapes", "shapes_pace"))
    assert [*slowed["shape"]] == [*rows["shape"]] == ["house", "home", "all"]
    assert [*rows.houses] == [2, 2, 4]
    grid, house = rows.grid, rows.house
    assert f"| {grid[2]:.2f} | {house[2]:.2f} |" in text
    for means in (grid, house):  # of as many houses of each shape
        assert float(means[2]) == pytest.approx((float(means[0]) + float(means[1])) / 2, abs=0.01)
