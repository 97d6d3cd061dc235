"""The study of generalisation: what it measures, its page and its figure."""

import numpy as np
import pytest

from caregiver_mj.plans.floor_plan import FloorPlan
from studies.generalisation import Job, Walks, area_under_curve, draw, page, run_job, tell


@pytest.fixture(scope="module")
def found():
    return run_job(Job("house-1-9x8-rooms1-stairwells1-candles1-tables2-bins2", "train-2", 4, 2, 2))


def test_the_area_under_the_curve_by_hand():
    # Of the four pairs of one that is and one that is not: two right, one tie, one wrong.
    assert area_under_curve(np.array([1.0, 3.0, 2.0, 1.0]), np.array([True, True, False, False])) == 0.625
    assert np.isnan(area_under_curve(np.arange(3.0), np.ones(3, bool)))


def test_telling_by_hand():
    """Two cells in a row; one child goes east to the bin for ever, another one west, and is hurt by it at last."""
    plan = FloorPlan.parse("#####\n#S.B#\n#####")
    theta = np.array([[0.125, 0.5, 0.125, 0.25]])
    action = np.tile([1, 2], (20, 1))
    hurt = np.zeros((20, 2), bool)
    hurt[16, 1] = True
    told = tell(plan, theta, Walks(np.zeros((20, 2), int), action, hurt, np.array([0.25, 0.75])))
    careful, safe, brier, brier_safe, routes = told.measures
    assert careful == 1.0
    # P(safe) is 2^t / (2^t + 1) of the one, and 1 less that of the other.
    error = 1 / (1 + 2.0 ** np.arange(1, 21)) ** 2
    assert brier == pytest.approx(error[:20].mean())
    # After timesteps 1 to 5 there are 15 more; the collision is in the 17th, within reach from the second on.
    assert safe == pytest.approx(1.0)
    right = np.arange(1, 6) > 1
    of_other = np.where(right, error[:5], (1 - error[:5] ** 0.5) ** 2)
    assert brier_safe == pytest.approx((error[:5].sum() + of_other.sum()) / 10)
    assert routes == pytest.approx(np.log(0.5))
    assert told.course == pytest.approx(np.ones(20))


def test_page_and_figure(found):
    both = [found, found]  # two houses that happen to be alike
    text = page(both, "test-2", "train-2").text("generalisation", "the command")
    assert text.startswith("# Generalisation\n")
    assert "over the 2 houses of `test-2`" in text
    assert "nan" not in text
    assert (text.count("| `knows-goal` |"), len(draw(both).axes)) == (2, 3)
