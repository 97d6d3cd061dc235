"""The figures that take plain tables: what is drawn where."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.viz import figures
from caregiver_mj.viz.figures.shares import going

NAMES = {"1": "random motion", "0.5": "50 % random"}
COLUMNS = ["caregiver", "family", "damage_left", "damage_left_ci_low", "damage_left_ci_high"]
MEANS = pd.DataFrame(
    [
        ("random", "1", 0.7, 0.6, 0.8),
        ("paper", "1", 0.3, 0.2, 0.4),
        ("floor", "1", 0.25, 0.2, 0.3),
        ("random", "0.5", 0.8, 0.6, None),  # nothing bounds it from above
        ("paper", "0.5", 0.4, 0.3, 0.5),
        ("floor", "0.5", 0.1, 0.0, 0.2),
    ],
    columns=COLUMNS,
)


def by_house(left):
    return pd.DataFrame(
        [("paper", family, value) for family in NAMES for value in left], columns=["caregiver", "family", "damage_left"]
    )


def test_every_house_with_damage_is_a_point_and_the_floor_a_line():
    figure = figures.houses(by_house([0.2, 0.3, 0.5, np.nan]), MEANS, NAMES)
    for axes, level in zip(figure.axes, (0.25, 0.1), strict=True):
        drawn = [c for c in axes.collections if type(c).__name__ == "PathCollection" and len(c.get_offsets())]
        assert sorted(float(x) for c in drawn for x in c.get_offsets()[:, 0]) == [0.2, 0.3, 0.5]
        assert [label.get_text() for label in axes.get_yticklabels()] == ["random", "paper"]  # as in the run
        heights = [float(y) for c in drawn for y in c.get_offsets()[:, 1]]
        assert np.all(np.abs(np.array(heights) - 1) < 0.5)  # in the row of `paper`
        dashed = [line for line in axes.lines if line.get_linestyle() == "--" and len(set(line.get_xdata())) == 1]
        assert [float(line.get_xdata()[0]) for line in dashed] == [level]
    assert [axes.get_title(loc="left") for axes in figure.axes] == list(NAMES.values())
    alone = figures.houses(None, MEANS, NAMES).axes[0]  # of a single house
    assert [float(line.get_xdata()[0]) for line in alone.lines if line.get_marker() == "D"] == [0.7, 0.3]


def test_kinds_are_shares_of_the_damage_without():
    rows = [
        ("none", "1", 10.0, 5.0, 4.0, 1.0),
        ("paper", "1", 4.0, 1.0, 0.0, 3.0),
        ("floor", "1", 2.0, 0.0, 0.0, 2.0),
    ]
    done = ["damage_mean", *(f"damage_{kind}_mean" for kind in ("stairwell", "candle", "table"))]
    means = pd.DataFrame(rows, columns=["caregiver", "family", *done]).assign(damage_gate_mean=0.0)
    (axes,) = figures.kinds(means, {"1": "random"}).axes
    heights = [patch.get_height() for patch in axes.patches]
    assert heights == pytest.approx([0.5, 0.4, 0.1, 0.1, 0.0, 0.3])
    assert [bar.get_y() for bar in axes.patches] == pytest.approx([0, 0.5, 0.9, 0, 0.1, 0.1])
    assert [text.get_text() for text in axes.texts[:2]] == ["10.0", "4.0"]
    (floor,) = axes.collections
    assert floor.get_segments()[0][:, 1] == pytest.approx([0.2, 0.2])


def test_survival_is_the_share_not_yet_stopped():
    episodes = pd.DataFrame({"timesteps_to_threshold": [10, 100, 200, 200], "stopped": [1, 1, 0, 1]})
    share = going(episodes, np.array([0, 9, 10, 99, 100, 199, 200]))
    assert share == pytest.approx([1, 1, 0.75, 0.75, 0.5, 0.5, 0.25])  # the third is never stopped


def test_toys_have_the_margin_as_a_line():
    series = figures.Series("paper", np.array([0.99, 1.01]), np.array([0.98, np.nan]), np.array([1.0, np.nan]))
    (axes,) = figures.toys_kept(["a", "b"], [series], 0.03).axes
    assert 0.97 in [float(line.get_ydata()[0]) for line in axes.lines]
    intervals = axes.collections[0].get_segments()
    assert intervals[0][:, 1] == pytest.approx([0.98, 1.0])
    assert intervals[1][:, 1] == pytest.approx(axes.get_ylim())  # unknown at both ends
