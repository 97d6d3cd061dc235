"""The figures that take plain tables: what is drawn where."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.viz import figures


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
    share = figures.going(episodes, np.array([0, 9, 10, 99, 100, 199, 200]))
    assert share == pytest.approx([1, 1, 0.75, 0.75, 0.5, 0.5, 0.25])  # the third is never stopped
