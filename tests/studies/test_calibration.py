"""The study of calibration: its sums by hand, and a child that is the model itself."""

import numpy as np
import pandas as pd
import pytest
from worlds import streams

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.danger.child_model import EPSILONS
from caregiver_mj.plans.floor_plan import FloorPlan
from studies.calibration import EACH, Scores, reliability, sums_of, watch_children

# One cell: a toy west of it, stairs east, a table with a candle north and a bare one south.
SMALL = FloorPlan.parse("#####\n##C##\n#B.S#\n##T##\n#####", "small")


def test_the_first_prediction_by_hand():
    """In one cell between everything any random move bumps, and no other: a fourth of epsilon for each object."""
    watched = watch_children(SMALL, [ChildGroup.of(1.0)], streams(3), (1, 2), change=0.0)
    # Novices, explorers and who wants to the caregiver go to the toy, and one in twenty makes for the three objects.
    epsilon, others = np.array(EPSILONS), np.array([0.05, 0.5])
    weight = np.concatenate([np.full(5, 0.85 / 5), np.full(4, 0.05 / 2), np.full(2, 0.05 / 2)])
    at_random = np.concatenate([epsilon, others, others, others]) / 4
    makes_for = np.array([False] * 9 + [True] * 2)
    each = at_random + np.where(makes_for, (1 - 4 * at_random) / 3, 0.0)  # probability of every object
    assert watched.predicted[0, 0, :, :3] == pytest.approx(weight @ each)
    # Within two: at once, or after another one of the three, or none. Whoever has made for one wants to a toy then, as
    # likely as not.
    then = np.where(makes_for, (each + at_random) / 2, each)  # after a bump
    assert watched.predicted[1, 0, :, 0] == pytest.approx(weight @ (each + 2 * each * then + (1 - 3 * each) * each))
    assert watched.predicted[0, 0, :, -1] == pytest.approx(weight @ each * 3)  # anything
    assert watched.possible.all()
    # Every move tells: the toy speaks for a careful child.
    bumped = watched.bumped[0, :, -1][:, None]
    after = weight * np.where(bumped, 3 * each, 1 - 3 * each)
    next_time = np.where(bumped, then, each)
    assert watched.predicted[0, 1, :, 0] == pytest.approx((after * next_time).sum(axis=1) / after.sum(axis=1))


def made(house, place, count, predicted, happened):
    each = predicted / count
    square = happened * (1 - each) ** 2 + (count - happened) * each**2
    what = {"family": "1", "horizon": 5, "kind": EACH[0], "house": house, "bin": place}
    return what | {"count": count, "predicted": predicted, "happened": happened, "square": square}


def test_scores_by_hand():
    # Ten predictions of 0.1 of which two come true, and ten of 0.5, of which four do.
    rows = pd.DataFrame([made("a", 1, 10, 1.0, 2.0), made("b", 2, 10, 5.0, 4.0)])
    sums = sums_of(rows, "1", 5)
    scores = Scores.of(sums)
    assert scores.base_rate == pytest.approx(0.3)
    assert scores.mean == pytest.approx(0.3)
    assert scores.bias.value == pytest.approx(1.0)
    brier = (2 * 0.81 + 8 * 0.01 + 10 * 0.25) / 20
    assert scores.brier == pytest.approx(brier)
    assert scores.skill.value == pytest.approx(1 - brier / (0.3 * 0.7))
    assert scores.calibration_error == pytest.approx(0.1)  # each bin is off by 0.1
    predicted, frequency = reliability(sums)
    assert predicted[1:3] == pytest.approx([0.1, 0.5])
    assert frequency.value[1:3] == pytest.approx([0.2, 0.4])
    assert np.isnan(predicted[0])
    low, high = Scores.of(sums[..., :2]), Scores.of(sums[..., 2:])
    assert (low.base_rate, low.mean) == (pytest.approx(0.2), pytest.approx(0.1))
    assert (high.base_rate, high.mean) == (pytest.approx(0.4), pytest.approx(0.5))
