"""The study of house and grid by shape: the ratio over a sample with so many houses of each shape."""

import numpy as np
import pytest

from caregiver_mj.experiments import intervals, two_level
from studies.shapes import of_ratio, of_stratified_ratio

OURS, THEIRS = np.array([2.0, 4.0, 6.0, 10.0]), np.array([1.0, 3.0, 2.0, 4.0])


def test_a_ratio_of_two_houses_of_each_of_two_shapes():
    # R = 22 / 10. The errors y - R x are -0.2, -2.6 and 1.6, 1.2, which within the shapes have variances 2.88 and 0.08;
    # so the sum has 2 * 2.88 + 2 * 0.08 = 5.92. Two of four degrees of freedom are left: t = 4.3027.
    ratio, low, high = of_stratified_ratio(OURS, THEIRS, [2, 2])
    reach = 4.3027 * 5.92**0.5 / 10
    assert (ratio, low, high) == pytest.approx((2.2, 2.2 - reach, 2.2 + reach), rel=1e-4)


def test_a_ratio_is_not_negative_and_there_may_be_none():
    assert of_stratified_ratio(np.array([0.0, 9.0, 0.0, 9.0]), np.ones(4), [2, 2]).low == 0.0
    assert np.isnan(of_stratified_ratio(OURS, np.zeros(4), [2, 2]).value)


def test_houses_are_taken_within_their_shapes_where_there_are_several_of_each():
    ours, theirs = ([np.array([mean - 1.0, mean + 1.0]) for mean in means] for means in (OURS, THEIRS))
    assert of_ratio(ours, theirs, [2, 2]) == pytest.approx(of_stratified_ratio(OURS, THEIRS, [2, 2]))
    for sizes in ([4], [1, 3]):
        assert of_ratio(ours, theirs, sizes) == two_level.of_ratio(ours, theirs) != of_ratio(ours, theirs, [2, 2])
    assert of_ratio(ours[:1], theirs[:1], [1]) == intervals.of_ratio(ours[0], theirs[0])
