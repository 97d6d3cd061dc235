"""Harm: a run of two houses and two children whose paired differences are worked by hand."""

import numpy as np
import pandas as pd
import pytest
from test_statistics import frame

from caregiver_mj.experiments.intervals import of_difference
from caregiver_mj.experiments.summary import by_house, harm
from caregiver_mj.experiments.verdicts import holm, least_p_more, sign_flip_p_more

# House, epsilon: seven episodes alone, and what `bully` and `paper` add to each.
CELLS = {
    ("a", 1.0): ([9, 8, 7, 9, 8, 7, 8], [-5, -5, -4, -6, -5, -5, -5], [-8, -8, -7, -9, -8, -7, -8]),
    ("a", 0.5): ([1, 2, 3, 1, 2, 3, 2], [1, 1, 1, 1, 1, 1, 1], [0, -2, 0, 0, -2, 0, 3]),
    ("b", 1.0): ([5, 5, 5, 5, 5, 5, 5], [2, 2, 2, 2, 2, 2, 9], [-5, -5, -5, -5, -5, -5, -5]),
    ("b", 0.5): ([1, 1, 1, 1, 1, 1, 1], [9, 9, 9, -1, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0]),
}


@pytest.fixture(scope="module")
def episodes():
    parts = [
        frame(house, epsilon, none=alone, bully=np.add(alone, bully), paper=np.add(alone, paper))
        for (house, epsilon), (alone, bully, paper) in CELLS.items()
    ]
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def cells(episodes):
    return by_house(episodes)


def test_holm_by_hand():
    # .01 x 4, .02 x 3, .03 x 2 and .04 x 1, none less than the one before it; in any order
    assert holm([0.01, 0.02, 0.03, 0.04]) == pytest.approx([0.04, 0.06, 0.06, 0.06])
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([0.5, 0.9]).tolist() == [1, 1]
    # A test that can show nothing is none: .01 x 2 and .03
    assert holm([0.03, np.nan, 0.01]) == pytest.approx([0.03, np.nan, 0.02], nan_ok=True)


def test_one_sided_p_by_hand():
    differences = np.array([[1.0, 3, -1, 0], [2, -1, -2, 0], [3, 2, -3, 0]])
    # 1 of 8 sums is 6 or more; 2 of 8 are 4 or more; the others are not above zero
    assert sign_flip_p_more(differences).tolist() == [1 / 8, 2 / 8, 1, 1]
    assert least_p_more(differences).tolist() == [1 / 8, 1 / 8, 1 / 8, 1]


def test_cells_by_hand(cells):
    bully = cells[cells.caregiver == "bully"].set_index(["house", "epsilon"])
    wanted = {("a", 1.0): -5, ("a", 0.5): 1, ("b", 1.0): 3, ("b", 0.5): 26 / 7}
    assert bully.damage_difference.to_dict() == pytest.approx(wanted)
    assert bully.worse.to_dict() == pytest.approx({("a", 1.0): 0, ("a", 0.5): 1, ("b", 1.0): 1, ("b", 0.5): 3 / 7})
    # All seven of one sign: 1 of 128. Of 9, 9, 9 and -1, 2 of 16 sums are 26 or more.
    wanted = {("a", 1.0): 1, ("a", 0.5): 1 / 128, ("b", 1.0): 1 / 128, ("b", 0.5): 2 / 16}
    assert bully.harm_p.to_dict() == pytest.approx(wanted)
    # Times 4, 3 (but no less than the one before), 2 and 1
    wanted = {("a", 1.0): 1, ("a", 0.5): 4 / 128, ("b", 1.0): 4 / 128, ("b", 0.5): 4 / 16}
    assert bully.harm_p_holm.to_dict() == pytest.approx(wanted)
    assert bully.harm_verdict.to_dict() == {
        ("a", 1.0): "no verdict",
        ("a", 0.5): "more",
        ("b", 1.0): "more",
        ("b", 0.5): "no verdict",
    }
    assert (cells[cells.caregiver == "none"].harm_verdict == "").all()


def test_a_harmful_caregiver_is_named(cells):
    bully, paper = harm(cells)
    assert (bully["caregiver"], bully["baseline"], bully["cells"], bully["cells_harmed"]) == ("bully", "none", 4, 2)
    assert (bully["episodes"], bully["episodes_worse"]) == (28, pytest.approx(17 / 28))
    assert bully["cells_decidable"] == 3  # where seven differ: 4 / 128; where four do it is 4 / 16 at the least
    # The worst of those where harm is shown, though the difference is greater in another one
    worst = bully["worst"]
    assert (worst["house"], worst["family"], worst["damage_alone"], worst["damage_with"]) == ("b", "1", 5, 8)
    assert (worst["damage_difference"], worst["p_holm"], worst["verdict"]) == (3, 4 / 128, "more")
    low, high = of_difference(np.array([7.0] * 6 + [14]), np.full(7, 5.0))[1:]
    assert worst["damage_difference_ci_low"] == pytest.approx(low)
    assert worst["damage_difference_ci_high"] == (pytest.approx(high) if np.isfinite(high) else None)
    # One episode is 3 worse; the greatest difference of all is that of no change.
    assert (paper["cells_harmed"], paper["episodes_worse"]) == (0, pytest.approx(1 / 28))
    assert (paper["worst"]["house"], paper["worst"]["family"], paper["worst"]["verdict"]) == ("b", "0.5", "no verdict")


def test_the_floor_is_no_caregiver(episodes):
    cells = by_house(episodes.replace({"caregiver": {"paper": "floor"}}))
    assert [row["caregiver"] for row in harm(cells)] == ["bully"]
